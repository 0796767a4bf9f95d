"""Peaks, adaptive moments and rings of many sparkles, compiled: what `find`, `moments` and `profile` do in NumPy."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Flags, Floats, Floats32
from documents.compiled import loop
from stimuli.sparkles import find, moments, profile

Integers = NDArray[np.int64]

_REACH, _SIDE = moments.REACH, 2 * moments.REACH + 1
_ROUNDS, _WIDEST, _LEAST_WEIGHT, _FARTHEST = moments.ROUNDS, moments.WIDEST, moments.LEAST_WEIGHT, moments.FARTHEST
_PIXEL_VARIANCE, _LEAST_VARIANCE = moments.PIXEL_VARIANCE, moments.LEAST_VARIANCE
_ROOT_HALF = math.sqrt(0.5)
_NEAR = tuple(find.OFFSETS)
_RINGS, _PER_BIN, _RING_REACH = profile.RINGS, np.float32(1.0 / profile.BIN_PX), profile.REACH_PX + 1
# Beyond so many standard deviations, a Gaussian holds all its light, to the last place.
_ALL = 8.5


@loop(inline=True)
def _below(z: float) -> float:
    """Return the share of a Gaussian below ``z`` standard deviations."""
    if z > _ALL:
        return 1.0
    if z < -_ALL:
        return 0.0
    return 0.5 * math.erfc(-z * _ROOT_HALF)


@loop(inline=True)
def _gaussian(steepness: float, start: float, weight: Floats) -> None:
    """Write exp(steepness · x²) for x from ``start`` on in steps of 1: each value from the one before."""
    value, ratio = math.exp(steepness * start * start), math.exp(steepness * (2.0 * start + 1.0))
    bend = math.exp(2.0 * steepness)
    for i in range(len(weight)):
        weight[i] = value
        value *= ratio
        ratio *= bend


@loop(inline=True)
def _top(before: float, middle: float, after: float) -> float:
    """Return where a parabola through three pixels is highest, from the middle one."""
    bend = 2.0 * (2.0 * middle - before - after)
    return min(max((after - before) / bend, -0.5), 0.5) if bend > 0.0 else 0.0


@loop(
    "void(float32[:, ::1], int64[::1], int64[::1], float64[::1], int64[::1], float64[::1], int64[::1], int64[::1],"
    " int64[::1], float64[:, ::1], float64[:, ::1], boolean[::1])"
)
def fit(
    luminance: Floats32,
    row: Integers,
    column: Integers,
    background: Floats,
    here: Integers,
    rest: Floats,
    first: Integers,
    counts: Integers,
    others: Integers,
    around: Floats,
    fitted: Floats,
    fits: Flags,
) -> None:
    """Fit the sparkles ``here`` from where ``fitted`` (4, n) has them, in place, and write which of them ``fits``.

    Places are offsets from the peaks at ``row`` and ``column``. Of each sparkle's light that of ``counts`` others is
    taken, which are listed in ``others`` from ``first`` on, and are as ``around`` (4, n) says: row, column, standard
    deviation and flux.
    """
    height, width = luminance.shape
    light = np.zeros((_SIDE, _SIDE))
    along, beside, by_column = np.zeros(_SIDE), np.zeros(_SIDE), np.zeros(_SIDE)
    by_column_down = np.zeros(_SIDE)
    by_column_second = np.zeros(_SIDE)
    for k in range(len(here)):
        peak = here[k]
        top, left = row[peak] - _REACH, column[peak] - _REACH
        for i in range(_SIDE):
            for j in range(_SIDE):
                y, x = top + i, left + j
                inside = 0 <= y < height and 0 <= x < width
                light[i, j] = luminance[y, x] - np.float32(background[peak]) if inside else 0.0
        for m in range(first[k], first[k] + counts[k]):
            other = others[m]
            per_width = 1.0 / math.sqrt(max(around[2, other] ** 2 - _PIXEL_VARIANCE, _LEAST_VARIANCE))
            down, across = top - 0.5 - around[0, other], left - 0.5 - around[1, other]
            before_y, before_x = _below(down * per_width), _below(across * per_width)
            for i in range(_SIDE):
                y, x = _below((down + i + 1) * per_width), _below((across + i + 1) * per_width)
                along[i], beside[i] = (y - before_y) * around[3, other], x - before_x
                before_y, before_x = y, x
            for i in range(_SIDE):
                if along[i] != 0.0:
                    for j in range(_SIDE):
                        light[i, j] -= along[i] * beside[j]
        down, across, sd, flux = fitted[0, peak], fitted[1, peak], fitted[2, peak], 0.0
        found = False
        for _ in range(_ROUNDS):
            variance = max(sd, _LEAST_WEIGHT) ** 2
            _gaussian(-0.5 / variance, -_REACH - down, along)
            _gaussian(-0.5 / variance, -_REACH - across, beside)
            by_column[:] = 0.0
            by_column_down[:] = 0.0
            by_column_second[:] = 0.0
            for i in range(_SIDE):
                y = i - _REACH - down
                weight, weight_down, weight_second = along[i], along[i] * y, along[i] * y * y
                for j in range(_SIDE):
                    here_light = light[i, j]
                    by_column[j] += weight * here_light
                    by_column_down[j] += weight_down * here_light
                    by_column_second[j] += weight_second * here_light
            total = first_down = first_across = second = 0.0
            for j in range(_SIDE):
                x = j - _REACH - across
                one = by_column[j] * beside[j]
                total += one
                first_across += one * x
                first_down += by_column_down[j] * beside[j]
                second += one * x * x + by_column_second[j] * beside[j]
            if not total > 0.0:
                break
            middle_down, middle_across = first_down / total, first_across / total
            spread = max(second / (2.0 * total) - 0.5 * (middle_down**2 + middle_across**2), 0.0)
            bare = spread * variance / max(variance - spread, 0.25 * variance)
            new_sd, share = math.sqrt(bare), 1.0 + bare / variance
            down += middle_down * share
            across += middle_across * share
            moved = abs(middle_down * share) + abs(middle_across * share) + abs(new_sd - sd)
            sd, flux = new_sd, total * share
            if not (math.hypot(down, across) < _FARTHEST and new_sd < _WIDEST):
                break
            if moved < rest[peak]:
                found = True
                break
        fits[peak] = found
        if not found:
            sd = flux = np.nan
            down = _top(light[_REACH - 1, _REACH], light[_REACH, _REACH], light[_REACH + 1, _REACH])
            across = _top(light[_REACH, _REACH - 1], light[_REACH, _REACH], light[_REACH, _REACH + 1])
        fitted[0, peak], fitted[1, peak], fitted[2, peak], fitted[3, peak] = down, across, sd, flux


@loop("void(float32[:, ::1], int64[::1], boolean[::1])")
def is_peak(luminance: Floats32, place: Integers, peak: Flags) -> None:
    """Write which places, counted along the rows, have nothing brighter near them; of equals, the first is the peak."""
    height, width = luminance.shape
    for k in range(len(place)):
        row, column = place[k] // width, place[k] % width
        light, highest = luminance[row, column], True
        for down, across in _NEAR:
            near_row, near_column = min(max(row + down, 0), height - 1), min(max(column + across, 0), width - 1)
            near = luminance[near_row, near_column]
            if near > light or (near == light and near_row * width + near_column < place[k]):
                highest = False
                break
        peak[k] = highest


@loop(inline=True)
def _join(area: Integers, one: int, other: int) -> None:
    """Let two places hang on the earlier of their roots."""
    while area[one] != one:
        area[one] = area[area[one]]
        one = area[one]
    while area[other] != other:
        area[other] = area[area[other]]
        other = area[other]
    area[max(one, other)] = min(one, other)


@loop("void(int64[::1], int64, int64[::1])")
def areas(place: Integers, width: int, area: Integers) -> None:
    """Write the number of the area that each place, of rising ones, belongs to; they touch at sides and corners."""
    n = len(place)
    for k in range(n):
        area[k] = k
    above = 0  # the first place of the row above that may touch
    for k in range(n):
        column = place[k] % width
        if k and place[k - 1] == place[k] - 1 and column > 0:
            _join(area, k, k - 1)
        while place[above] < place[k] - width - 1:
            above += 1
        other = above
        while other < k and place[other] <= place[k] - width + 1:
            if abs(place[other] % width - column) <= 1:
                _join(area, k, other)
            other += 1
    number = 0
    for k in range(n):
        # A root comes before all that hang on it, and has its number by then.
        if area[k] == k:
            area[k] = number
            number += 1
        else:
            area[k] = area[area[k]]


@loop("void(float32[:, ::1], float64[::1], float64[::1], float64[::1], float64[:, ::1], float64[::1], float64[::1])")
def rings(
    luminance: Floats32,
    row: Floats,
    column: Floats,
    background: Floats,
    mean: Floats,
    number: Floats,
    radii: Floats,
) -> None:
    """Write the ``mean`` light (n, rings) in rings around places, as a share of that within 1 px; add up the rest.

    ``number`` (rings,) is how many pixels there are in each ring of all, ``radii`` (rings,) the sum of their radii.
    """
    counts, sums = np.zeros(_RINGS), np.zeros(_RINGS)
    for k in range(len(row)):
        middle_row, middle_column = int(np.rint(row[k])), int(np.rint(column[k]))
        counts[:] = 0.0
        sums[:] = 0.0
        for i in range(-_RING_REACH, _RING_REACH + 1):
            down = np.float32(middle_row - row[k] + i)
            for j in range(-_RING_REACH, _RING_REACH + 1):
                across = np.float32(middle_column - column[k] + j)
                radius = np.sqrt(down * down + across * across)
                ring = int(radius * _PER_BIN)
                if ring < _RINGS:
                    counts[ring] += 1.0
                    sums[ring] += luminance[middle_row + i, middle_column + j] - np.float32(background[k])
                    radii[ring] += radius
        scale = (sums[0] + sums[1]) / max(counts[0] + counts[1], 1.0)
        for ring in range(_RINGS):
            mean[k, ring] = sums[ring] / counts[ring] / scale if counts[ring] > 0.0 else np.nan
            number[ring] += counts[ring]
