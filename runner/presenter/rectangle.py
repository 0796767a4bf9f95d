"""Rectangles of whole pixels, counted from the top left corner."""

from __future__ import annotations

from dataclasses import dataclass

Size = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Rectangle:
    """``left`` and ``top`` in pixels from the top left corner of the surface, and the extent; empty below 1."""

    left: int
    top: int
    width: int
    height: int

    @property
    def size_px(self) -> Size:
        """Width and height."""
        return self.width, self.height

    @property
    def is_empty(self) -> bool:
        """Whether it holds no pixel."""
        return self.width < 1 or self.height < 1

    def centred(self, size_px: Size, offset_px: tuple[int, int] = (0, 0)) -> Rectangle:
        """Return a rectangle of ``size_px`` in the middle of this one, moved by ``offset_px``.

        Its corner is (this − size) // 2, by floor, so that a size one larger than the area sticks out by one
        pixel at the top left.
        """
        width, height = size_px
        return Rectangle(
            self.left + (self.width - width) // 2 + offset_px[0],
            self.top + (self.height - height) // 2 + offset_px[1],
            width,
            height,
        )

    def mirrored_in(self, area: Rectangle, mirror: tuple[bool, bool]) -> Rectangle:
        """Return where this rectangle is seen when ``area`` is mirrored (left to right, top to bottom)."""
        left = 2 * area.left + area.width - self.left - self.width if mirror[0] else self.left
        top = 2 * area.top + area.height - self.top - self.height if mirror[1] else self.top
        return Rectangle(left, top, self.width, self.height)

    def intersection(self, other: Rectangle) -> Rectangle:
        """Return the pixels that lie in both; it may be empty."""
        left, top = max(self.left, other.left), max(self.top, other.top)
        right = min(self.left + self.width, other.left + other.width)
        bottom = min(self.top + self.height, other.top + other.height)
        return Rectangle(left, top, max(right - left, 0), max(bottom - top, 0))
