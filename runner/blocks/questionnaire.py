"""`kind: questionnaire`: one question a page, answered by choosing, by a number or in words."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field

from documents.yaml import Strict
from runner.blocks.block import Block, BlockSpec, Draft, Fault, Response, Steps, answer
from runner.blocks.field_types import Label, Line
from runner.blocks.setting import Setting, Stimuli
from runner.blocks.style import FULL_HD_HALF, Style
from runner.blocks.tasks import Choose
from runner.blocks.text_entry import LONGEST, LONGEST_NUMBER, Number, Words, button, lines_needed, typed, written
from runner.ports import Ask
from runner.presenter.scene import Item, Scene

SECONDS_PER_QUESTION = 8.0
NO_ANSWER = "none"
_PROMPT, _PITCH, _NARROW_PITCH, _ROOMY = 30, 64, 54, 9
_WIDE, _HIGH = 760, 0.86  # of a row: its width, and the share of the pitch that its frame takes
_NUMBERS, _LETTERS = "123456789", "abcdefghijkl"
_MOVES = {
    "up": "upwards",
    "wheel_up": "upwards",
    "pad_up": "upwards",
    "down": "downwards",
    "wheel_down": "downwards",
    "pad_down": "downwards",
}
_TAKE = ("enter", "space", "pad_a")


@dataclass(frozen=True, slots=True)
class Choice:
    """A question with ``options``, each with a digit, or a letter if ``letters``; unless ``required``, also none."""

    name: str
    question: str
    options: tuple[str, ...]
    required: bool = True
    letters: bool = False

    kind = "choice"

    @property
    def keys(self) -> dict[str, str]:
        """The keys of the options by their numbers from 1, and of none."""
        named = zip(_LETTERS if self.letters else _NUMBERS, self.options, strict=False)
        keys = {key: str(number) for number, (key, _) in enumerate(named, start=1)}
        return keys if self.required else {**keys, "0": NO_ANSWER}

    def ask(self, style: Style) -> Generator[Ask, Response | None, tuple[str | None, float]]:
        """Ask it; return the option's words, None if it was left out, and the time it took in s."""
        meanings = list(self.keys.values())
        marked: str | None = None
        took_s = 0.0
        while True:
            response = answer((yield self._page(style, marked)))
            took_s += response.time_s
            if response.meaning in ("upwards", "downwards"):
                marked = _next(meanings, marked, response.meaning)
            else:
                return None if response.meaning == NO_ANSWER else self.options[int(response.meaning) - 1], took_s

    def _page(self, style: Style, marked: str | None) -> Ask:
        """Return the question above a row for each option; arrows mark a row, round and round, and Enter takes it."""
        keys = self.keys
        pitch = _PITCH if len(keys) <= _ROOMY else _NARROW_PITCH
        wide = min(_WIDE, style.width - 40)
        prompt = lines_needed(self.question, _PROMPT, wide) * _PROMPT * 1.25
        height = prompt + 50 + pitch * len(keys) + 60
        top = -height / 2 + prompt + 50
        heights = {meaning: top + pitch * (row + 0.5) for row, meaning in enumerate(keys.values())}
        items: list[Item] = [style.text(self.question, y=-height / 2 + prompt / 2, height=_PROMPT, width=wide)]
        for key, meaning in keys.items():
            words = style.say("no_answer") if meaning == NO_ANSWER else self.options[int(meaning) - 1]
            lit = meaning == marked
            items += button(style, words, 0, heights[meaning], wide, _HIGH * pitch, lit=lit)
            called = style.interface.key(key)
            size = 22 if len(called) == 1 else 16
            items.append(style.text(called, -wide / 2 + 30, heights[meaning], height=size, share=0.25))
        hint = style.say("take_option" if marked else "choose_option")
        items.append(style.text(hint, y=height / 2 - 20, height=20, share=0.2))
        return Ask(
            Scene(tuple(items)),
            {**keys, **_MOVES, **(dict.fromkeys(_TAKE, marked) if marked else {})},
            task=Choose(self.name, tuple(keys.values())),
            targets={meaning: style.target(0, y, wide, pitch) for meaning, y in heights.items()},
        )


