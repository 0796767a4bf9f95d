"""How far a sparkle's light spreads over its neighbourhood: the mean profile of Figure 4.3 of the thesis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from documents.arrays import Floats
from documents.compiled import loops
from stimuli.sparkles.background import Luminance
from stimuli.sparkles.find import Peaks
from stimuli.sparkles.moments import Moments, patches

# "An 8-pixel neighborhood around a sparkle point".
REACH_PX = 8
BIN_PX = 0.5
RINGS = round(REACH_PX / BIN_PX)
_BLOCK = 2048


@dataclass(frozen=True, eq=False, slots=True)
class RadialProfile:
    """Mean light above the background at radii from a sparkle's place, as a share of what it has there.

    ``radius_px`` (k,) are the mean radii of rings half a pixel wide, ``share`` (k,) the mean over ``sparkles`` and
    ``share_se`` (k,) its standard error: the scatter between sparkles over the root of their number. Each sparkle is
    first divided by its light within 1 px. ``half_width_px`` is where the mean falls to half of its centre, NaN where
    that is not known; ``half_width_se_px`` follows from the standard errors next to it.
    """

    radius_px: Floats
    share: Floats
    share_se: Floats
    sparkles: int
    half_width_px: float
    half_width_se_px: float


def radial_profile(luminance_cd_m2: Luminance, peaks: Peaks, moments: Moments) -> RadialProfile:
    """Return the mean profile of the sparkles that overlap with no other and lie wholly in the picture."""
    height, width = luminance_cd_m2.shape
    inside = np.minimum(moments.row_px, moments.column_px) >= REACH_PX
    inside &= (moments.row_px <= height - 1 - REACH_PX) & (moments.column_px <= width - 1 - REACH_PX)
    chosen = np.flatnonzero(inside & moments.fits & (peaks.peaks_in_area == 1))
    if len(chosen) == 0:
        nothing = np.full(RINGS, np.nan)
        middles = np.asarray(BIN_PX * (np.arange(RINGS) + 0.5), dtype=np.float64)
        return RadialProfile(middles, nothing, nothing, 0, np.nan, np.nan)
    places = moments.row_px[chosen], moments.column_px[chosen], peaks.background_cd_m2[chosen]
    means, number, radii = _rings(luminance_cd_m2, *places)
    return _mean(means, radii / np.maximum(number, 1))


def _rings(
    luminance: Luminance, row_px: Floats, column_px: Floats, background: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the mean light in rings around each place, (n, k), as a share of that within 1 px.

    And, (k,) each, how many pixels there are in each ring of all places, and the sum of their radii.
    """
    means, number, radii = np.empty((len(row_px), RINGS)), np.zeros(RINGS), np.zeros(RINGS)
    if (compiled := loops("stimuli.sparkles.sparkle_loops", luminance.size)) is not None:
        compiled.rings(np.ascontiguousarray(luminance), row_px, column_px, background, means, number, radii)
        return means, number, radii
    offsets = np.arange(-REACH_PX - 1, REACH_PX + 2)
    for start in range(0, len(row_px), _BLOCK):
        part = slice(start, start + _BLOCK)
        row = np.round(row_px[part]).astype(np.int64)
        column = np.round(column_px[part]).astype(np.int64)
        light = np.nan_to_num(patches(luminance, row, column, REACH_PX + 1), nan=0.0)
        light -= background[part].astype(np.float32)[:, None, None]
        down = ((row - row_px[part])[:, None] + offsets).astype(np.float32)
        across = ((column - column_px[part])[:, None] + offsets).astype(np.float32)
        radius = np.sqrt((down**2)[:, :, None] + (across**2)[:, None, :])
        ring = np.minimum((radius * np.float32(1 / BIN_PX)).astype(np.int64), RINGS)
        key = (ring + (RINGS + 1) * np.arange(len(row))[:, None, None]).ravel()
        size = len(row) * (RINGS + 1)
        counts = np.bincount(key, minlength=size).reshape(-1, RINGS + 1)[:, :RINGS]
        sums = np.bincount(key, light.ravel(), minlength=size).reshape(-1, RINGS + 1)[:, :RINGS]
        # A sparkle's scale is its light within 1 px, where it is brightest and noise counts least.
        scale = sums[:, :2].sum(axis=1) / np.maximum(counts[:, :2].sum(axis=1), 1)
        scaled = np.divide(sums, counts, out=np.full(sums.shape, np.nan), where=counts > 0)
        means[part] = scaled / scale[:, None]
        number += counts.sum(axis=0)
        radii += np.bincount(ring.ravel(), radius.ravel(), minlength=RINGS + 1)[:RINGS]
    return means, number, radii


def _mean(each: Floats, radius_px: Floats) -> RadialProfile:
    """Return the mean of profiles (n, k), scaled so that it is 1 at radius 0."""
    finite = np.isfinite(each)
    n = finite.sum(axis=0)
    share = np.where(finite, each, 0.0).sum(axis=0) / np.maximum(n, 1)
    scatter = np.where(finite, (each - share) ** 2, 0.0).sum(axis=0) / np.maximum(n - 1, 1)
    se = np.where(n > 1, np.sqrt(scatter / np.maximum(n, 1)), np.nan)
    # One sparkle alone has no pixel in some rings.
    known = n > 0
    centre = _centre(radius_px[known], share[known])
    share, se = (share / centre, se / centre) if centre > 0 else (np.full(len(n), np.nan), np.full(len(n), np.nan))
    share[~known] = np.nan
    half, half_se = _half_width(radius_px[known], share[known], se[known])
    return RadialProfile(radius_px, share, se, len(each), half, half_se)


def _centre(radius_px: Floats, share: Floats) -> float:
    """Return the profile's value at radius 0: the top is a parabola in the logarithm, as a Gaussian's is."""
    if share[0] > share[1] > 0 and radius_px[1] > radius_px[0]:
        slope = np.log(share[1] / share[0]) / (radius_px[1] ** 2 - radius_px[0] ** 2)
        return float(share[0] * np.exp(-slope * radius_px[0] ** 2))
    return float(share[0])


def _half_width(radius_px: Floats, share: Floats, se: Floats) -> tuple[float, float]:
    below = np.flatnonzero(share < 0.5)
    if len(below) == 0 or below[0] == 0:
        return np.nan, np.nan
    after = below[0]
    r = radius_px[after - 1 : after + 1] ** 2
    values = share[after - 1 : after + 1]
    if values[1] > 0:
        # Straight between rings in logarithm over squared radius, which is exact for a Gaussian.
        level, ends = np.log(0.5), np.log(values)
    else:
        level, ends = 0.5, values
    slope = (ends[1] - ends[0]) / (r[1] - r[0])
    half = float(np.sqrt(r[0] + (level - ends[0]) / slope))
    steepness = abs(values[1] - values[0]) / (np.sqrt(r[1]) - np.sqrt(r[0]))
    return half, float(np.max(se[after - 1 : after + 1]) / steepness)
