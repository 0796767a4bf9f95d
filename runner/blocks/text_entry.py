"""A page on which words or a number are typed: what may be typed, and the frames and buttons of the page."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Generator
from decimal import Decimal
from typing import Annotated, TypeAlias

from pydantic import Field

from documents.yaml import FileModel
from runner.ports import Ask, Response, Write, answer
from runner.scene import Box, Item, Scene
from runner.views.interface import ENGLISH
from runner.views.style import Style

Say: TypeAlias = Callable[..., str]  # the interface's words by their name
LONGEST = 500
LONGEST_NUMBER = 24
Limit = Annotated[float, Field(ge=-1e9, le=1e9)]
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)")


class TextAnswer(FileModel):
    """Some words, ``max_length`` characters at most."""

    max_length: Annotated[int, Field(ge=1, le=LONGEST)] = LONGEST
    """How many characters may be typed at most."""

    def refusal(self, longer: str, say: Say = ENGLISH.say) -> str:
        """Say why ``longer`` cannot be typed; nothing if it can."""
        return say("no_room", count=self.max_length) if len(longer) > self.max_length else ""

    def fault(self, typed: str, say: Say = ENGLISH.say) -> str:
        """Say what is wrong with an answer that is not empty; nothing if it will do."""
        return ""

    def value(self, typed: str) -> str:
        """Return the answer."""
        return typed.strip()

    def wanted(self, say: Say = ENGLISH.say) -> str:
        """Return what to type."""
        return say("type_words")

    @property
    def example(self) -> str:
        """An answer that would do."""
        return "1"


class Number(FileModel):
    """A number from ``lowest`` to ``highest``, both included, in a unit; without a fraction if ``whole``."""

    unit: Annotated[str, Field(max_length=20)] = ""
    """The unit that stands behind the number."""
    lowest: Limit | None = None
    """The smallest number that may be answered."""
    highest: Limit | None = None
    """The largest number that may be answered."""
    whole: bool = False
    """Whether only whole numbers are allowed."""

    def refusal(self, longer: str, say: Say = ENGLISH.say) -> str:
        """Say why ``longer`` cannot be typed; nothing if it can."""
        sign = "" if self.lowest is not None and self.lowest >= 0 else "[+-]?"
        fraction = "" if self.whole else r"([.,]\d*)?"
        if re.fullmatch(rf"{sign}\d*{fraction}", longer, re.ASCII) is None:
            return say("digits_only" if self.whole and not sign else "number_only")
        return say("number_too_long") if len(longer) > LONGEST_NUMBER else ""

    def fault(self, typed: str, say: Say = ENGLISH.say) -> str:
        """Say what is wrong with an answer that is not empty; nothing if it will do."""
        wanted = self.wanted(say)
        if _NUMBER.fullmatch(typed) is None:
            return wanted
        number = self.value(typed)
        low = self.lowest is not None and number < self.lowest
        high = self.highest is not None and number > self.highest
        return say("too_low" if low else "too_high", typed=typed, wanted=_lower(wanted)) if low or high else ""

    def value(self, typed: str) -> float | int:
        """Return the answer; a decimal comma counts as a point."""
        plain = typed.replace(",", ".")
        return int(plain) if plain.lstrip("+-").isdigit() else float(plain)

    def wanted(self, say: Say = ENGLISH.say) -> str:
        """Return what to type."""
        kind = "type_whole" if self.whole else "type_number"
        unit = f" {self.unit}" if self.unit else ""
        if self.lowest is not None and self.highest is not None:
            return say(f"{kind}_between", lowest=written(self.lowest), highest=written(self.highest), unit=unit)
        if self.lowest is not None:
            return say(f"{kind}_above", lowest=written(self.lowest), unit=unit)
        if self.highest is not None:
            return say(f"{kind}_below", highest=written(self.highest), unit=unit)
        return say(kind, unit=f" ({self.unit})" if self.unit else "")

    @property
    def example(self) -> str:
        """An answer that would do."""
        lowest = -math.inf if self.lowest is None else self.lowest
        highest = math.inf if self.highest is None else self.highest
        if lowest <= 1 <= highest:
            return "1"
        if self.whole:
            return str(math.ceil(lowest) if lowest > 1 else math.floor(highest))
        return written(lowest if lowest > 1 else highest)


def written(number: float) -> str:
    """Return a number as people write it: without an exponent, and with no more digits than it has."""
    digits = format(Decimal(repr(float(number))) + 0, "f")
    return digits.rstrip("0").rstrip(".") if "." in digits else digits


def _lower(words: str) -> str:
    return words[:1].lower() + words[1:]


_LETTER_WIDTHS = (("WM@%mw", 0.95), ("iljtfr.,:;'|!I ()[]", 0.4))


def frame(style: Style, x: float, y: float, width: float, height: float, share: float = 0.25) -> tuple[Box, Box]:
    """Return a thin frame about a place, inside as the background; its four sides are equally thick."""
    outside = style.box(x, y, width, height, share)
    both_sides = 2 * max(1, style.px(2))
    size = max(1, outside.size_px[0] - both_sides), max(1, outside.size_px[1] - both_sides)
    return outside, Box(outside.offset_px, size, 0.0)


def button(
    style: Style, words: str, x: float, y: float, width: float, height: float, *, lit: bool = False
) -> tuple[Item, ...]:
    """Return a frame with words in it, brighter if ``lit``."""
    inside = style.text(words, x, y, height=22, width=width - 24, share=0.6 if lit else 0.4)
    return (*frame(style, x, y, width, height, 0.6 if lit else 0.2), inside)


def lines_needed(words: str, height: float, width: float) -> int:
    """Return about how many lines of ``width`` the words take in type of ``height``; rather one more than one less."""
    room = width / height
    return sum(1 + int(1.08 * sum(map(_letter_width, line)) / room) for line in words.split("\n"))


def _letter_width(letter: str) -> float:
    """Return a letter's width in units of the type's height, of the widest of its kind."""
    for letters, width in _LETTER_WIDTHS:
        if letter in letters:
            return width
    return 1.0 if ord(letter) > 0x2E80 else 0.75 if letter.isupper() else 0.63


_PROMPT, _TYPE, _WIDTH = 30, 26, 780
_LINE_SPACING = 1.25
_CARET = "▏"


def typed(
    prompt: str, style: Style, *, name: str = "", field: TextAnswer | Number | None = None, required: bool = True
) -> Generator[Ask, Response | None, tuple[str, float]]:
    """Ask for what ``field`` accepts (any words if None); return what was typed and the time it took in s.

    Enter accepts it, or shows on the page what is wrong with it; without ``required`` it may be left empty. The time is
    the sum of the times from each screen's onset to the press that ended it.
    """
    field = field or TextAnswer()
    words, message = "", ""
    took_s = 0.0
    presses = 0
    while True:
        fault = _fault(words, field, style.say, required=required)
        # Every press changes the page, if only how bright a word is: each screen has an onset of its own.
        bright = 0.5 + 0.1 * (presses % 2)
        response = answer((yield _page(prompt, words, style, name, field, fault, (message, bright), required=required)))
        took_s += response.time_s
        presses += 1
        message = ""
        if response.meaning == "accept":
            return words.strip(), took_s
        if response.meaning == "refuse":
            message = fault
        elif response.meaning == "erase":
            message = "" if words else style.say("nothing_typed")
            words = words[:-1]
        else:
            longer = words + response.meaning.removeprefix("text ")
            message = field.refusal(longer, style.say)
            words = words if message else longer


def _fault(words: str, field: TextAnswer | Number, say: Say, *, required: bool) -> str:
    if not words.strip():
        return field.wanted(say) if required else ""
    return field.fault(words.strip(), say)


def _page(
    prompt: str,
    words: str,
    style: Style,
    name: str,
    field: TextAnswer | Number,
    fault: str,
    message: tuple[str, float],
    *,
    required: bool,
) -> Ask:
    """Return the prompt above a field with what was typed so far, and below it a button and what is to be done."""
    number = isinstance(field, Number)
    width = min(_WIDTH, style.width - 100)
    rows = 1 if isinstance(field, Number) else max(2, lines_needed(words + _CARET, _TYPE, width))
    high = 28 + rows * _TYPE * _LINE_SPACING
    wide = min(420, width) if number else width + 60
    prompt_lines = lines_needed(prompt, _PROMPT, width)
    above = -high / 2 - 44 - prompt_lines * _PROMPT * _LINE_SPACING / 2
    done = high / 2 + 64
    wanted = field.wanted(style.say)
    hint = wanted if fault else style.say("press_when_done")
    if not words.strip() and not required:
        hint = style.say("or_leave_empty", wanted=wanted)
    accept = "refuse" if fault else "accept"
    return Ask(
        Scene(
            (
                style.text(prompt, y=above, height=_PROMPT, width=width),
                *frame(style, 0, 0, wide, high, 0.3),
                style.text(f"{words}{_CARET}", height=_TYPE, width=width),
                *button(style, style.say("done"), 0, done, 180, 52, lit=not fault),
                style.text(
                    message[0] or hint, y=done + 70, height=20, width=width, share=message[1] if message[0] else 0.2
                ),
            )
        ),
        {"backspace": "erase", "enter": accept, "pad_a": accept},
        task=Write(name, words, number, field.example),
        targets={accept: style.target(0, done, 180, 52)},
        typing=True,
    )