@dataclass(frozen=True, slots=True)
class Typed:
    """A question answered by what its ``field`` accepts; unless ``required``, it may be left empty."""

    name: str
    question: str
    field: Words | Number
    required: bool = True

    @property
    def kind(self) -> str:
        """What is typed."""
        return "number" if isinstance(self.field, Number) else "text"

    def ask(self, style: Style) -> Generator[Ask, Response | None, tuple[str | float | None, float]]:
        """Ask it; return the answer, None if it was left out, and the time it took in s."""
        written, took_s = yield from typed(
            self.question, style, name=self.name, field=self.field, required=self.required
        )
        return self.field.value(written) if written else None, took_s


@dataclass(frozen=True, slots=True)
class Questionnaire(Block):
    """Questions in order, a record for each.

    The response time is the sum of the times from each screen's onset to the press that ended it: from the question's
    onset to the press that answered it, without what drawing took.
    """

    questions: tuple[Choice | Typed, ...]
    style: Style = FULL_HD_HALF

    @property
    def trials(self) -> int:
        """A record for each question."""
        return len(self.questions)

    @property
    def expected_s(self) -> float:
        """Reading and answering."""
        return SECONDS_PER_QUESTION * len(self.questions)

    @property
    def keys(self) -> dict[str, str]:
        """The keys that choose, and those that end what is typed."""
        choices = {"1": "first option"} if any(isinstance(q, Choice) for q in self.questions) else {}
        typing = {"enter": "accept", "backspace": "erase"} if any(isinstance(q, Typed) for q in self.questions) else {}
        return {**choices, **typing}

    def steps(self) -> Steps:
        """Ask every question and record its answer."""
        for question in self.questions:
            given, took_s = yield from question.ask(self.style)
            data: dict[str, Any] = {"name": question.name, "question": question.question, "answer": given}
            if isinstance(question, Typed) and isinstance(question.field, Number) and question.field.unit:
                data["unit"] = question.field.unit
            yield Draft("questionnaire", {**data, "answered_by": question.kind}, response_time_s=took_s)


def _next(meanings: list[str], marked: str | None, way: str) -> str:
    if marked is None:
        return meanings[0] if way == "downwards" else meanings[-1]
    step = 1 if way == "downwards" else -1
    return meanings[(meanings.index(marked) + step) % len(meanings)]


Option = Annotated[str, Field(min_length=1, max_length=60)]
Limit = Annotated[float, Field(ge=-1e9, le=1e9)]
_DIGITS = 9


class _QuestionSpec(Strict):
    """What every question has; one that is not ``required`` may be left out."""

    name: Label
    """The name of the question in the records: small letters, digits and _."""
    question: Line
    """The question as it is asked."""
    required: bool = True
    """Whether it must be answered."""


class ChoiceSpec(_QuestionSpec):
    """One of some options, each with a digit or, with ``keys: letters``, a letter."""

    kind: Literal["choice"]
    """Which kind of entry this is; it decides which other keys there are."""
    options: Annotated[list[Option], Field(min_length=2, max_length=12)]
    """The answers to choose from, in their order."""
    keys: Literal["digits", "letters"] = "digits"
    """Whether options are chosen by digits or by letters."""

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
    """Which kind of entry this is; it decides which other keys there are."""
    unit: Annotated[str, Field(max_length=20)] = ""
    """The unit that stands behind the number."""
    lowest: Limit | None = None
    """The smallest number that may be answered."""
    highest: Limit | None = None
    """The largest number that may be answered."""
    whole: bool = False
    """Whether only whole numbers are allowed."""

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
    """Which kind of entry this is; it decides which other keys there are."""
    max_length: Annotated[int, Field(ge=1, le=LONGEST)] = 200
    """How many characters may be typed at most."""

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
    """Which kind of entry this is; it decides which other keys there are."""
    questions: Annotated[list[AnyQuestionSpec], Field(min_length=1, max_length=200)]
    """The questions, one a page."""

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
