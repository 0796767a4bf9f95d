"""Records of thresholds: `threshold`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import ClassVar, Literal

from analysis.kinds import KEYS, NAMED, TIME, ColumnWords, Count, Level, Name, SoFar, Trial

YES_NO: Mapping[str, str] = MappingProxyType({"left": "yes", "pad_left": "yes", "right": "no", "pad_right": "no"})
_PLACES = {"two_places": ("top", "left"), "two_intervals": ("interval_1",)}


class ThresholdRecord(Trial):
    """A stimulus at a level of the factor, or none (``level`` is None), and the answer."""

    heading = "Thresholds"
    description = "a stimulus at a level of a factor that follows the answers, detected or not"
    did = "detected stimuli at levels that were chosen by earlier answers"
    counted_as = ("trial at a threshold", "trials at thresholds")
    report_part = "thresholds"
    not_reported: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("correct", "stimulus"), "follows from the other fields"),
        "first_position": "where the first picture stood",
        "reference": "the picture that it was compared with",
        "track": "which of the interleaved series it belongs to",
        "track_trial": "its number in that series",
        "response_time_s": TIME,
    }

    columns: ClassVar[Mapping[str, ColumnWords]] = {
        "factor": ColumnWords("The factor of the stimuli whose threshold was measured."),
        "reference": ColumnWords(f"Name of the stimulus without a signal beside or before the other. {NAMED}"),
        "track": ColumnWords("Number of the adaptive track that chose the level, from 0; empty without a signal."),
        "track_trial": ColumnWords("Number of the trial in its track, from 0."),
        "easier": ColumnWords("Whether higher or lower levels are easier."),
    }
    no_stimulus: ClassVar[tuple[str, ...]] = ("task", "factor", "function", "method", "easier", "correct_answer")
    asked: ClassVar[tuple[str, ...]] = (
        *("task", "factor", "stimulus", "level", "reference", "first_position", "correct_answer"),
        *("track", "track_trial", "group", "group_factor", "method", "function", "easier"),
    )

    task: Literal["yes_no", "two_intervals", "two_places"]
    factor: Name
    stimulus: Name
    level: Level | None
    answer: Literal["first", "second", "yes", "no"]
    method: Literal["quest_plus", "staircase"]
    function: Literal["weibull", "logistic", "normal"]
    easier: Literal["higher", "lower"]
    reference: Name | None = None
    first_position: Literal["top", "left", "interval_1"] | None = None
    correct_answer: Literal["first", "second"] | None = None
    correct: bool | None = None
    group: str | None = None
    group_factor: str | None = None
    track: Count | None = None
    track_trial: Count | None = None

    @property
    def said(self) -> str:
        """What was answered."""
        return self.answer

    @property
    def is_right(self) -> bool:
        """Whether what was shown was seen, or told from the reference."""
        return self.answer == ("yes" if self.task == "yes_no" else self.correct_answer)

    @property
    def stimuli(self) -> tuple[str, ...]:
        """The stimulus, and the reference of a forced choice."""
        return (self.stimulus,) if self.reference is None else (self.stimulus, self.reference)

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the answer with the task, the level and the group with the stimulus's factors, tracks in turn."""
        forced = self.task != "yes_no"
        if forced != (self.answer in ("first", "second")):
            yield f"the answer is '{self.answer}', which the task {self.task} has not"
        there = [each is not None for each in (self.reference, self.first_position, self.correct_answer, self.correct)]
        if any(each != forced for each in there):
            yield "'reference', 'first_position', 'correct_answer' and 'correct' belong to a forced choice, all of them"
        elif forced:
            if self.correct != (self.answer == self.correct_answer):
                right = f"right is '{self.correct_answer}', and 'correct' is {self.correct}"
                yield f"the answer is '{self.answer}', {right}"
            if self.first_position not in _PLACES[self.task]:
                yield f"the task {self.task} has no place '{self.first_position}'"
            if self.reference == self.stimulus:
                yield f"it compares '{self.stimulus}' with itself"
        yield from self._levels(session)
        yield from self._track(session)

    def _levels(self, session: SoFar) -> Iterator[str]:
        if self.level is None and self.task != "yes_no":
            yield "a forced choice has a 'level'"
        factors = session.factors.get(self.stimulus, {})
        known = factors.get(self.factor)
        if self.level is not None and known is not None and known != self.level:
            yield f"its level is {self.level:g}, but the {self.factor} of '{self.stimulus}' is '{known}'"
        if (self.group is None) != (self.group_factor is None):
            yield "'group' and 'group_factor' are there together or not at all"
        elif self.group is not None and self.level is not None:
            level = factors.get(self.group_factor or "")
            if level is not None and (level if isinstance(level, str) else f"{level:g}") != self.group:
                yield f"its group is '{self.group}', but the {self.group_factor} of '{self.stimulus}' is '{level}'"

    def _track(self, session: SoFar) -> Iterator[str]:
        """Compare a track with its trial before: numbered in turn, of one factor, group, method and function."""
        if (self.track is None) != (self.level is None) or (self.track_trial is None) != (self.track is None):
            yield "'track' and 'track_trial' belong to trials with a 'level', and to no others"
            return
        if self.track is None or self.track_trial is None or self.attempt:
            return
        place = ("track", self.block, self.track)
        what = self.task, self.factor, self.group, self.group_factor, self.method, self.function, self.easier
        number, before = session.seen.get(place, (-1, what))
        if self.track_trial != number + 1:
            yield (
                f"trial {self.track_trial} of track {self.track} follows its trial {number}"
                if number >= 0
                else (f"track {self.track} begins with its trial {self.track_trial}")
            )
        elif what != before:
            yield f"track {self.track} is of another task, factor, group, method or function than before"
        session.seen[place] = self.track_trial, what

    def pressed_otherwise(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the answer with its key."""
        yield from super().pressed_otherwise(session, practised=practised)
        yield from self.timed_by_press(last=not practised)
        key = self.answer_key(last=not practised)
        if key is not None:
            usual = YES_NO if self.first_position is None else KEYS[self.first_position]
            yield from session.key_means(self.first_position or "yes_no", key, self.answer, usual)
