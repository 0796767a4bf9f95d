"""How words look: their lines, their size and the ink that covers each pixel, drawn with Pillow."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from runner.presenter.scene import Text

if TYPE_CHECKING:
    from PIL import ImageFont

LINE_SPACING = 1.25
CAPITAL = 0.729  # height of a capital letter of DejaVu Sans, in the size of the type
_PADDING_PX = 2  # room for what overhangs a letter's advance


class Area(NamedTuple):
    """A rectangle in pixels from the middle of an eye's view, x to the right and y down."""

    left: int
    top: int
    right: int
    bottom: int

    def within(self, view_px: tuple[int, int]) -> bool:
        """Return whether it lies in a view of ``view_px`` (width, height)."""
        (width, height), middle = view_px, (view_px[0] // 2, view_px[1] // 2)
        return (
            self.left + middle[0] >= 0
            and self.top + middle[1] >= 0
            and self.right + middle[0] <= width
            and self.bottom + middle[1] <= height
        )


def text_area(text: Text) -> Area | None:
    """Return where ``text`` is drawn, as `coverage` draws it; None if there is nothing to see."""
    lines = _set(text.words, text.height_px, text.width_px)
    if lines is None:
        return None
    width, height = lines.size_px
    x, y = text.offset_px
    left, top = x - width // 2, y - height // 2
    edge = _PADDING_PX
    return Area(left + edge, top + edge, left + width - edge, top + height - edge)


def break_lines(words: str, width_px: float, measure: Callable[[str], float]) -> list[str]:
    """Return ``words`` in lines no wider than ``width_px`` by ``measure``; its own line breaks are kept.

    A word wider than a line is broken between letters.
    """
    lines: list[str] = []
    for paragraph in words.replace("\t", " ").splitlines():
        line = ""
        for word in filter(None, paragraph.split(" ")):
            joined = f"{line} {word}" if line else word
            if measure(joined) <= width_px:
                line = joined
                continue
            if line:
                lines.append(line)
            line = ""
            for letter in word:
                if line and measure(line + letter) > width_px:
                    lines.append(line)
                    line = ""
                line += letter
        lines.append(line)
    return lines


def coverage(words: str, height_px: int, width_px: int) -> NDArray[np.uint8] | None:
    """Return the coverage (height, width) of centred ``words``, 0 to 255; None if there is nothing to see.

    ``height_px`` is the size of the type, ``width_px`` the longest line.
    """
    from PIL import Image, ImageDraw

    lines = _set(words, height_px, width_px)
    if lines is None:
        return None
    width, height = lines.size_px
    image = Image.new("L", (width, height), 0)
    pen = ImageDraw.Draw(image)
    for number, line in enumerate(lines.lines):
        left = (width - lines.font.getlength(line)) // 2
        pen.text((left, _PADDING_PX + number * lines.step_px), line, fill=255, font=lines.font)
    return np.asarray(image, dtype=np.uint8)


class _Lines(NamedTuple):
    font: ImageFont.FreeTypeFont
    lines: list[str]
    step_px: int
    size_px: tuple[int, int]


def _set(words: str, height_px: int, width_px: int) -> _Lines | None:
    """Return ``words`` in lines, and the size (width, height) of all of them."""
    font = type_face(height_px)
    lines = break_lines(words, width_px, font.getlength)
    if not any(lines):
        return None
    ascent, descent = font.getmetrics()
    step = max(round(height_px * LINE_SPACING), 1)
    width = int(max(font.getlength(line) for line in lines)) + 1 + 2 * _PADDING_PX
    height = step * (len(lines) - 1) + ascent + descent + 2 * _PADDING_PX
    return _Lines(font, lines, step, (width, height))


@lru_cache(maxsize=16)
def type_face(height_px: int) -> ImageFont.FreeTypeFont:
    """DejaVu Sans as matplotlib carries it: it has Greek, Cyrillic, accents and arrows; Pillow's own has not even é."""
    from PIL import ImageFont

    spec = find_spec("matplotlib")  # located, not imported
    folders = spec.submodule_search_locations if spec else None
    if not folders:
        raise FileNotFoundError("matplotlib, whose DejaVu Sans draws the words, is not installed")
    return ImageFont.truetype(Path(folders[0]) / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf", height_px)
