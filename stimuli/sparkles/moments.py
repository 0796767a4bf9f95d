"""Where a sparkle lies to a fraction of a pixel, how wide it is, and how much light it adds.

Adaptive moments [Bernstein2002]: a round Gaussian weight is moved and widened until it fits the light that it weighs.
For a Gaussian sparkle this is unbiased, as a centroid and a second moment over a fixed window are not, and noise far
from the peak does not count. The weight is never narrower than pixels can sample. Width is that on the pixels, which
includes the pixel's own: 1/12 px² of variance. Sparkles with others near them are fitted again without the light of
those.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats
from documents.compiled import loops
from stimuli.sparkles.background import Luminance
from stimuli.sparkles.find import Peaks

# Full width at half maximum of a Gaussian, in standard deviations.
FWHM_PER_SD = 2.0 * np.sqrt(2.0 * np.log(2.0))
REACH = 6  # px around a peak that are weighed
_BLOCK = 2048  # peaks at a time: few enough for the processor's cache
ROUNDS = 40
WIDEST = 2.5  # px: wider does not fit into the reach
# A narrower weight would fall between the pixels that it is to weigh.
LEAST_WEIGHT = 1.2
# How far, in px, a sparkle may lie from its brightest pixel: a neighbour draws farther.
FARTHEST = 1.0
# Variance, in px², of a pixel, which the moments hold, and the least that is left of a sparkle's own.
PIXEL_VARIANCE, LEAST_VARIANCE = 1 / 12, 0.01
# Sparkles this near take part in one another's light, and how often it is taken away and they are fitted again.
_NEIGHBOURS_PX = 9.0
_NEIGHBOUR_ROUNDS = 3
# How far, in px, a round may move or widen the weight of a sparkle that has come to rest; more where it is fitted again
# from there.
_REST_PX = 1e-4
_ROUGH_REST_PX = 1e-2


@dataclass(frozen=True, eq=False, slots=True)
class Moments:
    """Shape (n,) each: position in px (pixel centres are whole numbers), width, and light above the background.

    ``sd_px`` is the standard deviation of a round Gaussian; ``flux_cd_m2_px`` its light, luminance times pixels. Where
    no Gaussian fits (``fits`` False), position is the top of a parabola through the brightest pixel and its neighbours,
    and width and light are NaN.
    """

    row_px: Floats
    column_px: Floats
    sd_px: Floats
    flux_cd_m2_px: Floats
    fits: NDArray[np.bool_]


def sparkle_moments(luminance_cd_m2: Luminance, peaks: Peaks) -> Moments:
    """Return the adaptive moments about ``peaks`` of the luminance, float32 (rows, columns), in which they were found.

    What reaches beyond the picture is left out of both the light and the weight's own moments, so that the background
    subtracted there is none.
    """
    everyone, neighbours = np.arange(len(peaks)), _neighbours(peaks)
    fitted, fits = np.zeros((4, len(peaks))), np.zeros(len(peaks), dtype=np.bool_)
    fitted[2] = 1.0
    rest_px = np.full(len(peaks), _REST_PX)
    rest_px[neighbours.of] = _ROUGH_REST_PX
    _fit_in_place(luminance_cd_m2, peaks, _Neighbours.none(everyone), fitted, rest_px, fitted, fits)
    for done in range(_NEIGHBOUR_ROUNDS):
        rest_px[:] = _REST_PX if done == _NEIGHBOUR_ROUNDS - 1 else _ROUGH_REST_PX
        around = _around(peaks, fitted, fits)
        unfit = neighbours.of[~fits[neighbours.of]]
        fitted[:3, unfit] = np.array([0.0, 0.0, 1.0])[:, None]
        _fit_in_place(luminance_cd_m2, peaks, neighbours, around, rest_px, fitted, fits)
    return Moments(fitted[0] + peaks.row, fitted[1] + peaks.column, fitted[2], fitted[3], fits)


@dataclass(frozen=True, eq=False, slots=True)
class _Neighbours:
    """The sparkles ``of`` (n,) that have others near: ``others`` from ``first`` (n,), ``counts`` (n,) of them."""

    of: NDArray[np.int64]
    first: NDArray[np.int64]
    counts: NDArray[np.int64]
    others: NDArray[np.int64]

    @classmethod
    def none(cls, of: NDArray[np.int64]) -> _Neighbours:
        """Return sparkles that have no others near."""
        nothing = np.zeros(len(of), dtype=np.int64)
        return cls(of, nothing, nothing, nothing[:0])


def _neighbours(peaks: Peaks) -> _Neighbours:
    from scipy.spatial import cKDTree

    places = np.stack([peaks.row, peaks.column], axis=1)
    pairs = np.empty((0, 2), dtype=np.int64)
    if len(peaks) > 1:
        pairs = cKDTree(places).query_pairs(_NEIGHBOURS_PX, output_type="ndarray").astype(np.int64)
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    of, first, counts = np.unique(pairs[:, 0], return_index=True, return_counts=True)
    return _Neighbours(of, first, counts, pairs[:, 1].copy())


def _parts(count: int) -> Iterator[slice]:
    yield from (slice(start, min(start + _BLOCK, count)) for start in range(0, count, _BLOCK))


def _around(peaks: Peaks, fitted: Floats, fits: NDArray[np.bool_]) -> Floats:
    """Return row, column, width and light of sparkles, (4, n), as their neighbours see them."""
    # What fits no Gaussian has, for its neighbours, the usual width.
    usual = float(np.median(fitted[2, fits])) if fits.any() else 1.0
    excess = peaks.luminance_cd_m2 - peaks.background_cd_m2
    sd = np.where(fits, fitted[2], usual)
    flux = np.where(fits, fitted[3], 2 * np.pi * (usual**2 + PIXEL_VARIANCE) * excess)
    return np.stack([fitted[0] + peaks.row, fitted[1] + peaks.column, sd, flux])


def _fit_in_place(
    luminance: Luminance,
    peaks: Peaks,
    neighbours: _Neighbours,
    around: Floats,
    rest_px: Floats,
    fitted: Floats,
    fits: NDArray[np.bool_],
) -> None:
    """Fit sparkles, from where they are in ``fitted`` (4, n), in place, without the light of their neighbours.

    Places there are offsets from the peaks; the neighbours are as ``around`` says.
    """
    compiled = loops("stimuli.sparkles.sparkle_loops", luminance.size)
    if compiled is not None:
        places = (np.ascontiguousarray(luminance), peaks.row, peaks.column, peaks.background_cd_m2)
        compiled.fit(
            *places,
            neighbours.of,
            rest_px,
            neighbours.first,
            neighbours.counts,
            neighbours.others,
            around,
            fitted,
            fits,
        )
        return
    for part in _parts(len(neighbours.of)):
        # Those with most neighbours first: who has a k-th one stands before all who have none.
        order = part.start + np.argsort(-neighbours.counts[part], kind="stable")
        here, counts, first = neighbours.of[order], neighbours.counts[order], neighbours.first[order]
        light = _light(luminance, peaks, here)
        for k in range(counts[0]):
            few = int(np.searchsorted(-counts, -k))
            _take_away(light[:, :, :few], neighbours.others[first[:few] + k], here[:few], peaks, around)
        down, across, sd = fitted[:3, here]
        fitted[:, here], fits[here] = _fit(light, down, across, sd, rest_px[here])


def _take_away(
    light: Luminance,
    other: NDArray[np.int64],
    mine: NDArray[np.int64],
    peaks: Peaks,
    around: Floats,
) -> None:
    """Take from the light (k, k, n) around sparkles ``mine``, in place, the Gaussian of one other for each."""
    from scipy.special import ndtr

    row, column, sd, flux = around
    edges = np.arange(-REACH, REACH + 2)[:, None] - 0.5
    # Integrated over each pixel, whose own width the moments hold.
    width = np.sqrt(np.maximum(sd[other] ** 2 - PIXEL_VARIANCE, LEAST_VARIANCE))
    down = np.diff(ndtr((edges + (peaks.row[mine] - row[other])) / width), axis=0)
    across = np.diff(ndtr((edges + (peaks.column[mine] - column[other])) / width), axis=0)
    down, across = (down * flux[other]).astype(np.float32), across.astype(np.float32)
    for i in range(len(down)):
        light[i] -= down[i] * across


def patches(luminance_cd_m2: Luminance, row: NDArray[np.int64], column: NDArray[np.int64], reach: int) -> Luminance:
    """Return the luminance around places, shape (n, 2·reach + 1, 2·reach + 1); NaN beyond the picture."""
    height, width = luminance_cd_m2.shape
    side = 2 * reach + 1
    light = np.empty((len(row), side, side), np.float32)
    within = (row >= reach) & (row < height - reach) & (column >= reach) & (column < width - reach)
    if within.any():
        windows = np.lib.stride_tricks.sliding_window_view(luminance_cd_m2, (side, side))
        light[within] = windows[row[within] - reach, column[within] - reach]
    edge = np.flatnonzero(~within)
    offsets = np.arange(-reach, reach + 1)
    rows, columns = (row[edge, None] + offsets)[:, :, None], (column[edge, None] + offsets)[:, None, :]
    near = luminance_cd_m2[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)]
    near[np.broadcast_to((rows < 0) | (rows >= height) | (columns < 0) | (columns >= width), near.shape)] = np.nan
    light[edge] = near
    return light


def _light(luminance: Luminance, peaks: Peaks, part: NDArray[np.int64]) -> Luminance:
    """Return the light above the background around peaks, shape (k, k, n); 0 beyond the picture.

    Peaks lie along the last axis, so that sums over a patch are sums of vectors.
    """
    near = patches(luminance, peaks.row[part], peaks.column[part], REACH)
    light = np.subtract(near.transpose(1, 2, 0), peaks.background_cd_m2[part].astype(np.float32), order="C")
    light[np.isnan(light)] = 0.0
    return light


def _fit(
    light: Luminance, down_px: Floats, across_px: Floats, sd_px: Floats, rest_px: Floats
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return offsets down and across from the middle, width and light, (4, n), of patches (k, k, n), and which fit.

    The fit begins at the offsets and width given, (n,) each, and ends where a round changes them by less than
    ``rest_px`` (n,). Sums over a patch are in single precision, as its light is: they err by a millionth.
    """
    offsets = np.arange(-REACH, REACH + 1.0)[:, None]
    n = light.shape[2]
    down, across, sd, flux = down_px.copy(), across_px.copy(), sd_px.copy(), np.zeros(n)
    fits = np.zeros(n, dtype=np.bool_)
    moving, weighed = np.arange(n), light
    for _ in range(ROUNDS):
        vertical = (offsets - down[moving]).astype(np.float32)
        horizontal = (offsets - across[moving]).astype(np.float32)
        variance = np.maximum(sd[moving], LEAST_WEIGHT) ** 2
        steepness = (-0.5 / variance).astype(np.float32)
        along = np.exp(vertical**2 * steepness)
        beside = np.exp(horizontal**2 * steepness)
        # Separable: first over the rows of each patch, then over its columns.
        by_column = np.einsum("ijn,in->jn", weighed, along)
        along *= vertical
        first_down = np.einsum("jn,jn->n", np.einsum("ijn,in->jn", weighed, along), beside)
        along *= vertical
        second = np.einsum("jn,jn->n", np.einsum("ijn,in->jn", weighed, along), beside)
        by_column *= beside
        total = by_column.sum(axis=0)
        by_column *= horizontal
        first_across = by_column.sum(axis=0)
        by_column *= horizontal
        second += by_column.sum(axis=0)
        total, second, first_down, first_across = (
            one.astype(np.float64) for one in (total, second, first_down, first_across)
        )
        good = total > 0
        safe = np.where(good, total, 1.0)
        middle_down, middle_across = first_down / safe, first_across / safe
        spread = np.maximum(second / (2 * safe) - 0.5 * (middle_down**2 + middle_across**2), 0.0)
        # Two Gaussians multiply to one of variance 1 / (1/σ² + 1/weight²): what is left without the weight is σ².
        bare = spread * variance / np.maximum(variance - spread, 0.25 * variance)
        new_sd = np.sqrt(np.where(good, bare, sd[moving] ** 2))
        # And its middle lies short of the light's by the same shares.
        share = 1.0 + bare / variance
        step_down = np.where(good, middle_down * share, 0.0)
        step_across = np.where(good, middle_across * share, 0.0)
        down[moving] += step_down
        across[moving] += step_across
        moved = np.abs(step_down) + np.abs(step_across) + np.abs(new_sd - sd[moving])
        sd[moving] = new_sd
        flux[moving] = total * share
        near = good & (np.hypot(down[moving], across[moving]) < FARTHEST) & (new_sd < WIDEST)
        at_rest = near & (moved < rest_px[moving])
        fits[moving[at_rest]] = True
        left = np.flatnonzero(near & ~at_rest)
        if len(left) == 0:
            break
        if len(left) < len(moving):
            moving, weighed = moving[left], weighed.take(left, axis=2)
    unfit = ~fits
    down[unfit], across[unfit] = _vertices(light[:, :, unfit])
    sd[unfit] = flux[unfit] = np.nan
    return np.stack([down, across, sd, flux]), fits


def _vertices(light: Luminance) -> tuple[Floats, Floats]:
    """Return where parabolas through the middle pixels of patches (k, k, n) are highest, from the middle, (n,) each."""
    middle = light[REACH, REACH]
    tops = []
    for before, after in (
        (light[REACH - 1, REACH], light[REACH + 1, REACH]),
        (light[REACH, REACH - 1], light[REACH, REACH + 1]),
    ):
        bend = 2 * (2 * middle - before - after)
        top = np.divide(after - before, bend, out=np.zeros_like(bend), where=bend > 0)
        tops.append(np.clip(top, -0.5, 0.5))
    return tops[0], tops[1]
