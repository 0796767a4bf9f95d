"""Row-interleaved, column-interleaved and checkerboard: the eyes share the surface pixel by pixel.

The panel's optics decide which eye sees which pixel, so parity counts from the panel's first pixel, not the window's:
the left eye has even rows, even columns, or the squares whose row and column add to an even number. Neither view is
filtered: an eye sees every second row, column or square of its picture at 1:1.
"""

from __future__ import annotations

from typing import ClassVar

from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.modes.weave import Weave
from runner.presenter.rectangle import Rectangle, Size


class _Interleaved(Mode):
    """What the three have in common; ``left`` are the left eye's pixels of the panel."""

    name: ClassVar[str]
    left: ClassVar[Weave]
    needs_stereo: ClassVar[bool] = False

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Refuse a surface that has not a pixel for each eye."""
        width, height = size_px
        across, down = self.left.column_step, self.left.row_step
        enough = (across and width >= 2) or (down and height >= 2)
        return None if enough else f"a surface of {width} × {height} px has not a pixel for each eye"

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the whole surface for each eye, with the pixels of it that are that eye's."""
        whole = Rectangle(0, 0, *size_px)
        left = self.left.seen_from(position_px)
        return EyeArea(("left",), whole, weave=left), EyeArea(("right",), whole, weave=left.other())


class RowInterleaved(_Interleaved):
    """Even rows of the panel for the left eye, odd rows for the right: line-polarised panels."""

    name: ClassVar[str] = "row-interleaved"
    left: ClassVar[Weave] = Weave(0, 1)


class ColumnInterleaved(_Interleaved):
    """Even columns of the panel for the left eye, odd columns for the right: parallax barriers."""

    name: ClassVar[str] = "column-interleaved"
    left: ClassVar[Weave] = Weave(1, 0)


class Checkerboard(_Interleaved):
    """The square of the panel's first pixel and its like for the left eye: DLP projection."""

    name: ClassVar[str] = "checkerboard"
    left: ClassVar[Weave] = Weave(1, 1)
