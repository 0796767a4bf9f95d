"""What both eyes see now: an immutable value; equal scenes are not drawn twice.

Places are offsets in pixels from the centre of each eye's area, x to the right and y downwards, the same for
both eyes, so that everything but the pictures themselves has zero parallax.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

Offset = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Picture:
    """A stimulus at 1:1, its middle ``offset_px`` from the middle of each eye's area, cropped to ``aperture_px``.

    ``aperture_px`` is (width, height); None shows the whole picture.
    """

    stimulus: str
    offset_px: Offset = (0, 0)
    aperture_px: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class Text:
    """Words in grey at ``luminance_share`` of the display's white, centred, wrapped at ``width_px``.

    ``height_px`` is the size of the type, ``font`` a font file that is asked for each letter before DejaVu Sans and the
    fonts that are installed.
    """

    words: str
    offset_px: Offset = (0, 0)
    height_px: int = 24
    width_px: int = 800
    luminance_share: float = 0.4
    font: Path | None = None


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle of ``size_px`` (width, height) filled with grey at ``luminance_share`` of the display's white."""

    offset_px: Offset
    size_px: tuple[int, int]
    luminance_share: float = 0.4


Item: TypeAlias = Picture | Text | Box


@dataclass(frozen=True, slots=True)
class Scene:
    """Items drawn in order on black."""

    items: tuple[Item, ...] = ()

    @property
    def stimuli(self) -> tuple[str, ...]:
        """Names of the stimuli shown, in drawing order, each once."""
        return tuple(dict.fromkeys(item.stimulus for item in self.items if isinstance(item, Picture)))
