"""A line of words or a number, typed letter by letter on a page of its own."""

from __future__ import annotations

import re
from collections.abc import Generator

from runner.blocks.steps import Response, answer
from runner.blocks.style import Style
from runner.ports import Ask
from runner.presenter.scene import Scene
from runner.tasks import Write

LONGEST = 500
_KEYS = {"backspace": "erase", "enter": "accept"}
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)")
_NUMBER_SO_FAR = re.compile(r"[+-]?\d*([.,]\d*)?")


def typed(
    prompt: str, style: Style, *, name: str = "", number: bool = False, required: bool = True
) -> Generator[Ask, Response | None, tuple[str, float]]:
    """Ask for words, or with ``number`` for a number, until Enter is pressed; return them and the time it took in s.

    What is not part of a number cannot be typed into one; with ``required``, Enter waits for something to accept.
    """
    words = ""
    took_s = 0.0
    while True:
        finished = _complete(words, number=number, required=required)
        response = answer((yield _page(prompt, words, style, name, number=number, finished=finished)))
        took_s += response.time_s
        if response.meaning == "accept" and finished:
            return words.strip(), took_s
        if response.meaning == "erase":
            words = words[:-1]
        elif response.meaning.startswith("text "):
            longer = words + response.meaning.removeprefix("text ")
            if len(longer) <= LONGEST and (not number or _NUMBER_SO_FAR.fullmatch(longer)):
                words = longer


def _complete(words: str, *, number: bool, required: bool) -> bool:
    if not words.strip():
        return not required
    return not number or _NUMBER.fullmatch(words) is not None


def _page(prompt: str, words: str, style: Style, name: str, *, number: bool, finished: bool) -> Ask:
    hint = "Enter when done" if finished else "Type a number" if number else "Type your answer"
    lines = max(1, 1 + len(words) // 60)
    return Ask(
        Scene(
            (
                style.text(prompt, y=-160, height=30),
                style.text(f"{words}_", height=26, width=800),
                style.box(0, 30 + 18 * lines, 820, 2, 0.2),
                style.text(hint, y=110 + 18 * lines, height=20, share=0.2),
            )
        ),
        _KEYS if finished else {"backspace": "erase"},
        task=Write(name, words, number),
        typing=True,
    )
