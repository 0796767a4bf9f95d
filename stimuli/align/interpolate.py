"""Pictures between their pixels, in linear light.

A whole shift copies. A fraction is interpolated by a sinc windowed with a wider sinc (Lanczos), by Keys's cubic
[Keys1981], or by straight lines; the weights are divided by their sum, so that flat light stays as it is. What an
interpolator costs at a fraction is `transfer`: the share of a grating's contrast that is left.

Sinc and cubic undershoot beside a sparkle. Where a picture had no negative light, none is made: such pixels are set
to 0 and counted.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from documents import Finding
from documents.arrays import Floats, Floats32
from stimuli.errors import StimulusError

Interpolation = Literal["sinc", "cubic", "linear"]

LOBES = 5
_REACH: dict[str, int] = {"sinc": LOBES, "cubic": 2, "linear": 1}


def reach_px(interpolation: Interpolation) -> int:
    """Return how many pixels away the interpolation looks. Raises StimulusError for a name that is none."""
    if interpolation not in _REACH:
        raise StimulusError(
            Finding(
                f"interpolation is {interpolation!r}", remedy="one of " + ", ".join(map(repr, get_args(Interpolation)))
            )
        )
    return _REACH[interpolation]


def weights(fraction: float, interpolation: Interpolation = "sinc") -> Floats:
    """Return the weights (2 · reach + 1,) of a pixel and its neighbours, for the value ``fraction`` of a pixel on."""
    reach = reach_px(interpolation)
    away = np.arange(-reach, reach + 1) - fraction
    near = np.abs(away)
    if interpolation == "sinc":
        taps = np.where(near < reach, np.sinc(away) * np.sinc(away / reach), 0.0)
    elif interpolation == "cubic":
        inner = (1.5 * near - 2.5) * near**2 + 1.0
        outer = ((-0.5 * near + 2.5) * near - 4.0) * near + 2.0
        taps = np.where(near < 1.0, inner, np.where(near < 2.0, outer, 0.0))
    else:
        taps = np.maximum(1.0 - near, 0.0)
    return np.asarray(taps / taps.sum())


def transfer(fraction: float, cycles_per_px: ArrayLike, interpolation: Interpolation = "sinc") -> Floats:
    """Return the share of contrast, any shape, that gratings of ``cycles_per_px`` (to 0.5) keep after interpolation."""
    taps = weights(fraction, interpolation)
    places = np.arange(len(taps)) - len(taps) // 2
    phases = np.exp(2j * np.pi * np.multiply.outer(np.asarray(cycles_per_px, dtype=np.float64), places))
    return np.asarray(np.abs(phases @ taps))


def sampled(plane: NDArray[np.floating], shift_px: tuple[float, float], interpolation: Interpolation) -> Floats32:
    """Return ``plane`` (height, width) at x + shift, y + shift, float32; its edge pixels are repeated beyond its edges.

    A whole shift of either axis moves without interpolating.
    """
    from scipy.ndimage import correlate1d

    moved = np.asarray(plane, dtype=np.float32)
    for axis, shift in ((1, shift_px[0]), (0, shift_px[1])):
        whole = int(np.round(shift))
        if whole:
            index = np.clip(np.arange(moved.shape[axis]) + whole, 0, moved.shape[axis] - 1)
            moved = moved.take(index, axis=axis)
        if shift != whole:
            moved = correlate1d(moved, weights(shift - whole, interpolation), axis=axis, mode="nearest")
    return moved


def cut(
    picture: Floats32, start_px: tuple[float, float], size_px: tuple[int, int], interpolation: Interpolation
) -> tuple[Floats32, int]:
    """Return the part of ``picture`` (height, width, channels) that begins at ``start_px``, and what was set to 0.

    ``start_px`` and ``size_px`` are across and down. Whole starts copy. Rows are worked on in bands, so that little
    more memory is taken than the part itself needs.
    """
    width, height = size_px
    whole = [int(np.round(start)) for start in start_px]
    fraction = (start_px[0] - whole[0], start_px[1] - whole[1])
    if not any(fraction):
        return np.array(picture[whole[1] : whole[1] + height, whole[0] : whole[0] + width], dtype=np.float32), 0
    reach = reach_px(interpolation)
    part_picture = np.empty((height, width, picture.shape[2]), dtype=np.float32)
    negative = 0
    columns = _clipped(whole[0] - reach, width + 2 * reach, picture.shape[1])
    for first in range(0, height, 512):
        count = min(512, height - first)
        rows = _clipped(whole[1] + first - reach, count + 2 * reach, picture.shape[0])
        source = picture[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        source = source[np.ix_(rows - rows[0], columns - columns[0])]
        below = np.zeros((count, width), dtype=np.bool_)
        for channel in range(picture.shape[2]):
            part = sampled(source[:, :, channel], fraction, interpolation)[reach : reach + count, reach : reach + width]
            if source[:, :, channel].min() >= 0.0:
                below |= part < 0.0
                part = np.maximum(part, np.float32(0))
            part_picture[first : first + count, :, channel] = part
        negative += int(below.sum())
    return part_picture, negative


def _clipped(first: int, count: int, length: int) -> NDArray[np.int64]:
    return np.clip(np.arange(first, first + count), 0, length - 1)
