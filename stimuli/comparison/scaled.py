"""A picture times a factor, as its rows are read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stimuli.comparison.row_source import RowSource


class ScaledRows:
    """A `RowSource`, times ``factor``."""

    def __init__(self, picture: RowSource, factor: float = 1.0) -> None:
        self._picture = picture
        self.factor = factor

    @property
    def shape(self) -> tuple[int, ...]:
        """Height, width and 3."""
        return self._picture.shape

    def __getitem__(self, rows: slice, /) -> NDArray[np.float32]:
        """Return those rows, float32 (rows, width, 3)."""
        found = np.asarray(self._picture[rows], dtype=np.float32)
        return found if self.factor == 1.0 else found * np.float32(self.factor)
