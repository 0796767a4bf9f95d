"""Frames and buttons: where something can be typed or clicked."""

from __future__ import annotations

from runner.blocks.style import Style
from runner.presenter.scene import Box, Item

_LETTER_WIDTHS = (("WM@%mw", 0.95), ("iljtfr.,:;'|!I ()[]", 0.4))


def frame(style: Style, x: float, y: float, width: float, height: float, share: float = 0.25) -> tuple[Box, Box]:
    """Return a thin frame about a place, black inside."""
    return style.box(x, y, width, height, share), style.box(x, y, width - 4, height - 4, 0.0)


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
