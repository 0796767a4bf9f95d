"""A spline at shifted places, compiled: what `warping` does in NumPy, without the arrays between."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats32
from documents.compiled import loop

Places = NDArray[np.int64]


@loop("void(float32[:, ::1], int64[::1], float32[:, ::1], int64[::1], float32[:, ::1], float32[:, :, ::1], int64)")
def between_pixels(
    spline: Floats32,
    row: Places,
    row_weight: Floats32,
    column: Places,
    column_weight: Floats32,
    out: Floats32,
    channel: int,
) -> None:
    """Write a spline's values into one channel of ``out`` (rows, columns, channels).

    Each place lies among four pixels, from ``row`` and ``column`` on, with the weights (4, places).
    """
    line = np.empty(spline.shape[1], np.float32)
    for i in range(len(row)):
        first, second, third, fourth = row_weight[0, i], row_weight[1, i], row_weight[2, i], row_weight[3, i]
        one, two, three, four = spline[row[i]], spline[row[i] + 1], spline[row[i] + 2], spline[row[i] + 3]
        for j in range(len(line)):
            line[j] = first * one[j] + second * two[j] + third * three[j] + fourth * four[j]
        for j in range(len(column)):
            k = column[j]
            out[i, j, channel] = (
                column_weight[0, j] * line[k]
                + column_weight[1, j] * line[k + 1]
                + column_weight[2, j] * line[k + 2]
                + column_weight[3, j] * line[k + 3]
            )
