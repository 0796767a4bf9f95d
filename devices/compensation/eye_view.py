"""Where each eye's view lies on the panel, and which pixels of the panel a picture's pixels fall on.

Rectangles are of whole pixels and count from the top left corner. A position is in pixels of the panel, x to the right
and y down, as in `devices.display.gain_map`: the middle of the first pixel is at half a pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from documents.arrays import Floats

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

    def seen_from(self, area: Rectangle) -> Rectangle:
        """Return this rectangle with its place counted from the corner of ``area``."""
        return Rectangle(self.left - area.left, self.top - area.top, self.width, self.height)

    def intersection(self, other: Rectangle) -> Rectangle:
        """Return the pixels that lie in both; it may be empty."""
        left, top = max(self.left, other.left), max(self.top, other.top)
        right = min(self.left + self.width, other.left + other.width)
        bottom = min(self.top + self.height, other.top + other.height)
        return Rectangle(left, top, max(right - left, 0), max(bottom - top, 0))


def squeezed_size(size_px: Size, squeeze: tuple[int, int]) -> Size:
    """Return the size of what is left of a view of ``size_px``: a box at the edge may be part empty.

    Parameters
    ----------
    size_px
        Width and height of the view, in pixels.
    squeeze
        How many pixels across and down of the view share one of the signal, at least 1.

    Returns
    -------
    tuple
        Width and height in pixels of the signal, rounded up.

    Examples
    --------
    >>> squeezed_size((1921, 1080), (2, 1))
    (961, 1080)
    """
    return -(-size_px[0] // squeeze[0]), -(-size_px[1] // squeeze[1])


@dataclass(frozen=True, slots=True)
class PixelGrid:
    """Positions of pixels on the panel: the top left one's, and the step to the next column and row, (x, y) each."""

    first_px: tuple[float, float]
    step_px: tuple[int, int]

    def axes(self, size_px: Size) -> tuple[Floats, Floats]:
        """Return the columns' x (width,) and the rows' y (height,) of a picture of ``size_px``."""
        axes = zip(self.first_px, self.step_px, size_px, strict=True)
        x, y = (first + step * np.arange(count, dtype=np.float64) for first, step, count in axes)
        return x, y


@dataclass(frozen=True, slots=True)
class EyeView:
    """The part of the surface that shows an eye's view, and how.

    ``squeeze`` is how many pixels across and down of the view share one pixel of ``rectangle``, where the display
    stretches a squeezed signal back over its panel. ``offset_px`` moves the view, in pixels of the view; ``mirror``
    reverses it, (left to right, top to bottom).
    """

    rectangle: Rectangle
    squeeze: tuple[int, int] = (1, 1)
    offset_px: tuple[int, int] = (0, 0)
    mirror: tuple[bool, bool] = (False, False)

    @property
    def view_px(self) -> Size:
        """Width and height of the eye's view, in pixels of the panel as the eye sees it."""
        return self.rectangle.width * self.squeeze[0], self.rectangle.height * self.squeeze[1]

    def place(
        self, size_px: Size, offset_px: tuple[int, int], aperture_px: Size | None = None
    ) -> tuple[Rectangle, Rectangle]:
        """Return where an item stands on the surface and what of it is seen; it may be nothing.

        ``size_px`` counts pixels of the surface, so it is already squeezed. ``offset_px`` and ``aperture_px`` count
        pixels of the eye's view; in a squeezed view, the offset falls on the signal's pixel below it and the aperture
        takes every pixel that it touches.
        """
        across, down = self.squeeze
        moved = (offset_px[0] + self.offset_px[0]) // across, (offset_px[1] + self.offset_px[1]) // down
        whole = self.rectangle
        place = whole.centred(size_px, moved)
        shown = whole.intersection(place)
        if aperture_px is not None:
            shown = shown.intersection(whole.centred(squeezed_size(aperture_px, self.squeeze), moved))
        return place.mirrored_in(whole, self.mirror), shown.mirrored_in(whole, self.mirror)

    def code_grid(self, codes_px: Size, offset_px: tuple[int, int]) -> PixelGrid:
        """Return the positions of the pixels of the signal, for a picture of ``codes_px`` of them at ``offset_px``.

        Where the signal is squeezed, the position is the middle of the pixels of the panel that one is stretched over.
        """
        place, _ = self.place(codes_px, offset_px)
        if self.squeeze == (1, 1):
            return self._grid(place, (1, 1))
        return self._grid(place.seen_from(self.rectangle), self.squeeze)

    def pixel_grid(self, size_px: Size, offset_px: tuple[int, int]) -> PixelGrid:
        """Return the positions of the pixels of the eye's view, for a picture of ``size_px`` of them at ``offset_px``.

        Where the signal is squeezed, these are positions in the view that the display stretches over its panel.
        """
        whole = self.rectangle if self.squeeze == (1, 1) else Rectangle(0, 0, *self.view_px)
        moved = offset_px[0] + self.offset_px[0], offset_px[1] + self.offset_px[1]
        return self._grid(whole.centred(size_px, moved).mirrored_in(whole, self.mirror), (1, 1))

    def _grid(self, place: Rectangle, squeeze: tuple[int, int]) -> PixelGrid:
        corner = place.left, place.top
        axes = list(zip(corner, place.size_px, squeeze, self.mirror, strict=True))
        x, y = ((first + (count - 0.5 if reverse else 0.5)) * step for first, count, step, reverse in axes)
        across, down = (-step if reverse else step for _, _, step, reverse in axes)
        return PixelGrid((x, y), (across, down))
