"""Top and bottom: the left eye's area is the upper half of the surface, the right eye's the lower half."""

from __future__ import annotations

from typing import ClassVar

from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.rectangle import Rectangle, Size


class TopBottom(Mode):
    """Two halves of equal size; of an odd height, the row in the middle stays black."""

    name: ClassVar[str] = "top-bottom"
    needs_stereo: ClassVar[bool] = False
    squeeze: ClassVar[tuple[int, int]] = (1, 1)

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Refuse a surface too low to halve."""
        return None if size_px[1] >= 2 else f"a surface {size_px[1]} px high has no two halves"

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the upper half and the lower half."""
        width, height = size_px
        half = height // 2
        return (
            EyeArea(("left",), Rectangle(0, 0, width, half), squeeze=self.squeeze),
            EyeArea(("right",), Rectangle(0, height - half, width, half), squeeze=self.squeeze),
        )


class TopBottomHalf(TopBottom):
    """Two halves that the display stretches to its full height: two rows of a view share one of the signal."""

    name: ClassVar[str] = "top-bottom-half"
    squeeze: ClassVar[tuple[int, int]] = (1, 2)
