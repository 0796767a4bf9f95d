"""Pictures as they lie before a homography, by a cubic spline in linear light.

A shift, the commonest, is interpolated along rows and columns in turn: 8 products a pixel where any other way needs 16,
and no places.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from documents.arrays import Floats, Floats32
from documents.compiled import loops
from stimuli.align.homography import mapped

_BAND_ROWS = 256
# Beyond a picture's edges its outermost pixels are repeated this far, for the spline.
_PAD = 12


@dataclass(frozen=True, eq=False, slots=True)
class WarpedPicture:
    """A warped picture, how many of its pixels lie outside the one it came from, and how many were set to 0."""

    picture: Floats32
    outside_px: int
    negative_px: int


def warp(picture: Floats32, matrix: ArrayLike, size_px: tuple[int, int], *, of: int | None = None) -> WarpedPicture:
    """Return ``picture`` (height, width, channels) as it lies before a homography, of ``size_px`` across and down.

    In linear light, by a cubic spline; what lies outside takes the nearest edge's light and is counted; where
    ``picture`` has no negative light none is made.

    Parameters
    ----------
    picture
        Linear light in any unit, float32 (height, width, channels).
    matrix
        The homography, (3, 3), from places x and y of the outcome to places of ``picture``, in pixels.
    size_px
        Width and height of the outcome, in pixels.
    of
        The number of pixels in all, if these are a part of a picture: it decides whether compiled loops do it, and all
        parts are then done in one way.

    Returns
    -------
    WarpedPicture
        The picture, float32 (height, width, channels), and how many of its pixels lie outside or were set to 0.

    Examples
    --------
    >>> light = np.full((20, 30, 3), 5.0, np.float32)
    >>> warped = warp(light, [[1.0, 0.0, 10.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], (30, 20))
    >>> warped.picture.shape, warped.outside_px              # 10 of 30 columns lie outside
    ((20, 30, 3), 200)
    """
    width, height = size_px
    matrix = np.asarray(matrix, dtype=np.float64)
    planes = [np.asarray(picture[:, :, channel], dtype=np.float32) for channel in range(picture.shape[2])]
    size = picture.shape[:2]
    warped = np.empty((height, width, len(planes)), dtype=np.float32)
    if is_shift(matrix):
        _shift(planes, matrix, warped, of or width * height)
    else:
        for rows, channel, part in _mapped(planes, matrix, size_px):
            warped[rows, :, channel] = part
    below = np.zeros((height, width), dtype=np.bool_)
    for channel, plane in enumerate(planes):
        if plane.min() >= 0.0:
            below |= warped[:, :, channel] < 0.0
            np.maximum(warped[:, :, channel], 0.0, out=warped[:, :, channel])
    return WarpedPicture(warped, _outside(matrix, size_px, size), int(below.sum()))


def is_shift(matrix: Floats) -> bool:
    """Return whether a homography (3, 3) only shifts."""
    return bool(np.array_equal(matrix[:, :2], np.eye(3)[:, :2]) and matrix[2, 2] == 1.0)


def grid_places(matrix: Floats, rows: slice, width: int) -> tuple[Floats, Floats]:
    """Return where a homography takes the pixels of some rows: x and y, each (rows, width) or of one row or column."""
    down, across = np.arange(rows.start, rows.stop, dtype=np.float64)[:, None], np.arange(width, dtype=np.float64)
    if is_shift(matrix):
        return across[None, :] + matrix[0, 2], down + matrix[1, 2]
    places = mapped(matrix, np.stack(np.broadcast_arrays(across, down), axis=-1))
    return places[..., 0], places[..., 1]


def _bands(height: int) -> Iterator[slice]:
    for first in range(0, height, _BAND_ROWS):
        yield slice(first, min(first + _BAND_ROWS, height))


def _outside(matrix: Floats, size_px: tuple[int, int], size: tuple[int, int]) -> int:
    """Return how many of the outcome's pixels lie beyond the edge of a picture of ``size``, height and width."""
    width, height = size_px
    count = 0
    for rows in _bands(height):
        x, y = grid_places(matrix, rows, width)
        beyond = (x < -0.5) | (x > size[1] - 0.5) | (y < -0.5) | (y > size[0] - 0.5)
        count += int(np.count_nonzero(beyond))
    return count


def _spline(plane: Floats32) -> Floats32:
    from scipy.ndimage import spline_filter

    padded = np.pad(plane, _PAD, mode="edge")
    return np.asarray(spline_filter(padded, 3, output=np.float32, mode="mirror"))


def _mapped(planes: list[Floats32], matrix: Floats, size_px: tuple[int, int]) -> Iterator[tuple[slice, int, Floats32]]:
    from scipy.ndimage import map_coordinates

    width, height = size_px
    splines = [_spline(plane) for plane in planes]
    bottom, right = (side - 1 for side in planes[0].shape)
    for rows in _bands(height):
        x, y = grid_places(matrix, rows, width)
        where = [np.clip(y, 0, bottom) + _PAD, np.clip(x, 0, right) + _PAD]
        for channel, spline in enumerate(splines):
            part = map_coordinates(spline, where, order=3, prefilter=False, output=np.float32, mode="mirror")
            yield rows, channel, part


def _shift(planes: list[Floats32], matrix: Floats, warped: Floats32, of: int) -> None:
    """Write shifted planes into the channels of ``warped`` (height, width, channels), a part ``of`` so many pixels."""
    height, width = warped.shape[:2]
    columns = _Taps.at(np.arange(width) + matrix[0, 2], planes[0].shape[1])
    rows = _Taps.at(np.arange(height) + matrix[1, 2], planes[0].shape[0])
    compiled = loops("stimuli.align.warping_loops", of)
    for channel, plane in enumerate(planes):
        spline = _spline(plane)
        if compiled is not None:
            taps = rows.first, rows.weights, columns.first, columns.weights
            compiled.between_pixels(spline, *taps, warped, channel)
            continue
        for band in _bands(height):
            part = _Taps(rows.first[band], rows.weights[:, band])
            warped[band, :, channel] = columns.along(part.along(spline).T).T


@dataclass(frozen=True, eq=False, slots=True)
class _Taps:
    """The first of four pixels that each place along an axis lies among, (places,), and their weights, (4, places)."""

    first: NDArray[np.int64]
    weights: Floats32

    @classmethod
    def at(cls, places: Floats, size: int) -> _Taps:
        """Return those of places along an axis of ``size`` pixels; beyond its ends those of the end."""
        padded = np.clip(places, 0, size - 1) + _PAD
        first = np.floor(padded).astype(np.int64)
        t = padded - first
        weights = np.stack([(1 - t) ** 3, 4 - 6 * t**2 + 3 * t**3, 1 + 3 * t + 3 * t**2 - 3 * t**3, t**3]) / 6.0
        return cls(first - 1, weights.astype(np.float32))

    def along(self, spline: Floats32) -> Floats32:
        """Return the first axis of ``spline`` (pixels, others) at the places, (places, others)."""
        out = np.zeros((len(self.first), spline.shape[1]), dtype=np.float32)
        for tap, weight in enumerate(self.weights):
            out += weight[:, None] * spline[self.first + tap]
        return out
