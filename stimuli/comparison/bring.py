"""A rendering brought to the photograph's pixels, a band of rows at a time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from stimuli.align.homography import mapped, warp
from stimuli.comparison.placing import Placing
from stimuli.comparison.row_file import RowFile

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
RowsDone = Callable[[int, int], None]

# Rows made at a time, and rows beyond those they come from: what a cubic spline looks at fades within these.
_BAND_ROWS, _BEYOND = 256, 24


def brought(rendering: RowFile, placing: Placing, size_px: tuple[int, int], done: RowsDone) -> tuple[RowFile, Mask]:
    """Return the rendering on a grid of ``size_px`` across and down, and which of its pixels lie within the rendering.

    In linear light, by a cubic spline; pixels are within only where the spline looks at nothing made up.
    """
    width, height = size_px
    if not placing.moved:
        return rendering, np.ones((height, width), dtype=np.bool_)
    found, within = RowFile((height, width, 3)), np.empty((height, width), dtype=np.bool_)
    for first in range(0, height, _BAND_ROWS):
        last = min(first + _BAND_ROWS, height)
        within[first:last] = _within(placing.matrix, first, last, width, rendering.shape)
        top, bottom = _rows_seen(placing.matrix, first, last, width, rendering.shape[0])
        source = rendering[top:bottom]
        turned = _down(-top) @ placing.matrix @ _down(first)
        found.write(first, warp(source, turned, (width, last - first)).picture)
        done(last, height)
    return found, within


def flags_brought(flags: Mask, placing: Placing, size_px: tuple[int, int]) -> Mask:
    """Return flags (height, width) of the rendering on that grid; a pixel is flagged if one that it comes from is."""
    width, height = size_px
    if not placing.moved:
        return flags
    from scipy.ndimage import maximum_filter

    wide = maximum_filter(flags, 3)
    found = np.zeros((height, width), dtype=np.bool_)
    for first in range(0, height, _BAND_ROWS):
        last = min(first + _BAND_ROWS, height)
        places = np.round(_places(placing.matrix, first, last, width)).astype(np.int64)
        x, y = places[..., 0], places[..., 1]
        inside = (x >= 0) & (x < flags.shape[1]) & (y >= 0) & (y < flags.shape[0])
        part = found[first:last]
        part[inside] = wide[y[inside], x[inside]]
    return found


def _places(matrix: Floats, first: int, last: int, width: int) -> Floats:
    columns, rows = np.arange(width, dtype=np.float64), np.arange(first, last, dtype=np.float64)
    return mapped(matrix, np.stack(np.meshgrid(columns, rows), axis=-1))


def _within(matrix: Floats, first: int, last: int, width: int, shape: tuple[int, ...]) -> Mask:
    places = _places(matrix, first, last, width)
    x, y = places[..., 0], places[..., 1]
    return np.asarray((x >= 1) & (x <= shape[1] - 2) & (y >= 1) & (y <= shape[0] - 2))


def _rows_seen(matrix: Floats, first: int, last: int, width: int, height: int) -> tuple[int, int]:
    corners = np.array([[0, first], [width - 1, first], [0, last - 1], [width - 1, last - 1]], dtype=np.float64)
    y = mapped(matrix, corners)[:, 1]
    top = int(np.clip(np.floor(y.min()) - _BEYOND, 0, height - 1))
    return top, int(np.clip(np.ceil(y.max()) + _BEYOND + 1, top + 1, height))


def _down(by: float) -> Floats:
    return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, by], [0.0, 0.0, 1.0]])
