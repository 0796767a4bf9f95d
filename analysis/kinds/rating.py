"""Records of `rating`, a picture rated alone; and what all records with ratings have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

from analysis.kinds.fields import Name, Seconds, Whole
from analysis.kinds.trial import ROUNDING_S, TIME, TIMES, Rated, SoFar, Trial

_ACCEPT = ("enter", "space", "pad_a", "click accept")


class RatedRecord(Trial):
    """A record with ratings by the scale's name, and the time that each took in s."""

    ratings: dict[Name, Whole]
    rating_times_s: dict[Name, Seconds]

    @property
    def said(self) -> str:
        """What was answered."""
        return ", ".join(f"{name} {value}" for name, value in self.ratings.items())

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the ratings with their times."""
        if self.ratings.keys() != self.rating_times_s.keys():
            yield "'ratings' and 'rating_times_s' are not of the same scales"

    def pressed_otherwise(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the times with the presses, and a rating with the digit that gave it."""
        yield from super().pressed_otherwise(session, practised=practised)
        total = sum([seconds for _, seconds in self.events])
        if sum(self.rating_times_s.values()) > total + ROUNDING_S * (1 + len(self.events) + len(self.ratings)):
            yield f"the ratings took longer than all events ({total:g} s)"
        # Where keys have other meanings, a digit may move the marker or accept where it stands.
        if len(self.ratings) == 1 and not practised and not session.own_keys:
            ((name, value),) = self.ratings.items()
            keys = [key for key, _ in self.events[-2:]]
            if keys and keys[-1] in _ACCEPT:
                keys.pop()
            if keys and keys[-1].isdecimal():
                yield from session.key_means(f"scale {name} of block {self.block}", keys[-1], str(value), {})


class RatingRecord(RatedRecord):
    """A picture rated alone."""

    heading = "Ratings"
    description = "one stimulus, rated on a scale"
    did = "rated single stimuli"
    counted_as = ("stimulus rated", "rating screens")
    report_part = "ratings"
    not_reported: ClassVar[Mapping[str, str]] = {"rating_times_s": TIMES, "response_time_s": TIME}

    asked: ClassVar[tuple[str, ...]] = ("stimulus",)

    written = ("stimulus",)

    stimulus: Name

    @property
    def stimuli(self) -> tuple[str, ...]:
        """The one."""
        return (self.stimulus,)

    def rated(self) -> Iterator[Rated]:
        """Yield each rating."""
        yield from (Rated("alone", scale, self.stimulus, value) for scale, value in self.ratings.items())

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the response time with those of the ratings."""
        yield from super().contradictions(session, practised=practised)
        if abs(self.response_time_s - sum(self.rating_times_s.values())) > ROUNDING_S * (1 + len(self.ratings)):
            yield f"the response time is {self.response_time_s:g} s, which is not that of its ratings together"
