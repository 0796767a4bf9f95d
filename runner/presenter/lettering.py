"""How words look: their lines, their size and the ink that covers each pixel, drawn with Pillow."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from documents.fonts import dejavu_sans, font_of, font_runs, type_face
from runner.scene import Text

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont

LINE_SPACING = 1.25
_CAPITAL = 0.729  # height of a capital letter of DejaVu Sans, in the size of the type
_CAPITAL_PX = 1000
_PADDING_PX = 2  # room for what overhangs a letter's advance
Ink = int | tuple[int, int, int]


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
    lines = _set(text.words, text.height_px, text.width_px, text.font)
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


def capital_share(own: Path | None) -> float:
    """Return the height of a capital letter in the size of the type, with the font ``own`` before DejaVu Sans."""
    font = font_of("H", own)
    if font is None or font == dejavu_sans():
        return _CAPITAL
    _, top, _, bottom = type_face(font, _CAPITAL_PX).getbbox("H", anchor="ls")
    return (bottom - top) / _CAPITAL_PX


def coverage(words: str, height_px: int, width_px: int, own: Path | None = None) -> NDArray[np.uint8] | None:
    """Return the coverage (height, width) of centred ``words``, 0 to 255; None if there is nothing to see.

    ``height_px`` is the size of the type, ``width_px`` the longest line, ``own`` a font that is asked for each letter
    before DejaVu Sans and those that are installed.
    """
    from PIL import Image, ImageDraw

    lines = _set(words, height_px, width_px, own)
    if lines is None:
        return None
    width, height = lines.size_px
    image = Image.new("L", (width, height), 0)
    pen = ImageDraw.Draw(image)
    for number, line in enumerate(lines.lines):
        left = (width - _length(line)) // 2
        _write(pen, line, left, _PADDING_PX + number * lines.step_px + lines.ascent_px, 255)
    return np.asarray(image, dtype=np.uint8)


def write(pen: ImageDraw, place_px: tuple[float, float], words: str, height_px: int, ink: Ink) -> None:
    """Write a line of ``words`` in type of ``height_px`` from its top left at ``place_px``."""
    left, top = place_px
    _write(pen, _runs(words, height_px, None), left, top + type_face(dejavu_sans(), height_px).getmetrics()[0], ink)


_Runs = list[tuple["FreeTypeFont", str]]


class _Lines(NamedTuple):
    lines: list[_Runs]
    ascent_px: int
    step_px: int
    size_px: tuple[int, int]


def _set(words: str, height_px: int, width_px: int, own: Path | None) -> _Lines | None:
    """Return ``words`` in lines, and the size (width, height) of all of them."""
    broken = break_lines(words, width_px, lambda line: _length(_runs(line, height_px, own)))
    if not any(broken):
        return None
    lines = [_runs(line, height_px, own) for line in broken]
    ascent, descent = type_face(own or dejavu_sans(), height_px).getmetrics()
    step = max(round(height_px * LINE_SPACING), 1)
    width = int(max(map(_length, lines))) + 1 + 2 * _PADDING_PX
    height = step * (len(lines) - 1) + ascent + descent + 2 * _PADDING_PX
    return _Lines(lines, ascent, step, (width, height))


def _runs(line: str, height_px: int, own: Path | None) -> _Runs:
    return [(type_face(font, height_px), letters) for font, letters in font_runs(line, own)]


def _length(line: _Runs) -> float:
    return sum(face.getlength(letters) for face, letters in line)


def _write(pen: ImageDraw, line: _Runs, left: float, baseline: float, ink: Ink) -> None:
    for face, letters in line:
        pen.text((left, baseline), letters, fill=ink, font=face, anchor="ls")
        left += face.getlength(letters)
