"""A line of words or a number, typed letter by letter on a page of its own."""

from __future__ import annotations

from collections.abc import Generator

from runner.blocks.fields import Number, Words
from runner.blocks.frames import button, frame, lines_needed
from runner.blocks.steps import Response, answer
from runner.blocks.style import Style
from runner.blocks.tasks import Write
from runner.ports import Ask
from runner.presenter.scene import Scene

_PROMPT, _TYPE, _WIDTH = 30, 26, 780
_LINE_SPACING = 1.25
_CARET = "▏"


def typed(
    prompt: str, style: Style, *, name: str = "", field: Words | Number | None = None, required: bool = True
) -> Generator[Ask, Response | None, tuple[str, float]]:
    """Ask for what ``field`` wants (any words if None); return what was typed and the time it took in s.

    Enter accepts it, or says on the page what is wrong with it; without ``required`` it may be left empty. The time is
    the sum of the times from each screen's onset to the press that ended it.
    """
    field = field or Words()
    words, told = "", ""
    took_s = 0.0
    presses = 0
    while True:
        fault = _fault(words, field, required=required)
        # Every press changes the page, if only how bright a word is: each screen has an onset of its own.
        bright = 0.5 + 0.1 * (presses % 2)
        response = answer((yield _page(prompt, words, style, name, field, fault, (told, bright), required=required)))
        took_s += response.time_s
        presses += 1
        told = ""
        if response.meaning == "accept":
            return words.strip(), took_s
        if response.meaning == "refuse":
            told = fault
        elif response.meaning == "erase":
            told = "" if words else "Nothing is typed yet"
            words = words[:-1]
        else:
            longer = words + response.meaning.removeprefix("text ")
            told = field.refusal(longer)
            words = words if told else longer


def _fault(words: str, field: Words | Number, *, required: bool) -> str:
    if not words.strip():
        return field.wanted if required else ""
    return field.fault(words.strip())


def _page(
    prompt: str,
    words: str,
    style: Style,
    name: str,
    field: Words | Number,
    fault: str,
    told: tuple[str, float],
    *,
    required: bool,
) -> Ask:
    """Return the prompt above a field with what was typed so far, and below it a button and what is to be done."""
    number = isinstance(field, Number)
    rows = 1 if isinstance(field, Number) else max(2, lines_needed(words + _CARET, _TYPE, _WIDTH))
    high = 28 + rows * _TYPE * _LINE_SPACING
    wide = 420 if number else _WIDTH + 60
    prompt_lines = lines_needed(prompt, _PROMPT, _WIDTH)
    above = -high / 2 - 44 - prompt_lines * _PROMPT * _LINE_SPACING / 2
    done = high / 2 + 64
    hint = field.wanted if fault else "Press Enter when you are done"
    if not words.strip() and not required:
        hint = f"{field.wanted}, or press Enter to leave it empty"
    accept = "refuse" if fault else "accept"
    return Ask(
        Scene(
            (
                style.text(prompt, y=above, height=_PROMPT, width=_WIDTH),
                *frame(style, 0, 0, wide, high, 0.3),
                style.text(f"{words}{_CARET}", height=_TYPE, width=_WIDTH),
                *button(style, "Done", 0, done, 180, 52, lit=not fault),
                style.text(told[0] or hint, y=done + 70, height=20, width=_WIDTH, share=told[1] if told[0] else 0.2),
            )
        ),
        {"backspace": "erase", "enter": accept, "pad_a": accept},
        task=Write(name, words, number, field.example),
        targets={accept: style.target(0, done, 180, 52)},
        typing=True,
    )
