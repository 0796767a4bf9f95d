"""Words to coverage: broken into lines and drawn with Pillow, one byte a pixel."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

LINE_SPACING = 1.25
_PADDING_PX = 2  # room for what overhangs a letter's advance


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
    font = _font(height_px)
    lines = break_lines(words, width_px, font.getlength)
    if not any(lines):
        return None
    ascent, descent = font.getmetrics()
    step = max(round(height_px * LINE_SPACING), 1)
    width = int(max(font.getlength(line) for line in lines)) + 1 + 2 * _PADDING_PX
    height = step * (len(lines) - 1) + ascent + descent + 2 * _PADDING_PX
    image = Image.new("L", (width, height), 0)
    pen = ImageDraw.Draw(image)
    for number, line in enumerate(lines):
        left = (width - font.getlength(line)) // 2
        pen.text((left, _PADDING_PX + number * step), line, fill=255, font=font)
    return np.asarray(image, dtype=np.uint8)


@lru_cache(maxsize=16)
def _font(height_px: int) -> ImageFont.FreeTypeFont:
    """DejaVu Sans as matplotlib carries it: it has Greek, Cyrillic, accents and arrows; Pillow's own has not even é."""
    spec = find_spec("matplotlib")  # found, not imported
    folders = spec.submodule_search_locations if spec else None
    if not folders:
        raise FileNotFoundError("matplotlib, whose DejaVu Sans draws the words, is not installed")
    return ImageFont.truetype(Path(folders[0]) / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf", height_px)
