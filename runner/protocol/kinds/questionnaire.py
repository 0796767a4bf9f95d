"""`kind: questionnaire`: questions answered by choosing, by a number or in words."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from runner.blocks.fields import LONGEST, LONGEST_NUMBER, Number, Words, written
from runner.blocks.questionnaire import Choice, Questionnaire, Typed
from runner.protocol.kinds.block_spec import BlockSpec, Fault
from runner.protocol.parts import Label, Line, Strict
from runner.protocol.setting import Setting, Stimuli

Option = Annotated[str, Field(min_length=1, max_length=60)]
Limit = Annotated[float, Field(ge=-1e9, le=1e9)]
_DIGITS = 9


class _QuestionSpec(Strict):
    """What every question has; one that is not ``required`` may be left out."""

    name: Label
    question: Line
    required: bool = True


class ChoiceSpec(_QuestionSpec):
    """One of some options, each with a digit or, with ``keys: letters``, a letter."""

    kind: Literal["choice"]
    options: Annotated[list[Option], Field(min_length=2, max_length=12)]
    keys: Literal["digits", "letters"] = "digits"

    def made(self) -> Choice:
        """Return the question."""
        return Choice(self.name, self.question, tuple(self.options), self.required, self.keys == "letters")

    def faults(self) -> Iterator[Fault]:
        """Yield options that stand twice, or that no digit is left for."""
        for index, option in enumerate(self.options):
            if option in self.options[:index]:
                yield Fault(f"the option '{option}' stands twice", ("options", index), "remove one")
        if self.keys == "digits" and len(self.options) > _DIGITS:
            yield Fault(f"{len(self.options)} options are more than there are digits", ("options",), "keys: letters")


class NumberSpec(_QuestionSpec):
    """A number from ``lowest`` to ``highest``, both included, in a unit; without a fraction if ``whole``."""

    kind: Literal["number"]
    unit: Annotated[str, Field(max_length=20)] = ""
    lowest: Limit | None = None
    highest: Limit | None = None
    whole: bool = False

    def made(self) -> Typed:
        """Return the question."""
        return Typed(self.name, self.question, Number(self.unit, self.lowest, self.highest, self.whole), self.required)

    def faults(self) -> Iterator[Fault]:
        """Yield limits that nobody could type, and a range with nothing in it."""
        for key, limit in (("lowest", self.lowest), ("highest", self.highest)):
            if limit is not None and len(written(limit)) > LONGEST_NUMBER:
                yield Fault(f"{key} has more digits than can be typed", (key,), "round it")
        if self.lowest is None or self.highest is None:
            return
        if self.lowest > self.highest:
            yield Fault(f"lowest is {self.lowest:g} and highest {self.highest:g}", ("lowest",), "swap them")
        elif self.whole and math.ceil(self.lowest) > math.floor(self.highest):
            yield Fault("there is no whole number between lowest and highest", ("whole",), "leave it out")


class TextSpec(_QuestionSpec):
    """Some words, ``max_length`` characters at most."""

    kind: Literal["text"]
    max_length: Annotated[int, Field(ge=1, le=LONGEST)] = 200

    def made(self) -> Typed:
        """Return the question."""
        return Typed(self.name, self.question, Words(self.max_length), self.required)

    def faults(self) -> Iterator[Fault]:
        """Yield nothing."""
        yield from ()


AnyQuestionSpec = Annotated[ChoiceSpec | NumberSpec | TextSpec, Field(discriminator="kind")]


class QuestionnaireSpec(BlockSpec):
    """Questions, one a page."""

    kind: Literal["questionnaire"]
    questions: Annotated[list[AnyQuestionSpec], Field(min_length=1, max_length=200)]

    def make(self, setting: Setting) -> Questionnaire:
        """Return the questions in their order."""
        return Questionnaire(tuple(question.made() for question in self.questions), setting.style)

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield names that stand twice, and what is wrong with single questions."""
        for index, question in enumerate(self.questions):
            if question.name in (other.name for other in self.questions[:index]):
                yield Fault(f"two questions are named '{question.name}'", ("questions", index, "name"), "rename one")
            for fault in question.faults():
                yield Fault(fault.message, ("questions", index, *fault.path), fault.remedy)
