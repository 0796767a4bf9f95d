"""A map made small enough to draw."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stimuli.pictures.rows import BAND_PIXELS, Floats32, Mask

# A map is drawn with at most so many pixels along its longer side, each the mean of those it stands for.
LONGEST_PX = 900


def reduced(values: Floats32, compared: Mask | None = None, longest_px: int = LONGEST_PX) -> Floats32:
    """Return a map, (height, width), as means over square blocks: NaN where a block has no compared pixel."""
    size = max(1, -(-max(values.shape) // longest_px))
    height, width = values.shape
    columns = np.arange(0, width, size)
    means = []
    # A few rows of blocks at a time, so that no other map of this size is in memory.
    step = size * max(1, BAND_PIXELS // (width * size))
    for first in range(0, height, step):
        part = values[first : first + step]
        rows = np.arange(0, len(part), size)
        if compared is None:
            counts = np.outer(np.diff([*rows, len(part)]), np.diff([*columns, width])).astype(np.float64)
        else:
            within = compared[first : first + step]
            counts = _sums(within.astype(np.float32), rows, columns)
            part = np.where(within, part, np.float32(0))
        total = _sums(part, rows, columns)
        means.append(np.divide(total, counts, out=np.full(counts.shape, np.nan), where=counts > 0))
    return np.asarray(np.concatenate(means), dtype=np.float32)


def _sums(values: Floats32, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return sums over blocks that begin at ``rows`` and ``columns``: down a block in float32, which is fast."""
    return np.asarray(np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1, dtype=np.float64))
