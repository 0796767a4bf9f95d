"""Records of `all_pairs`: two stimuli compared, with catch trials and ratings among them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar, Literal

from analysis.kinds.fields import Fields, Name, Seconds
from analysis.kinds.pair import EachRating, PairRecord
from analysis.kinds.trial import TIMES, Rated, SoFar


class EachTime(Fields):
    """How long both ratings of a pair took, in s."""

    first: Seconds
    second: Seconds


class AllPairsRecord(PairRecord):
    """A pair of `all_pairs`; catch trials and ratings may be among them."""

    heading = "Paired comparisons"
    description = "two stimuli, one chosen; all pairs are compared"
    did = "compared pairs of {stimuli} stimuli"
    not_reported: ClassVar[Mapping[str, str]] = {
        "rating_times_s": TIMES,
        "group_factor": "the factor that has the groups' names",
    }

    asked: ClassVar[tuple[str, ...]] = (*PairRecord.asked, "catch")

    written = ("first", "second", "answer", "chosen", "rejected", "first_position", "catch", "correct")

    catch: Literal["obvious", "identical"] | None = None
    """Which catch trial it is, if any."""
    correct: bool | None = None
    """Whether a catch trial with an obvious answer was answered so."""
    rating_times_s: dict[Name, Seconds | EachTime | None] | None = None
    """How long each rating took, in s."""

    @property
    def is_scored(self) -> bool:
        """Whether it is no catch trial, which scores leave out."""
        return self.catch is None and not self.is_practice

    def rated(self) -> Iterator[Rated]:
        """Yield the ratings, but those of a catch trial."""
        return super().rated() if self.catch is None else iter(())

    def may_be_alike(self) -> bool:
        """Return whether it is such a catch trial."""
        return self.catch == "identical"

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare what is right in a catch trial, and ratings with what was chosen."""
        yield from super().contradictions(session, practised=practised)
        if (self.correct is not None) != (self.catch == "obvious"):
            yield "'correct' belongs to catch trials with an obvious answer, and to no other"
        elif self.correct and self.chosen is None:
            yield "nothing is chosen, and yet it is correct"
        if self.ratings or self.rating_times_s:
            yield from self._ratings()

    def _ratings(self) -> Iterator[str]:
        ratings, times_s = self.ratings or {}, self.rating_times_s or {}
        if ratings.keys() != times_s.keys():
            yield "'ratings' and 'rating_times_s' are not of the same scales"
            return
        for name, value in ratings.items():
            both = isinstance(value, EachRating)
            if (value is None) != (times_s[name] is None) or both != isinstance(times_s[name], EachTime):
                yield f"the rating '{name}' and its time are not of the same stimuli"
            elif not both and (value is None) == (self.answer in ("first", "second")):
                yield f"the rating '{name}' is {'missing' if value is None else 'there'}, by the answer it is not"

    def pressed_otherwise(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the times of ratings with the presses."""
        yield from super().pressed_otherwise(session, practised=practised)
        taken_s = sum([seconds for _, seconds in self.events])
        for name, time_s in (self.rating_times_s or {}).items():
            if isinstance(time_s, float) and time_s > taken_s + 1e-5:
                yield f"the rating '{name}' took {time_s:g} s, longer than all its events"
