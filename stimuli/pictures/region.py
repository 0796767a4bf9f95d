"""A part of a picture, in whole pixels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class Region:
    """``height`` rows from ``top`` and ``width`` columns from ``left``, in pixels from a picture's top left corner."""

    left: int
    top: int
    width: int
    height: int

    @property
    def right(self) -> int:
        """The first column beyond it."""
        return self.left + self.width

    @property
    def bottom(self) -> int:
        """The first row beyond it."""
        return self.top + self.height

    def is_within(self, width_px: int, height_px: int) -> bool:
        """Whether it has a pixel, and all of them are those of a picture of that size."""
        across = 0 <= self.left < self.right <= width_px
        return across and 0 <= self.top < self.bottom <= height_px


# From a picture's (width, height) in pixels to the part of it to read.
Part: TypeAlias = Callable[[tuple[int, int]], Region]
