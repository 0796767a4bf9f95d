"""Records of pages of words, questions and tests of vision: `instructions`, `break`, `questionnaire`, `screening`."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from typing import Any, ClassVar, Literal

from pydantic import Field

from analysis.records.fields import Count, Fields, Json, Name, Number, Text, Typed
from analysis.records.trial_record import ROUNDING_S, Session, TrialRecord

Side = Literal["up", "down", "left", "right"]
_SIDES = {f"{where}{side}": side for where in ("", "pad_") for side in ("up", "down", "left", "right")}


class PageRecord(TrialRecord):
    """A page of words was read."""

    def pressed_otherwise(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the time with the press that ended it."""
        yield from super().pressed_otherwise(session, practised=practised)
        yield from self.timed_by_press(last=True)


class QuestionRecord(TrialRecord):
    """A question and its answer; None if it was left out."""

    asked: ClassVar[tuple[str, ...]] = ("name", "question", "answered_by")

    name: Name
    question: Text
    answer: Text | Typed | None
    answered_by: Literal["choice", "number", "text"]
    unit: Text | None = None

    def contradictions(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the answer with how it was given."""
        if self.answer is not None and isinstance(self.answer, str) == (self.answered_by == "number"):
            yield f"the answer {self.answer!r} is no {self.answered_by}"

    def pressed_otherwise(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the time with the presses, among which is what was typed."""
        total = sum([seconds for _, seconds in self.events])
        if abs(self.response_time_s - total) > ROUNDING_S * (1 + len(self.events)):
            yield f"the response time is {self.response_time_s:g} s, and its presses took {total:g} s"
        if self.answer is None or self.answered_by == "choice":
            return
        typed = "".join([key.removeprefix("text ") for key, _ in self.events if key.startswith("text ")])
        if isinstance(self.answer, str):
            wanted, known = self.answer.strip(), _HALF not in typed
        else:
            wanted, known = _digits(self.answer), sum(map(str.isdigit, typed)) <= _EXACT
        characters = iter(typed)
        if known and not all(character in characters for character in wanted):
            yield f"the answer {self.answer!r} was not typed"


# What is read in place of half a character: two halves in a row are one character of the answer.
_HALF = "\N{REPLACEMENT CHARACTER}"
_EXACT = 15  # digits of a number that a float keeps all of


def _digits(number: float) -> str:
    text = format(Decimal(repr(float(number))), "f")
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "".join(character for character in text if character.isdigit()).lstrip("0")


class PresentationRecord(TrialRecord):
    """One presentation of a test of vision."""

    asked: ClassVar[tuple[str, ...]] = ("test", "series", "level", "unit", "presentation", "correct_answer")

    test: Name
    series: Name
    level: Number
    unit: Text
    presentation: Count
    correct_answer: Side
    answer: Side
    correct: bool

    def contradictions(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the answer with what is right."""
        if self.correct != (self.answer == self.correct_answer):
            yield f"the answer is '{self.answer}', right is '{self.correct_answer}', and 'correct' is {self.correct}"
        yield from _unit(session, self.test, self.unit)
        given = session.seen.setdefault(("screening", self.block, self.test, self.series), [])
        given.append(self.correct)

    def pressed_otherwise(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the answer with its key."""
        yield from super().pressed_otherwise(session, practised=practised)
        yield from self.timed_by_press(last=not practised)
        key = self.answer_key(last=not practised)
        if key is not None:
            yield from session.key_means("side", key, self.answer, _SIDES)


def _unit(session: Session, test: str, unit: str) -> Iterator[str]:
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
    """What came of a test."""

    passed: bool
    threshold: Number | None = None
    estimate: Number | None = None
    pass_mark: Number
    unit: Text
    controls_seen: bool


class OutcomeRecord(TrialRecord):
    """The record that states what came of a test."""

    asked: ClassVar[tuple[str, ...]] = ("test",)

    test: Name
    outcome: Outcome
    by_series: dict[Name, SeriesOutcome] = Field(min_length=1)
    screen: Json = Field(default_factory=dict)

    def contradictions(self, session: Session, *, practised: bool) -> Iterator[str]:
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


class ScreenedOutRecord(TrialRecord):
    """The session ended after a failed test."""

    test: Name
    screened_out: Literal[True]

    def contradictions(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare with the outcome before."""
        if ("failed", self.test) not in session.seen:
            yield f"the test '{self.test}' was not failed"

    def pressed_otherwise(self, session: Session, *, practised: bool) -> Iterator[str]:
        """Compare the time with the press that ended it."""
        yield from super().pressed_otherwise(session, practised=practised)
        yield from self.timed_by_press(last=True)


def screening_record(line: dict[str, Any]) -> type[TrialRecord]:
    """Return which of the three records a line of kind `screening` is."""
    if "outcome" in line or "by_series" in line:
        return OutcomeRecord
    return ScreenedOutRecord if "screened_out" in line else PresentationRecord
