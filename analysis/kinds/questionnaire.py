"""Records of `questionnaire`: a question and its answer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import ClassVar, Literal

from analysis.kinds.fields import Name, Text, Typed, TypedWhole
from analysis.kinds.trial import ROUNDING_S, TIME, ColumnWords, SoFar, Trial


class QuestionRecord(Trial):
    """A question and its answer; None if it was left out."""

    description = "a question to the observer"
    not_reported: ClassVar[Mapping[str, str]] = {"response_time_s": TIME}

    answers_task = False

    columns: ClassVar[Mapping[str, ColumnWords]] = {
        "question": ColumnWords("The text of the question."),
    }
    no_stimulus: ClassVar[tuple[str, ...]] = ("name", "question")
    asked: ClassVar[tuple[str, ...]] = ("name", "question", "answered_by")

    name: Name
    question: Text
    answer: Text | TypedWhole | Typed | None
    unit: Text | None = None
    answered_by: Literal["choice", "number", "text"]

    @property
    def said(self) -> str:
        """What was answered."""
        return str(self.answer)

    def contradictions(self, session: SoFar, *, practised: bool) -> Iterator[str]:
        """Compare the answer with how it was given."""
        if self.answer is not None and isinstance(self.answer, str) == (self.answered_by == "number"):
            yield f"the answer {self.answer!r} is no {self.answered_by}"

    def pressed_otherwise(self, session: SoFar, *, practised: bool) -> Iterator[str]:
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
