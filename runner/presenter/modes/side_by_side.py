"""Side by side: the left eye's area is the left half of the surface, the right eye's the right half."""

from __future__ import annotations

from typing import ClassVar

from runner.presenter.modes.mode import EyeArea
from runner.presenter.rectangle import Rectangle, Size


class SideBySide:
    """Two halves of equal size; of an odd width, the column in the middle stays black."""

    name: ClassVar[str] = "side-by-side"
    needs_stereo: ClassVar[bool] = False

    def unavailable(self, size_px: Size, *, stereo: bool) -> str | None:
        """Refuse a surface too narrow to halve."""
        return None if size_px[0] >= 2 else f"a surface {size_px[0]} px wide has no two halves"

    def areas(self, size_px: Size) -> tuple[EyeArea, ...]:
        """Return the left half and the right half."""
        width, height = size_px
        half = width // 2
        return (
            EyeArea(("left",), Rectangle(0, 0, half, height)),
            EyeArea(("right",), Rectangle(width - half, 0, half, height)),
        )
