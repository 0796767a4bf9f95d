"""`kind: questionnaire`: one question a page, answered by choosing, by a number or in words."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from functools import partial
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field

from documents.yaml import FileModel
from runner.blocks.block import Block, BlockKind, Draft, Fault, Steps
from runner.blocks.context import BlockContext, Stimuli
from runner.blocks.text_entry import LONGEST, LONGEST_NUMBER, Number, TextAnswer, button, lines_needed, typed, written
from runner.ports import Ask, Choose, Response, answer
from runner.scene import Item, Scene
from runner.views.field_types import Label, Line
from runner.views.style import Style

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


Typing: TypeAlias = Generator[Ask, Response | None, tuple[str | float | None, float]]
Option = Annotated[str, Field(min_length=1, max_length=60)]
_DIGITS = 9


class _Question(FileModel):
    """What every question has; one that is not ``required`` may be left out."""

    name: Label
    """The name of the question in the records: small letters, digits and _."""
    question: Line
    """The question as it is asked."""
    required: bool = True
    """Whether it must be answered."""
    kind: str
    """Which kind of entry this is; it decides which other keys there are."""

    def faults(self) -> Iterator[Fault]:
        """Yield what is wrong with it beyond its keys."""
        yield from ()


class ChoiceQuestion(_Question):
    """One of some options, each with a digit or, with ``keys: letters``, a letter."""

    kind: Literal["choice"]
    options: Annotated[list[Option], Field(min_length=2, max_length=12)]
    """The answers to choose from, in their order."""
    keys: Literal["digits", "letters"] = "digits"
    """Whether options are chosen by digits or by letters."""

    def faults(self) -> Iterator[Fault]:
        """Yield options that stand twice, or that no digit is left for."""
        for index, option in enumerate(self.options):
            if option in self.options[:index]:
                yield Fault(f"the option '{option}' stands twice", ("options", index), "remove one")
        if self.keys == "digits" and len(self.options) > _DIGITS:
            yield Fault(f"{len(self.options)} options are more than there are digits", ("options",), "keys: letters")

    @property
    def options_by_key(self) -> dict[str, str]:
        """The keys of the options by their numbers from 1, and of none."""
        named = zip(_NUMBERS if self.keys == "digits" else _LETTERS, self.options, strict=False)
        keys = {key: str(number) for number, (key, _) in enumerate(named, start=1)}
        return keys if self.required else {**keys, "0": NO_ANSWER}

    def ask(self, style: Style) -> Generator[Ask, Response | None, tuple[str | None, float]]:
        """Ask it; return the option's words, None if it was left out, and the time it took in s."""
        meanings = list(self.options_by_key.values())
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
        keys = self.options_by_key
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


class NumberQuestion(Number, _Question):
    """A number from ``lowest`` to ``highest``, both included, in a unit; without a fraction if ``whole``."""

    kind: Literal["number"]

    def ask(self, style: Style) -> Typing:
        """Ask it; return the answer, None if it was left out, and the time it took in s."""
        return _ask_typed(self, style)

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


class TextQuestion(TextAnswer, _Question):
    """Some words, ``max_length`` characters at most."""

    kind: Literal["text"]
    max_length: Annotated[int, Field(ge=1, le=LONGEST)] = 200

    def ask(self, style: Style) -> Typing:
        """Ask it; return the answer, None if it was left out, and the time it took in s."""
        return _ask_typed(self, style)


def _ask_typed(question: NumberQuestion | TextQuestion, style: Style) -> Typing:
    name, required = question.name, question.required
    written, took_s = yield from typed(question.question, style, name=name, field=question, required=required)
    return question.value(written) if written else None, took_s


AnyQuestion = Annotated[ChoiceQuestion | NumberQuestion | TextQuestion, Field(discriminator="kind")]


class Questionnaire(BlockKind):
    """Questions, one a page."""

    by_scores = has_trials = False

    kind: Literal["questionnaire"]
    questions: Annotated[list[AnyQuestion], Field(min_length=1, max_length=200)]
    """The questions, one a page."""

    def meet(self, setting: BlockContext) -> Block:
        """Return the questions in their order, a record for each.

        The response time is the sum of the times from each screen's onset to the press that ended it: from the
        question's onset to the press that answered it, without what drawing took.
        """
        kinds = {question.kind for question in self.questions}
        choosing = {"1": "first option"} if "choice" in kinds else {}
        typing = {"enter": "accept", "backspace": "erase"} if kinds - {"choice"} else {}
        return Block(
            entry=self,
            steps=partial(self._steps, setting.style),
            trials=len(self.questions),
            expected_s=SECONDS_PER_QUESTION * len(self.questions),
            keys={**choosing, **typing},
        )

    def faults(self, stimuli: Stimuli) -> Iterator[Fault]:
        """Yield names that stand twice, and what is wrong with single questions."""
        for index, question in enumerate(self.questions):
            if question.name in (other.name for other in self.questions[:index]):
                yield Fault(f"two questions are named '{question.name}'", ("questions", index, "name"), "rename one")
            for fault in question.faults():
                yield Fault(fault.message, ("questions", index, *fault.path), fault.remedy)

    def _steps(self, style: Style) -> Steps:
        """Ask every question and record its answer."""
        for question in self.questions:
            given, took_s = yield from question.ask(style)
            data: dict[str, Any] = {"name": question.name, "question": question.question, "answer": given}
            if isinstance(question, Number) and question.unit:
                data["unit"] = question.unit
            yield Draft("questionnaire", {**data, "answered_by": question.kind}, response_time_s=took_s)


def _next(meanings: list[str], marked: str | None, way: str) -> str:
    if marked is None:
        return meanings[0] if way == "downwards" else meanings[-1]
    step = 1 if way == "downwards" else -1
    return meanings[(meanings.index(marked) + step) % len(meanings)]
