"""Records of `screening`: presentations of tests of vision, what came of each test, and the end after a failed one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Literal, get_args

from pydantic import Field

from analysis.kinds import Count, Fields, Json, Name, Number, OutcomeRecord, SoFar, Text, Trial

Side = Literal["up", "down", "left", "right"]
SIDES: tuple[Side, ...] = get_args(Side)
KEYS: Mapping[str, Side] = MappingProxyType({f"{where}{side}": side for where in ("", "pad_") for side in SIDES})


class ScreeningRecord(Trial):
    """A record of a test of vision: a presentation, an outcome, or that the session ended."""

    answers_task = False
    description = "a test of the observer's vision"
    report_part = "vision"
    no_stimulus: ClassVar[tuple[str, ...]] = ("test",)

    @classmethod
    def of_line(cls, line: Mapping[str, Any]) -> type[Trial]:
        """Return which of the three a line is."""
        if "outcome" in line or "by_series" in line:
            return VisionOutcomeRecord
        return ScreenedOutRecord if "screened_out" in line else PresentationRecord


class PresentationRecord(ScreeningRecord):
    """One presentation of a test of vision."""

    not_reported: ClassVar[Mapping[str, str]] = {
        "presentation": "each single presentation and its answer; the test's outcome is reported",
    }

    asked: ClassVar[tuple[str, ...]] = ("test", "series", "level", "unit", "presentation", "correct_answer")

    written = ("test", "series", "level", "unit", "presentation", "...")

    test: Name
    series: Name
    level: Number
    unit: Text
    presentation: Count
    """Its number in the test, from 0."""
    correct_answer: Side
    answer: Side
    correct: bool

    @property
    def said(self) -> str:
        """What was answered."""
        return self.answer

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the answer with what is right."""
        if self.correct != (self.answer == self.correct_answer):
            yield f"the answer is '{self.answer}', right is '{self.correct_answer}', and 'correct' is {self.correct}"
        yield from _unit(session, self.test, self.unit)
        given = session.seen.setdefault(("screening", self.block, self.test, self.series), [])
        given.append(self.correct)

    def pressed_otherwise(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the answer with its key."""
        yield from super().pressed_otherwise(session, practised=practised)
        yield from self.timed_by_press(last=not practised)
        key = self.answer_key(last=not practised)
        if key is not None:
            yield from session.key_means("side", key, self.answer, KEYS)


def _unit(session: SoFar, test: str, unit: str) -> Iterator[str]:
    before = session.seen.setdefault(("unit", test), unit)
    if unit != before:
        yield f"the test '{test}' is in {unit} here, and in {before} before"


class SeriesOutcome(Fields):
    """What came of one series of a test."""

    passed: bool
    threshold: Number | None = None
    estimate: Number | None = None
    presentations: Count
    right: Count


class Outcome(Fields):
    """What came of a test; ``threshold`` is the finest level passed, in ``unit``; None if no level was passed.

    ``estimate`` is by maximum likelihood, None where answers leave it open. Control plates are those everyone sees.
    """

    passed: bool
    threshold: Number | None = None
    estimate: Number | None = None
    pass_mark: Number
    unit: Text
    controls_seen: bool


class VisionOutcomeRecord(ScreeningRecord, OutcomeRecord):
    """The record that states what came of a test."""

    not_reported: ClassVar[Mapping[str, str]] = {
        "by_series": "what came of each series of a test",
        "outcome.controls_seen": "whether what everyone sees was seen",
        "screen": "what the screen can show of the test",
    }

    asked: ClassVar[tuple[str, ...]] = ("test",)

    test: Name
    outcome: Outcome
    by_series: dict[Name, SeriesOutcome] = Field(min_length=1)
    screen: Json = Field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether the test was passed."""
        return self.outcome.passed

    @property
    def reached(self) -> str:
        """What was reached, such as "passed 200 arcsec, pass mark 140 arcsec"."""
        result = self.outcome
        unit = {"arcsec": " arcsec", "logmar": " logMAR", "delta_uv": " in u′v′"}.get(result.unit, f" {result.unit}")
        reached = "no level passed" if result.threshold is None else f"passed {result.threshold:g}{unit}"
        if not result.controls_seen:
            reached += ", missed control plates that everyone sees"
        return f"{reached}, pass mark {result.pass_mark:g}{unit}"

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the outcome with that of each series, and these with the presentations."""
        if self.response_time_s:
            yield "an outcome has no response time"
        if self.outcome.passed != all(each.passed for each in self.by_series.values()):
            yield "the test is passed if every series is, and not otherwise"
        if self.outcome.threshold not in (None, *(each.threshold for each in self.by_series.values())):
            yield f"the threshold {self.outcome.threshold} is that of no series"
        if self.outcome.estimate not in (None, *(each.estimate for each in self.by_series.values())):
            yield f"the estimate {self.outcome.estimate} is that of no series"
        for name, each in self.by_series.items():
            if each.threshold is not None and each.passed != (each.threshold <= self.outcome.pass_mark):
                yield f"the series '{name}' has the threshold {each.threshold} and passed is {each.passed}"
            given = session.seen.get(("screening", self.block, self.test, name), [])
            if not practised and (len(given), sum(given)) != (each.presentations, each.right):
                yield (
                    f"the series '{name}' has {sum(given)} right answers of {len(given)}, "
                    f"not {each.right} of {each.presentations}"
                )
        yield from _unit(session, self.test, self.outcome.unit)
        if not self.outcome.passed:
            session.seen["failed", self.test] = True


class ScreenedOutRecord(ScreeningRecord):
    """The session ended after a failed test."""

    is_outcome = True
    ends_session = True

    test: Name
    screened_out: Literal[True]

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare with the outcome before."""
        if ("failed", self.test) not in session.seen:
            yield f"the test '{self.test}' was not failed"

    def pressed_otherwise(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the time with the press that ended it."""
        yield from super().pressed_otherwise(session, practised=practised)
        yield from self.timed_by_press(last=True)
