"""A shift to a small part of a pixel, by least squares (Gauss and Newton).

Both textures are moved half of the shift towards one another, so that both lose the same sharpness and the outcome
changes its sign, and nothing else, when they are swapped. What is minimised is the difference of the two, each divided
by its own root mean square, with a free gain and offset: other luminance does no harm. A Gaussian blur of 0.8 pixels
goes before, because sparkles hold detail beyond what pixels can carry, which moves a plain fit towards whole pixels by
up to 0.025; with the blur the error is below 0.01.

The standard error is that of the sandwich [White1982] with squares of pixels as clusters, since neighbouring pixels
err together.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats, Floats32
from stimuli.align.interpolate import LOBES, weights

BLUR_SD_PX = 0.8
MARGIN_PX = LOBES + 5
MOST_PIXELS = 2**22
MOST_STEPS = 20
_ENOUGH_PX = 1e-4
_BAND_ROWS = 128
_Pair: TypeAlias = tuple[float, float]


@dataclass(frozen=True, slots=True)
class ShiftFit:
    """A shift across and down in pixels, its standard errors, and the textures' correlation at it (0 where none).

    ``converged`` is false where the steps did not end or led away from where they began.
    """

    shift_px: _Pair
    standard_error_px: _Pair
    correlation: float
    steps: int
    converged: bool


def refine(reference: Floats32, moving: Floats32, start_px: _Pair, most_pixels: int = MOST_PIXELS) -> ShiftFit:
    """Return the shift of ``moving`` against ``reference``, textures (height, width), near ``start_px``.

    Of pictures larger than ``most_pixels``, bands of rows spread evenly over the height stand for the whole.
    """
    whole = (int(np.round(start_px[0])), int(np.round(start_px[1])))
    height, width = reference.shape
    left, right = max(0, -whole[0]), min(width, width - whole[0])
    top, bottom = max(0, -whole[1]), min(height, height - whole[1])
    if min(right - left, bottom - top) <= 2 * MARGIN_PX + 4:
        return ShiftFit(start_px, (np.inf, np.inf), 0.0, 0, False)
    fixed = reference[top:bottom, left:right]
    shifted = moving[top + whole[1] : bottom + whole[1], left + whole[0] : right + whole[0]]
    fraction = np.array(start_px) - whole
    bands = _bands(fixed.shape, most_pixels)
    for step in range(1, MOST_STEPS + 1):
        sums = _FitSums.over(fixed, shifted, fraction, bands)
        if sums is None or np.linalg.cond(sums.hessian) > 1e12:
            return ShiftFit(start_px, (np.inf, np.inf), 0.0, step, False)
        move = np.linalg.solve(sums.hessian, sums.gradient)[:2]
        longest = float(np.abs(move).max())
        fraction = fraction + move * min(1.0, 0.7 / max(longest, 1e-12))
        ended = longest < _ENOUGH_PX
        if ended or np.abs(fraction).max() > 2.0:
            break
    assert sums is not None
    error = sums.standard_error()
    inside = bool(np.abs(fraction - (np.array(start_px) - whole)).max() <= 1.5)
    shift = (float(whole[0] + fraction[0]), float(whole[1] + fraction[1]))
    return ShiftFit(shift, (float(error[0]), float(error[1])), sums.correlation, step, ended and inside)


@dataclass(frozen=True, slots=True)
class _FitSums:
    """The normal equations of one step: shift across and down, gain, offset."""

    hessian: Floats
    gradient: Floats
    scores: Floats
    correlation: float

    @classmethod
    def over(
        cls, reference: Floats32, moving: Floats32, fraction: Floats, bands: tuple[tuple[int, int], ...]
    ) -> _FitSums | None:
        taps = [_blurred(weights(float(component) / 2)) for component in fraction]
        back = [one[::-1] for one in taps]
        moved = [(_half(reference[a:b], back), _half(moving[a:b], taps)) for a, b in bands]
        sizes = [float(np.sqrt(sum(np.vdot(pair[i][0], pair[i][0]) for pair in moved))) for i in (0, 1)]
        if not all(np.isfinite(size) and size > 0 for size in sizes):
            return None
        hessian, gradient = np.zeros((4, 4)), np.zeros(4)
        scores: list[Floats] = []
        together = 0.0
        for (a, across_a, down_a), (b, across_b, down_b) in moved:
            residual = a / sizes[0] - b / sizes[1]
            slopes = [(p / sizes[0] + q / sizes[1]) / 2 for p, q in ((across_a, across_b), (down_a, down_b), (a, b))]
            rows = np.stack([*slopes, np.full_like(residual, 1.0 / np.sqrt(residual.size))])
            flat = rows.reshape(4, -1).astype(np.float64)
            hessian += flat @ flat.T
            gradient += flat @ residual.ravel()
            scores.append(_clusters(rows * residual))
            together += float(np.vdot(a, b)) / (sizes[0] * sizes[1])
        return cls(hessian, gradient, np.concatenate(scores), together)

    def standard_error(self) -> Floats:
        """Return standard errors (2,) of the shift."""
        inverse = np.linalg.inv(self.hessian)
        parts = len(self.scores)
        middle = self.scores.T @ self.scores * (parts / max(1, parts - 1))
        return np.asarray(np.sqrt(np.diag(inverse @ middle @ inverse))[:2])


def _half(plane: Floats32, taps: list[Floats]) -> tuple[Floats32, Floats32, Floats32]:
    """Return ``plane`` moved and blurred by weights across and down, without its margin, and its two slopes."""
    import cv2

    across, down = taps
    slope, still = np.array([-0.5, 0.0, 0.5]), np.ones(1)
    # OpenCV correlates as SciPy does, on float32 in a third to a tenth of the time.
    value, along, below = np.empty_like(plane), np.empty_like(plane), np.empty_like(plane)
    cv2.sepFilter2D(plane, cv2.CV_32F, across, down, dst=value, borderType=cv2.BORDER_REPLICATE)
    cv2.sepFilter2D(value, cv2.CV_32F, slope, still, dst=along, borderType=cv2.BORDER_REPLICATE)
    cv2.sepFilter2D(value, cv2.CV_32F, still, slope, dst=below, borderType=cv2.BORDER_REPLICATE)
    kept = (slice(MARGIN_PX, -MARGIN_PX), slice(MARGIN_PX, -MARGIN_PX))
    return value[kept], along[kept], below[kept]


def _blurred(taps: Floats) -> Floats:
    away = np.arange(-3, 4)
    blur = np.exp(-0.5 * (away / BLUR_SD_PX) ** 2)
    return np.convolve(taps, blur / blur.sum())


def _clusters(scores: NDArray[np.floating]) -> Floats:
    """Return sums (n, 4) over squares of ``scores`` (4, height, width): a sixth of the shorter side, 32 at most."""
    side = int(np.clip(min(scores.shape[1:]) // 6, 4, 32))
    rows, columns = (np.arange(0, length, side) for length in scores.shape[1:])
    summed = np.add.reduceat(np.add.reduceat(scores, rows, axis=1, dtype=np.float64), columns, axis=2)
    return np.asarray(summed.reshape(4, -1).T)


def _bands(shape: tuple[int, ...], most_pixels: int) -> tuple[tuple[int, int], ...]:
    height, width = shape
    if height * width <= most_pixels or height <= 2 * _BAND_ROWS:
        return ((0, height),)
    count = max(2, most_pixels // (_BAND_ROWS * width))
    starts = np.unique(np.linspace(0, height - _BAND_ROWS, count).astype(int))
    return tuple((int(start), int(start) + _BAND_ROWS) for start in starts)
