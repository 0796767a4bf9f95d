"""Pictures that are read a few rows at a time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

# Pixels worked on at a time: some tens of megabytes of intermediate values.
BAND_PIXELS = 1 << 19


class RowSource(Protocol):
    """A picture of shape (height, width, 3) whose rows are had by slicing; an array is one, a file may be."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Height, width and 3."""
        ...

    def __getitem__(self, rows: slice, /) -> NDArray[np.floating]:
        """Return those rows, shape (rows, width, 3)."""
        ...


def bands(shape: tuple[int, ...]) -> Iterator[slice]:
    """Return slices that go through the rows of a picture of ``shape``, some `BAND_PIXELS` pixels each."""
    height, width = shape[:2]
    rows = max(1, BAND_PIXELS // max(width, 1))
    return (slice(start, min(start + rows, height)) for start in range(0, height, rows))
