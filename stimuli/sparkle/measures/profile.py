"""How far a sparkle's light spreads over its neighbourhood: the mean profile of Figure 4.3 of the thesis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stimuli.sparkle.measures.background import Floats, Luminance
from stimuli.sparkle.measures.find import Peaks
from stimuli.sparkle.measures.moments import Moments, patches

# "An 8-pixel neighborhood around a sparkle point".
REACH_PX = 8
_BIN_PX = 0.5
_BLOCK = 2048


@dataclass(frozen=True, eq=False, slots=True)
class Profile:
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


def radial_profile(luminance_cd_m2: Luminance, peaks: Peaks, moments: Moments) -> Profile:
    """Return the mean profile of the sparkles that overlap with no other and lie wholly in the picture."""
    height, width = luminance_cd_m2.shape
    inside = np.minimum(moments.row_px, moments.column_px) >= REACH_PX
    inside &= (moments.row_px <= height - 1 - REACH_PX) & (moments.column_px <= width - 1 - REACH_PX)
    chosen = np.flatnonzero(inside & moments.fits & (peaks.peaks_in_area == 1))
    rings = round(REACH_PX / _BIN_PX)
    offsets = np.arange(-REACH_PX - 1, REACH_PX + 2)
    number, radii = np.zeros(rings), np.zeros(rings)
    means = []
    for start in range(0, len(chosen), _BLOCK):
        part = chosen[start : start + _BLOCK]
        row = np.round(moments.row_px[part]).astype(np.int64)
        column = np.round(moments.column_px[part]).astype(np.int64)
        light = np.nan_to_num(patches(luminance_cd_m2, row, column, REACH_PX + 1), nan=0.0)
        light -= peaks.background_cd_m2[part].astype(np.float32)[:, None, None]
        down = ((row - moments.row_px[part])[:, None] + offsets).astype(np.float32)
        across = ((column - moments.column_px[part])[:, None] + offsets).astype(np.float32)
        radius = np.sqrt((down**2)[:, :, None] + (across**2)[:, None, :])
        ring = np.minimum((radius * np.float32(1 / _BIN_PX)).astype(np.int64), rings)
        key = (ring + (rings + 1) * np.arange(len(part))[:, None, None]).ravel()
        size = len(part) * (rings + 1)
        counts = np.bincount(key, minlength=size).reshape(-1, rings + 1)[:, :rings]
        sums = np.bincount(key, light.ravel(), minlength=size).reshape(-1, rings + 1)[:, :rings]
        # A sparkle's scale is its light within 1 px, where it is brightest and noise counts least.
        scale = sums[:, :2].sum(axis=1) / np.maximum(counts[:, :2].sum(axis=1), 1)
        scaled = np.divide(sums, counts, out=np.full(sums.shape, np.nan), where=counts > 0)
        means.append(scaled / scale[:, None])
        number += counts.sum(axis=0)
        radii += np.bincount(ring.ravel(), radius.ravel(), minlength=rings + 1)[:rings]
    if not means:
        nothing = np.full(rings, np.nan)
        middles = np.asarray(_BIN_PX * (np.arange(rings) + 0.5), dtype=np.float64)
        return Profile(middles, nothing, nothing, 0, np.nan, np.nan)
    return _mean(np.concatenate(means), radii / np.maximum(number, 1))


def _mean(each: Floats, radius_px: Floats) -> Profile:
    """Return the mean of profiles (n, k), scaled so that it is 1 at radius 0."""
    finite = np.isfinite(each)
    n = finite.sum(axis=0)
    share = np.where(finite, each, 0.0).sum(axis=0) / np.maximum(n, 1)
    scatter = np.where(finite, (each - share) ** 2, 0.0).sum(axis=0) / np.maximum(n - 1, 1)
    se = np.where(n > 1, np.sqrt(scatter / np.maximum(n, 1)), np.nan)
    centre = _centre(radius_px, share)
    share, se = share / centre, se / centre
    share[n == 0] = np.nan
    half, half_se = _half_width(radius_px, share, se)
    return Profile(radius_px, share, se, len(each), half, half_se)


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
