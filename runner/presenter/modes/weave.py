"""Which pixels of an interleaved picture are one eye's: every second row, column, or square of a checkerboard."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Weave:
    """The pixels (x, y), from the top left, whose ``column_step`` · x + ``row_step`` · y + ``start`` is even.

    Steps of (0, 1) weave rows, (1, 0) columns, (1, 1) a checkerboard. ``start`` is 0 or 1.
    """

    column_step: int
    row_step: int
    start: int = 0

    def other(self) -> Weave:
        """Return the pixels that are not in this one."""
        return Weave(self.column_step, self.row_step, 1 - self.start)

    def seen_from(self, position_px: tuple[int, int]) -> Weave:
        """Return the same pixels of the panel, counted from its pixel ``position_px``."""
        moved = self.column_step * position_px[0] + self.row_step * position_px[1]
        return Weave(self.column_step, self.row_step, (self.start + moved) % 2)

    def mask(self, height: int, width: int) -> NDArray[np.bool_]:
        """Return which of (height, width) pixels are in it."""
        rows, columns = np.ogrid[:height, :width]
        return np.asarray((self.column_step * columns + self.row_step * rows + self.start) % 2 == 0)
