"""The camera's values of each patch: the trimmed mean of its inner part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.chart import COLORCHECKER, ChartLayout, patch_quadrangles
from documents import Finding
from documents.arrays import Floats
from stimuli.errors import StimulusError

Bools = NDArray[np.bool_]
Picture = NDArray[np.floating[Any]]

INNER = 0.5
_TRIMMED = 0.1
# The standard deviation of a normal distribution without its outer tenths.
_NORMAL = 0.6616
_LEAST_PX = 9
# More saturated pixels than this in a patch, and its mean is of clipped light.
_MOST_SATURATED = 0.001


@dataclass(frozen=True, slots=True, eq=False)
class PatchValues:
    """Of each patch: mean ``rgb`` (n, 3), ``spread`` (n, 3), its pixels' standard deviation, and ``pixels`` (n,).

    Both leave out the highest and the lowest tenth of the pixels; the spread is scaled to what it is of normal noise.
    ``saturated`` (n, 3) marks channels that clipped in more than a thousandth of the patch's inner part.
    ``corners_px`` (4, 2) is where the chart was taken to lie.
    """

    rgb: Floats
    spread: Floats
    saturated: Bools
    pixels: NDArray[np.intp]
    corners_px: Floats


def sample_patches(
    rgb: Picture,
    saturated: Bools,
    corners_px: Floats,
    layout: ChartLayout = COLORCHECKER,
    *,
    inner: float = INNER,
    file: str | None = None,
) -> PatchValues:
    """Return the values of the patches between four corners, row by row from the first corner towards the second.

    ``rgb`` and ``saturated`` are (height, width, 3); ``inner`` is the side of what counts, as a share of the patch's.

    Raises
    ------
    StimulusError
        If a patch's inner part holds fewer than nine pixels, or values that are no finite numbers.
    """
    quadrangles = patch_quadrangles(corners_px, layout, inner)
    means, spreads, clipped, counts = [], [], [], []
    for number, quadrangle in enumerate(quadrangles):
        inside, window = _inside(quadrangle, rgb.shape)
        values = rgb[window][inside].astype(np.float64)
        if len(values) < _LEAST_PX:
            raise StimulusError(
                Finding(
                    f"patch {number + 1} of the chart holds {len(values)} pixels",
                    file,
                    remedy="photograph the chart larger, or give its corners",
                )
            )
        if not np.all(np.isfinite(values)):
            raise StimulusError(Finding(f"patch {number + 1} of the chart holds values that are no numbers", file))
        ordered = np.sort(values, axis=0)
        cut = int(_TRIMMED * len(values))
        kept = ordered[cut : len(ordered) - cut]
        means.append(kept.mean(axis=0))
        spreads.append(kept.std(axis=0, ddof=1) / (_NORMAL if cut else 1.0))
        clipped.append(saturated[window][inside].mean(axis=0) > _MOST_SATURATED)
        counts.append(len(values))
    return PatchValues(np.array(means), np.array(spreads), np.array(clipped), np.array(counts), corners_px)


def _inside(quadrangle: Floats, shape: tuple[int, ...]) -> tuple[Bools, tuple[slice, slice]]:
    """Return which pixel centres of a window lie inside a convex quadrangle (4, 2), and the window."""
    low = np.clip(np.floor(quadrangle.min(axis=0)).astype(int), 0, None)
    high = np.minimum(np.ceil(quadrangle.max(axis=0)).astype(int), [shape[1], shape[0]])
    x = np.arange(low[0], high[0]) + 0.5
    y = (np.arange(low[1], high[1]) + 0.5)[:, None]
    following = np.roll(quadrangle, -1, axis=0)
    across = [
        (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) for a, b in zip(quadrangle, following, strict=True)
    ]
    sides = np.array(across) if len(x) and len(y) else np.zeros((4, len(y), len(x)))
    inside = np.all(sides >= 0, axis=0) | np.all(sides <= 0, axis=0)
    return inside, (slice(low[1], max(low[1], high[1])), slice(low[0], max(low[0], high[0])))
