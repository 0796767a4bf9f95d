"""A map made small enough to draw."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stimuli.pictures.rows import Floats32, Mask

# A map is drawn with at most so many pixels along its longer side, each the mean of those it stands for.
LONGEST_PX = 900


def reduced(values: Floats32, compared: Mask | None = None, longest_px: int = LONGEST_PX) -> Floats32:
    """Return a map, (height, width), as means over square blocks: NaN where a block has no compared pixel."""
    size = max(1, -(-max(values.shape) // longest_px))
    rows, columns = np.arange(0, values.shape[0], size), np.arange(0, values.shape[1], size)

    def sums(cells: NDArray[np.generic]) -> NDArray[np.float64]:
        # Down a block in the type of the map, which is fast; all further sums are of few numbers.
        return np.asarray(np.add.reduceat(np.add.reduceat(cells, rows, axis=0), columns, axis=1, dtype=np.float64))

    if compared is None:
        counts = np.outer(np.diff([*rows, values.shape[0]]), np.diff([*columns, values.shape[1]])).astype(float)
        total = sums(values)
    else:
        counts = sums(compared.astype(np.float32))
        total = sums(np.where(compared, values, np.float32(0)))
    means = np.divide(total, counts, out=np.full(counts.shape, np.nan), where=counts > 0)
    return np.asarray(means, dtype=np.float32)
