"""The luminance between the sparkles: a median in each window of a grid, joined by straight lines.

Sparkles fill few pixels of a window, so that its median knows little of them; a window that is mostly sparkle stands
out from its neighbours and takes their median. As in source detection in astronomy [Bertin1996], the grid is far
cheaper than a median about every pixel and equals it in the middle of each window.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats

Luminance = NDArray[np.float32]
# How far above its neighbours a window is no background.
_OUTLIER = 1.5


@dataclass(frozen=True, eq=False, slots=True)
class Background:
    """``grid_cd_m2`` is the luminance at ``rows_px`` × ``columns_px``: the windows' middles and the picture's edges.

    Pixel centres are whole numbers. ``windows_cd_m2`` are the windows' own medians.
    ``noise_cd_m2`` is the standard deviation about the background of what is not sparkle: 1.4826 times the median
    absolute deviation, the median over all windows.
    """

    rows_px: Floats
    columns_px: Floats
    windows_cd_m2: Floats
    grid_cd_m2: Floats
    noise_cd_m2: float

    def lines(self, first: int, last: int, columns: int) -> Luminance:
        """Return the background of the rows ``first`` to ``last`` - 1, float32 (rows, columns)."""
        row, row_share = _between(self.rows_px, np.arange(first, last, dtype=np.float64))
        column, column_share = _between(self.columns_px, np.arange(columns, dtype=np.float64))
        windows = self.grid_cd_m2
        down = windows[row] * (1 - row_share[:, None]) + windows[row + 1] * row_share[:, None]
        start = down[:, column].astype(np.float32)
        start += (down[:, column + 1] - down[:, column]).astype(np.float32) * column_share.astype(np.float32)
        return start

    def at(self, row_px: Floats, column_px: Floats) -> Floats:
        """Return the background at places, shape (n,) each."""
        row, down = _between(self.rows_px, row_px)
        column, across = _between(self.columns_px, column_px)
        windows = self.grid_cd_m2
        upper = windows[row, column] * (1 - across) + windows[row, column + 1] * across
        lower = windows[row + 1, column] * (1 - across) + windows[row + 1, column + 1] * across
        return np.asarray(upper * (1 - down) + lower * down)


def local_background(luminance_cd_m2: Luminance, window_px: int) -> Background:
    """Return the background of a picture (rows, columns) from windows about ``window_px`` wide and high."""
    edges = [
        np.linspace(0, size, max(1, round(size / window_px)) + 1).round().astype(int) for size in luminance_cd_m2.shape
    ]
    rows, columns = edges
    windows = np.empty((len(rows) - 1, len(columns) - 1))
    deviations = np.empty_like(windows)
    for i in range(len(rows) - 1):
        for j in range(len(columns) - 1):
            part = luminance_cd_m2[rows[i] : rows[i + 1], columns[j] : columns[j + 1]].flatten()
            middle = _median(part)
            part -= middle
            windows[i, j] = middle
            deviations[i, j] = _median(np.abs(part, out=part))
    middles = [0.5 * (edge[1:] + edge[:-1] - 1) for edge in edges]
    noise_cd_m2 = 1.4826 * float(np.median(deviations))
    grid = _without_outliers(windows)
    for axis in (0, 1):
        grid = _to_the_edges(grid, middles[axis], luminance_cd_m2.shape[axis], axis)
    ends = [
        np.concatenate([[-0.5], middle, [size - 0.5]])
        for middle, size in zip(middles, luminance_cd_m2.shape, strict=True)
    ]
    return Background(ends[0], ends[1], windows, grid, noise_cd_m2)


def _median(values: Luminance) -> float:
    """Return the median of (n,) finite values, which it sorts in part: that of `np.median`, in a fifth of its time."""
    half = len(values) // 2
    values.partition(half)
    upper = values[half]
    # In single precision, as the values are.
    return float(upper if len(values) % 2 else np.float32(0.5) * (values[:half].max() + upper))


def _without_outliers(windows: Floats) -> Floats:
    """Return the windows, those far above the median of their neighbours replaced by it."""
    around = np.lib.stride_tricks.sliding_window_view(np.pad(windows, 1, mode="edge"), (3, 3))
    usual = np.median(around, axis=(2, 3))
    return np.asarray(np.where(windows > _OUTLIER * usual, usual, windows))


def _to_the_edges(grid: Floats, middles_px: Floats, size: int, axis: int) -> Floats:
    """Return the grid with a value at either edge of the picture along ``axis``, on a straight line with the next two.

    A straight line may lead anywhere: it is limited to half and twice the outermost window.
    """
    lines = np.moveaxis(grid, axis, 0)
    ends = []
    for end, last, before in ((-0.5, 0, 1), (size - 0.5, -1, -2)):
        value = lines[last]
        if len(lines) > 1:
            steps = (end - middles_px[last]) / (middles_px[last] - middles_px[before])
            value = value + steps * (value - lines[before])
            bounds = np.sort([0.5 * lines[last], 2.0 * lines[last]], axis=0)
            value = np.clip(value, *bounds)
        ends.append(value[None])
    return np.moveaxis(np.concatenate([ends[0], lines, ends[1]]), 0, axis)


def _between(nodes_px: Floats, places_px: Floats) -> tuple[NDArray[np.int64], Floats]:
    """Return the node before each place and the share of the way to the next."""
    before = np.clip(np.searchsorted(nodes_px, places_px, side="right") - 1, 0, len(nodes_px) - 2)
    return before, (places_px - nodes_px[before]) / (nodes_px[before + 1] - nodes_px[before])
