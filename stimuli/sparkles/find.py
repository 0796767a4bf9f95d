"""Sparkles: places that are brighter than all around them and brighter than a threshold.

Only the pixels above the threshold are looked at again: the brightest within `SEPARATION_PX` of each is a peak, and
those that touch form one area. Two sparkles nearer than `SEPARATION_PX` are one peak; two peaks in one area overlap.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats
from documents.compiled import loops
from documents.text import counted
from stimuli.errors import StimulusError
from stimuli.sparkles.background import Background, Luminance, local_background

# The least distance of two peaks.
SEPARATION_PX = 2
# Where another pixel may be brighter: down and across.
OFFSETS = tuple(
    (down, across)
    for down in range(-SEPARATION_PX, SEPARATION_PX + 1)
    for across in range(-SEPARATION_PX, SEPARATION_PX + 1)
    if 0 < down * down + across * across <= SEPARATION_PX**2
)
# Rows whose background is in memory at a time.
_ROWS = 256
# A threshold that half the picture exceeds does not separate sparkles from what lies between them.
_MOST_ABOVE = 0.5


@dataclass(frozen=True, slots=True)
class SparkleThreshold:
    """What a sparkle is brighter than: ``times`` the local background and ``above_cd_m2``; 0 asks for nothing.

    ``times`` 2 is a Weber contrast above 1. Raises StimulusError if neither asks for anything.
    """

    times: float = 2.0
    above_cd_m2: float = 0.0

    def __post_init__(self) -> None:
        if not all(math.isfinite(value) and value >= 0 for value in (self.times, self.above_cd_m2)):
            raise StimulusError(f"a threshold needs finite numbers of at least 0, not {self}")
        if self.times == 0 and self.above_cd_m2 == 0:
            raise StimulusError("a threshold needs 'times' the background, 'above_cd_m2', or both")


@dataclass(frozen=True, eq=False, slots=True)
class Peaks:
    """The brightest pixel of each sparkle, shape (n,) each, in the order of rows.

    ``area_px`` counts the pixels above the threshold that hang together with it, and ``peaks_in_area`` the peaks among
    them: above 1, sparkles overlap and share the area. ``pixels_above`` were looked at twice, of all.
    """

    row: NDArray[np.int64]
    column: NDArray[np.int64]
    luminance_cd_m2: Floats
    background_cd_m2: Floats
    area_px: NDArray[np.int64]
    peaks_in_area: NDArray[np.int64]
    background: Background
    pixels_above: int

    def __len__(self) -> int:
        return len(self.row)


def find_peaks(luminance_cd_m2: Luminance, threshold: SparkleThreshold, *, window_px: int = 64) -> Peaks:
    """Return the peaks of a picture's luminance, float32 (rows, columns), in cd/m².

    Raises
    ------
    StimulusError
        If the picture is not two-dimensional or holds what is no number, or if half of it is above the threshold.
    """
    checked(luminance_cd_m2)
    if window_px < 4:
        raise StimulusError(f"windows need at least 4 px, not {window_px}")
    background = local_background(luminance_cd_m2, window_px)
    place = _above(luminance_cd_m2, background, threshold)
    peak = _is_peak(luminance_cd_m2, place)
    area = _areas(place, *luminance_cd_m2.shape)
    sizes = np.bincount(area, minlength=1)
    peaks = np.bincount(area[peak], minlength=len(sizes))
    row, column = np.divmod(place[peak], luminance_cd_m2.shape[1])
    return Peaks(
        row,
        column,
        luminance_cd_m2[row, column].astype(np.float64),
        background.at(row.astype(np.float64), column.astype(np.float64)),
        sizes[area[peak]],
        peaks[area[peak]],
        background,
        len(place),
    )


def checked(luminance_cd_m2: Luminance) -> None:
    """Raise StimulusError if this is no picture's luminance: not (rows, columns), or with what is no number."""
    if luminance_cd_m2.ndim != 2 or min(luminance_cd_m2.shape) < 8:
        raise StimulusError(f"luminance has shape {luminance_cd_m2.shape}; expected (rows, columns) of at least 8 each")
    strange = sum(
        int((~np.isfinite(luminance_cd_m2[first : first + _ROWS])).sum())
        for first in range(0, len(luminance_cd_m2), _ROWS)
    )
    if strange:
        raise StimulusError(f"the luminance of {counted(strange, 'pixel', 'pixels')} is NaN or infinite")


def _above(luminance: Luminance, background: Background, threshold: SparkleThreshold) -> NDArray[np.int64]:
    """Return the places, counted along the rows, of the pixels above the threshold, rising."""
    height, width = luminance.shape
    places = []
    for first in range(0, height, _ROWS):
        part = luminance[first : first + _ROWS]
        least = background.lines(first, first + len(part), width)
        least *= np.float32(threshold.times)
        np.maximum(least, np.float32(threshold.above_cd_m2), out=least)
        places.append(np.flatnonzero(part > least) + first * width)
    place = np.concatenate(places).astype(np.int64)
    if len(place) > _MOST_ABOVE * luminance.size:
        share = 100 * len(place) / luminance.size
        message = f"{share:.0f} % of the picture is above the threshold of its sparkles"
        raise StimulusError.of(message, "raise 'times' or 'above_cd_m2' above what lies between sparkles")
    return place


def _is_peak(luminance: Luminance, place: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which places have nothing brighter near them; of equals, the first is the peak."""
    peak = np.ones(len(place), dtype=np.bool_)
    if (compiled := loops("stimuli.sparkles.sparkle_loops", luminance.size)) is not None:
        compiled.is_peak(np.ascontiguousarray(luminance), place, peak)
        return peak
    height, width = luminance.shape
    row, column = np.divmod(place, width)
    light = luminance[row, column]
    for down, across in OFFSETS:
        # Only what may still be a peak is compared on.
        left = np.flatnonzero(peak)
        near_row = np.clip(row[left] + down, 0, height - 1)
        near_column = np.clip(column[left] + across, 0, width - 1)
        near = luminance[near_row, near_column]
        earlier = near_row * width + near_column < place[left]
        peak[left] = (near < light[left]) | ((near == light[left]) & ~earlier)
    return peak


def _areas(place: NDArray[np.int64], height: int, width: int) -> NDArray[np.int64]:
    """Return the number of the area that each place belongs to; places touch along sides and corners."""
    if (compiled := loops("stimuli.sparkles.sparkle_loops", height * width)) is not None:
        area = np.empty(len(place), dtype=np.int64)
        compiled.areas(place, width, area)
        return area
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    if len(place) == 0:
        return place
    column = place % width
    first, second = [], []
    for step, allowed in (
        (1, column < width - 1),
        (width - 1, column > 0),
        (width, np.ones(len(place), dtype=np.bool_)),
        (width + 1, column < width - 1),
    ):
        near = np.minimum(np.searchsorted(place, place + step), len(place) - 1)
        touch = np.flatnonzero(allowed & (place[near] == place + step))
        first.append(touch)
        second.append(near[touch])
    pairs = (np.concatenate(first), np.concatenate(second))
    graph = coo_array((np.ones(len(pairs[0]), dtype=np.int8), pairs), shape=(len(place), len(place)))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
