"""Layouts of two eyes in one picture file: side by side or one above the other, whole or half, parallel or crossed.

A half picture holds each eye at half its width (or height), and its pixels are as wide again as they are high.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from stimuli.errors import StimulusError
from stimuli.pictures.resampling import resample_picture
from stimuli.pictures.stereo_image import StereoImage

# In a crossed picture the right eye's is on the left, or on top.
Packing = Literal[
    "none",
    "side-by-side",
    "side-by-side-half",
    "side-by-side-crossed",
    "side-by-side-half-crossed",
    "top-bottom",
    "top-bottom-half",
    "top-bottom-crossed",
    "top-bottom-half-crossed",
]
PACKINGS: tuple[Packing, ...] = get_args(Packing)

_SEPARATORS = re.compile(r"[-_. ]+")
# Parts of a file's name that say how it is packed: layout and whether it is half.
_LAYOUT_WORDS = {
    "sbs": ("side-by-side", False),
    "hsbs": ("side-by-side", True),
    "ou": ("top-bottom", False),
    "hou": ("top-bottom", True),
    "tb": ("top-bottom", False),
    "htb": ("top-bottom", True),
}
_OTHER_WORDS = ("half", "full", "crossed", "parallel")


def words_of(stem: str) -> list[str]:
    """Return the words of a file's name without its suffix, in lower case."""
    return [word for word in _SEPARATORS.split(stem.lower()) if word]


def named_packing(stem: str) -> Packing | None:
    """Return the packing that a file's name states, such as ``plate_hsbs`` or ``plate_crossed``; None if it does not.

    ``sbs``, ``hsbs``, ``ou``, ``hou``, ``tb`` and ``htb`` name a layout, ``half`` and ``crossed`` beside them its form;
    ``crossed`` alone is side by side. The word counts only after another, so that a picture may be called ``ou``.
    """
    words = words_of(stem)[1:]
    layouts = {_LAYOUT_WORDS[word] for word in words if word in _LAYOUT_WORDS}
    crossed = "crossed" in words
    if len(layouts) > 1 or not (layouts or crossed):
        return None
    layout, half = next(iter(layouts), ("side-by-side", False))
    name = layout + ("-half" if half or (layouts and "half" in words) else "") + ("-crossed" if crossed else "")
    return next(packing for packing in PACKINGS if packing == name)


def without_packing(stem: str) -> str:
    """Return a file's name without the words that state its packing."""
    if named_packing(stem) is None:
        return stem
    parts = re.split(r"([-_. ]+)", stem)
    kept = parts[0]
    for separator, word in zip(parts[1::2], parts[2::2], strict=True):
        if word.lower() not in (*_LAYOUT_WORDS, *_OTHER_WORDS):
            kept += separator + word
    return kept


def eye_size_px(size_px: tuple[int, int], packing: Packing, file: Path) -> tuple[int, int]:
    """Return the width and height of each eye's picture in a file of ``size_px``, stretched if it is half.

    Raises
    ------
    StimulusError
        If the side that is divided is odd.
    """
    width, height = size_px
    if packing == "none":
        return size_px
    across = packing.startswith("side-by-side")
    side, name = (width, "columns") if across else (height, "rows")
    if side % 2:
        raise StimulusError.at(
            file, f"its {side} {name} cannot be divided between two eyes ({packing})", "crop it to an even size"
        )
    if "half" in packing:
        return size_px
    return (width // 2, height) if across else (width, height // 2)


def unpacked(pixels: NDArray[Any], packing: Packing) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the left and the right eye's part of ``pixels`` (height, width, channels), as views and not stretched."""
    first, second = np.split(pixels, 2, axis=1 if packing.startswith("side-by-side") else 0)
    return (second, first) if packing.endswith("crossed") else (first, second)


def stretched(image: StereoImage, packing: Packing) -> StereoImage:
    """Return the two eyes of a half picture at twice their width, or height, interpolated in linear light."""
    width, height = image.width_px, image.height_px
    size = (2 * width, height) if packing.startswith("side-by-side") else (width, 2 * height)
    return resample_picture(image, size, 1.0, "linear")
