"""Records of two stimuli compared: `all_pairs`, `active_pairs`, `preference`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, Strict

from analysis.records.fields import Count, Fields, Name, Seconds, Whole
from analysis.records.trial_record import Session, TrialRecord, is_near

Answer = Literal["first", "second"]
_TIES = {"n": "no_difference", "u": "not_sure"}
# What keys mean by where the first stimulus stood, unless the experiment gives them other meanings.
KEYS: Mapping[str | None, Mapping[str, str]] = MappingProxyType(
    {
        "top": {"up": "first", "pad_up": "first", "down": "second", "pad_down": "second", **_TIES},
        "left": {"left": "first", "pad_left": "first", "right": "second", "pad_right": "second", **_TIES},
        "interval_1": {
            **dict.fromkeys(("1", "left", "pad_left"), "first"),
            **dict.fromkeys(("2", "right", "pad_right"), "second"),
            **_TIES,
        },
    }
)


class EachRating(Fields):
    """A rating of both stimuli of a pair."""

    first: Whole
    second: Whole


class EachTime(Fields):
    """How long both ratings of a pair took, in s."""

    first: Seconds
    second: Seconds


class PairRecord(TrialRecord):
    """Two stimuli in their places, and the answer."""

    asked: ClassVar[tuple[str, ...]] = ("first", "second", "first_position", "group", "group_factor")

    first: Name
    second: Name
    answer: Literal["first", "second", "no_difference", "not_sure"]
    chosen: Name | None = None
    rejected: Name | None = None
    first_position: Literal["top", "left", "interval_1"] | None = None
    group: str | None = None
    group_factor: str | None = None
    ratings: dict[Name, Whole | EachRating | None] | None = None

    @property
    def stimuli(self) -> tuple[str, ...]:
        """Both."""
        return self.first, self.second

    def contradictions(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the choice with the answer, and the group with the stimuli's factors."""
        yield from self._choice()
        yield from self._group(session.factors)

    def pressed_otherwise(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the answer with its key."""
        yield from super().pressed_otherwise(session, practised=practised)
        last = self.ratings is None and not practised
        yield from self.timed_by_press(last=last)
        key = self.answer_key(last=last)
        if key is not None and self.first_position is not None:
            yield from session.key_means(self.first_position, key, self.answer, KEYS[self.first_position])

    def may_be_alike(self) -> bool:
        """Return whether it may show a stimulus beside itself."""
        return False

    def _choice(self) -> Iterator[str]:
        alike = self.first == self.second
        if alike != self.may_be_alike():
            yield f"it compares '{self.first}' with '{self.second}'" + ("" if alike else ", not with itself")
        pair = {"first": (self.first, self.second), "second": (self.second, self.first)}.get(self.answer)
        due = (None, None) if alike or pair is None else pair
        if (self.chosen, self.rejected) != due:
            words = "nothing is chosen" if due[0] is None else f"'{due[0]}' is chosen and '{due[1]}' rejected"
            yield f"by its answer '{self.answer}' {words}, but it has '{self.chosen}' and '{self.rejected}'"

    def _group(self, factors: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
        if (self.group is None) != (self.group_factor is None):
            yield "'group' and 'group_factor' are there together or not at all"
        elif self.group is not None:
            for name in self.stimuli:
                level = factors.get(name, {}).get(self.group_factor or "")
                if level is not None and (level if isinstance(level, str) else f"{level:g}") != self.group:
                    yield f"its group is '{self.group}', but the {self.group_factor} of '{name}' is '{level}'"


class AllPairsRecord(PairRecord):
    """A pair of `all_pairs`; catch trials and ratings may be among them."""

    asked: ClassVar[tuple[str, ...]] = (*PairRecord.asked, "catch")

    catch: Literal["obvious", "identical"] | None = None
    correct: bool | None = None
    rating_times_s: dict[Name, Seconds | EachTime | None] | None = None

    def may_be_alike(self) -> bool:
        """Return whether it is such a catch trial."""
        return self.catch == "identical"

    def contradictions(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare what is right in a catch trial, and ratings with what was chosen."""
        yield from super().contradictions(session, practised=practised)
        if (self.correct is not None) != (self.catch == "obvious"):
            yield "'correct' belongs to catch trials with an obvious answer, and to no other"
        elif self.correct and self.chosen is None:
            yield "nothing is chosen, and yet it is correct"
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

    def pressed_otherwise(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the times of ratings with the presses."""
        yield from super().pressed_otherwise(session, practised=practised)
        taken_s = sum([seconds for _, seconds in self.events])
        for name, time_s in (self.rating_times_s or {}).items():
            if isinstance(time_s, float) and time_s > taken_s + 1e-5:
                yield f"the rating '{name}' took {time_s:g} s, longer than all its events"


class ActivePairsRecord(PairRecord):
    """A pair of `active_pairs`, in its batch."""

    batch: Count

    def contradictions(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the batch with the one before."""
        yield from super().contradictions(session, practised=practised)
        if self.attempt == 0:
            before = session.seen.get(("batch", self.block), 0)
            if self.batch not in (before, before + 1):
                yield f"batch {self.batch} follows batch {before}"
            session.seen["batch", self.block] = self.batch


class PreferenceRecord(PairRecord):
    """Both versions of a picture, and which was preferred."""

    answer: Answer
    chosen_view: Literal["stereo", "flat"]
    first_view: Literal["stereo", "flat"]
    interval_s: Annotated[tuple[Seconds, Seconds], Strict(False)] | None = Field(default=None)

    def contradictions(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the versions with the choice."""
        yield from super().contradictions(session, practised=practised)
        if (self.chosen_view == self.first_view) != (self.answer == "first"):
            yield f"the first is {self.first_view}, the answer {self.answer} and the chosen one {self.chosen_view}"

    def pressed_otherwise(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the times on the intervals with the presses."""
        yield from super().pressed_otherwise(session, practised=practised)
        times = [seconds for _, seconds in self.events]
        if any(not is_near(seconds, times) for seconds in self.interval_s or ()):
            yield "the observer stayed on an interval for a time that no press ended"
