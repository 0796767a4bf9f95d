"""Side by side: the left eye's area is the left half of the surface, the right eye's the right half."""

from __future__ import annotations

from typing import ClassVar

from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.rectangle import Rectangle, Size


class SideBySide(Mode):
    """Two halves of equal size; of an odd width, the column in the middle stays black."""

    name: ClassVar[str] = "side-by-side"
    needs_stereo: ClassVar[bool] = False
    squeeze: ClassVar[tuple[int, int]] = (1, 1)

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Refuse a surface too narrow to halve."""
        return None if size_px[0] >= 2 else f"a surface {size_px[0]} px wide has no two halves"

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the left half and the right half."""
        width, height = size_px
        half = width // 2
        return (
            EyeArea(("left",), Rectangle(0, 0, half, height), squeeze=self.squeeze),
            EyeArea(("right",), Rectangle(width - half, 0, half, height), squeeze=self.squeeze),
        )


class SideBySideHalf(SideBySide):
    """Two halves that the display stretches to its full width: two columns of a view share one of the signal."""

    name: ClassVar[str] = "side-by-side-half"
    squeeze: ClassVar[tuple[int, int]] = (2, 1)
