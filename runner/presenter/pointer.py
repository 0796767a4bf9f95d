"""A mouse's pointer in each eye's view: the same place in both, so that it has zero parallax in every mode."""

from __future__ import annotations

from devices.compensation import Size
from runner.scene import Box, Offset

_ARM, _WIDTH, _EDGE = 23, 3, 2  # of the cross, in units of which a view of 960 × 1080 has one a pixel


class Pointer:
    """Where a mouse points, from its motion alone, within views of ``view_px``; it shows once it was moved.

    ``shown`` says whether it is seen; a mouse that nobody sees clicks nothing.
    """

    def __init__(self, view_px: Size) -> None:
        self.view_px = view_px
        self.shown = False
        self._x = self._y = 0.0

    @property
    def place_px(self) -> Offset:
        """Where it is, in whole pixels from the middle of a view."""
        return round(self._x), round(self._y)

    def move(self, right_px: float, down_px: float) -> None:
        """Move it, no further than the edge of the view, and let it be seen."""
        width, height = self.view_px
        self._x = _clamped(self._x + right_px, width)
        self._y = _clamped(self._y + down_px, height)
        self.shown = True

    @property
    def items(self) -> tuple[Box, ...]:
        """What it looks like: a white cross with a black edge."""
        unit = min(self.view_px[0] / 960.0, self.view_px[1] / 1080.0)
        edge = max(1, round(_EDGE * unit))
        width = max(2, round(_WIDTH * unit))
        arm = max(width + 4, round(_ARM * unit))
        bars = ((arm, width), (width, arm))
        around = tuple(Box(self.place_px, (across + 2 * edge, down + 2 * edge), 0.0) for across, down in bars)
        return around + tuple(Box(self.place_px, size_px, 1.0) for size_px in bars)


def _clamped(place_px: float, length_px: int) -> float:
    half = length_px / 2.0 - 1.0
    return min(max(place_px, -half), half)
