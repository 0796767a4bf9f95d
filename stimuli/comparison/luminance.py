"""The factor between the luminances of a photograph and of its rendering, thesis Section 5.5 (Figures 5.9 and 5.10).

Scaling does not change Pearson's correlation; what it changes is how far the pairs lie from equality: the root mean
square of what is left, and R² about the line of equality, 1 − Σ(photo − factor · rendering)² / Σ(photo − mean)².
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from documents.text import JsonResult
from stimuli.errors import StimulusError


@dataclass(frozen=True, slots=True)
class LuminanceFactor(JsonResult):
    """The factor by which a rendering's luminance is multiplied to match its photograph, from ``regions`` areas.

    ``mean_ratio`` is the mean of photo / rendering (the thesis's), ``least_squares`` minimises the squares of what is
    left. Their standard errors come from the scatter between regions. ``rms`` is in cd/m², ``r2`` about equality; both
    are given as rendered, by the mean ratio and by least squares. None where there are too few regions, or no scatter.
    """

    regions: int
    mean_ratio: float
    mean_ratio_se: float | None
    least_squares: float
    least_squares_se: float | None
    pearson: float | None
    rms_as_rendered: float
    rms_mean_ratio: float
    rms_least_squares: float
    r2_as_rendered: float | None
    r2_mean_ratio: float | None
    r2_least_squares: float | None

    def of(self, mode: Literal["mean_ratio", "least_squares"]) -> float:
        """Return one of the two."""
        return self.mean_ratio if mode == "mean_ratio" else self.least_squares


def luminance_factor(photo_cd_m2: ArrayLike, rendering_cd_m2: ArrayLike) -> LuminanceFactor:
    """Return the factor between luminances (n,) and (n,) of the same areas.

    Raises
    ------
    StimulusError
        If they differ in number, there is none, or one is not a finite number above 0.
    """
    photo, rendering = (np.asarray(values, dtype=np.float64) for values in (photo_cd_m2, rendering_cd_m2))
    if photo.ndim != 1 or photo.shape != rendering.shape or not len(photo):
        raise StimulusError(f"luminances of the same areas are needed, not of shapes {photo.shape}, {rendering.shape}")
    if not np.all(np.isfinite(photo) & np.isfinite(rendering) & (photo > 0) & (rendering > 0)):
        raise StimulusError("a luminance factor needs luminances that are finite and above 0")
    count = len(photo)
    ratios = photo / rendering
    mean_ratio = float(ratios.mean())
    power = float(rendering @ rendering)
    least_squares = float(photo @ rendering) / power
    scatter = float(np.sum((photo - photo.mean()) ** 2))
    # Luminances that differ by rounding alone have no scatter to speak of.
    scattered = count > 1 and scatter > (1e-12 * float(photo.mean())) ** 2 * count

    def left(factor: float) -> float:
        return float(np.sum((photo - factor * rendering) ** 2))

    def r2(factor: float) -> float | None:
        return 1.0 - left(factor) / scatter if scattered else None

    return LuminanceFactor(
        regions=count,
        mean_ratio=mean_ratio,
        mean_ratio_se=float(ratios.std(ddof=1)) / math.sqrt(count) if count > 1 else None,
        least_squares=least_squares,
        least_squares_se=math.sqrt(left(least_squares) / (count - 1) / power) if count > 1 else None,
        pearson=_pearson(photo, rendering) if scattered else None,
        rms_as_rendered=math.sqrt(left(1.0) / count),
        rms_mean_ratio=math.sqrt(left(mean_ratio) / count),
        rms_least_squares=math.sqrt(left(least_squares) / count),
        r2_as_rendered=r2(1.0),
        r2_mean_ratio=r2(mean_ratio),
        r2_least_squares=r2(least_squares),
    )


def _pearson(photo: np.ndarray, rendering: np.ndarray) -> float | None:
    photo_off, rendering_off = photo - photo.mean(), rendering - rendering.mean()
    size = math.sqrt(float(photo_off @ photo_off) * float(rendering_off @ rendering_off))
    return max(-1.0, min(1.0, float(photo_off @ rendering_off) / size)) if size > 0 else None
