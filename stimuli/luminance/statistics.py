"""Statistics of a picture's light, per eye: the columns of Table 4.3, dynamic range and contrast."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from devices.display import EyeModels
from documents.text import JsonResult
from stimuli.luminance.saturation import Saturation, measure_saturation
from stimuli.pictures.coded import CodedPicture
from stimuli.pictures.stereo_image import Eye, StereoImage
from stimuli.sparkles.find import SparkleThreshold
from stimuli.sparkles.measure import PixelScale, SparkleMeasures, measure_sparkles

# A picture's extremes are single pixels; its robust range leaves out the darkest and the brightest thousandth.
ROBUST_PERCENTILES = (0.1, 99.9)
_SOME = 64
_EYES: tuple[Eye, Eye] = ("left", "right")
# Rows at a time: what stays in the processor's cache in double precision.
_ROWS = 32


@dataclass(frozen=True, slots=True)
class DynamicRange(JsonResult):
    """Between two luminances; infinite from 0, and 1 : 1 in a picture without light."""

    low_cd_m2: float
    high_cd_m2: float
    json_also: ClassVar = ("log10", "stops")

    @property
    def ratio(self) -> float:
        """High over low."""
        if self.high_cd_m2 <= 0:
            return 1.0
        return self.high_cd_m2 / self.low_cd_m2 if self.low_cd_m2 > 0 else math.inf

    @property
    def log10(self) -> float:
        """The decimal logarithm of the ratio."""
        return math.log10(self.ratio)

    @property
    def stops(self) -> float:
        """The ratio in stops."""
        return math.log2(self.ratio)


@dataclass(frozen=True, slots=True)
class EyeStatistics(JsonResult):
    """One eye's picture.

    ``rms_contrast`` is the standard deviation of luminance over its mean [Peli1990]. ``sparkles`` holds the Weber
    contrast of its sparkles (Expression 2.13) with their count and size. ``saturated`` is None where no display is
    known.
    """

    mean_cd_m2: float
    max_cd_m2: float
    dynamic_range: DynamicRange
    robust_range: DynamicRange
    rms_contrast: float
    saturated: Saturation | None
    sparkles: SparkleMeasures | None
    json_keys: ClassVar = {
        "mean_cd_m2": "mean_luminance_cd_m2",
        "max_cd_m2": "max_luminance_cd_m2",
        "robust_range": "dynamic_range_robust",
        "saturated": "saturated_percent",
    }


@dataclass(frozen=True, slots=True)
class PictureStatistics(JsonResult):
    """A row of Table 4.3 for each eye; a flat picture on one display model has one object for both."""

    exposure_s: float | None
    luminance_scale: float
    eyes: Mapping[Eye, EyeStatistics]


def picture_statistics(
    image: StereoImage | CodedPicture,
    models: EyeModels | None = None,
    *,
    exposure_s: float | None = None,
    luminance_scale: float = 1.0,
    threshold: SparkleThreshold | None = None,
    scale: PixelScale | None = None,
) -> PictureStatistics:
    """Return the statistics of each eye's picture (thesis Table 4.3); what both eyes share is computed once.

    Parameters
    ----------
    image
        XYZ in cd/m², or codes.
    models
        The display's models for both eyes, to count the pixels that it cannot show bright enough.
    exposure_s, luminance_scale
        Kept with the statistics.
    threshold
        What is a sparkle; without it none are measured.
    scale
        How large a pixel is, for the sparkles.

    Returns
    -------
    PictureStatistics
        Mean and largest luminance in cd/m², dynamic range, RMS contrast [Peli1990], saturated pixels and sparkles.

    Raises
    ------
    StimulusError
        If the threshold does not separate sparkles from what lies between them.

    Examples
    --------
    >>> light = np.full((4, 6, 3), 5.0, np.float32)
    >>> light[0, 0] = 20.0
    >>> statistics = picture_statistics(StereoImage.flat(light)).eyes["left"]
    >>> statistics.mean_cd_m2, statistics.max_cd_m2, statistics.dynamic_range.to_json()["stops"]
    (5.625, 20.0, 2.0)
    """
    left = _statistics(image, "left", models, threshold, scale)
    same = image.is_flat and (models is None or models.left is models.right)
    right = left if same else _statistics(image, "right", models, threshold, scale)
    return PictureStatistics(exposure_s, luminance_scale, {"left": left, "right": right})


def _statistics(
    image: StereoImage | CodedPicture,
    eye: Eye,
    models: EyeModels | None,
    threshold: SparkleThreshold | None,
    scale: PixelScale | None,
) -> EyeStatistics:
    luminance = image.luminance_cd_m2(eye)
    mean, deviation = _mean_and_deviation(luminance)
    least, low, high, most = _ends(luminance.ravel())
    half = isinstance(image, StereoImage) and image.half
    return EyeStatistics(
        mean,
        most,
        DynamicRange(least, most),
        DynamicRange(float(low), float(high)),
        deviation / mean if mean > 0 else 0.0,
        None if models is None else measure_saturation(image.eye(eye), models.eye(eye), half=half),
        None if threshold is None else measure_sparkles(luminance, threshold, scale),
    )


def _mean_and_deviation(values: NDArray[np.float32]) -> tuple[float, float]:
    """Return the mean of ``values`` (height, width) and their standard deviation, in double precision, read once.

    Sums are of differences from a value near the mean: those of equal values are exactly 0.
    """
    near = float(values[::_SOME, ::_SOME].mean(dtype=np.float64))
    differences, ones = np.empty((_ROWS, values.shape[1])), np.ones(values.shape[1])
    first = second = 0.0
    for top in range(0, len(values), _ROWS):
        band = values[top : top + _ROWS]
        from_near = differences[: len(band)]
        np.copyto(from_near, band)
        from_near -= near
        # Row by row: BLAS adds so few numbers in one thread.
        first += float(np.vecdot(from_near, ones).sum())
        second += float(np.vecdot(from_near, from_near).sum())
    offset = first / values.size
    return near + offset, math.sqrt(max(second / values.size - offset * offset, 0.0))


def _ends(values: NDArray[np.float32]) -> tuple[float, float, float, float]:
    """Return the least, the two robust percentiles (nearest, as ``np.percentile``), and the most of ``values`` (n,).

    Only what lies beyond bounds that every 64th value suggests is copied and sorted: a quarter of the time of sorting
    all, and little memory even where most of the picture has one value.
    """
    last = values.size - 1
    low, high = (round(percent / 100 * last) for percent in ROBUST_PERCENTILES)
    some = np.sort(values[::_SOME])
    inside = min(4 * low // _SOME + 8, some.size - 1)
    dark, bright = some[inside], some[-1 - inside]
    beyond = values < dark
    beyond |= values > bright
    ends = np.sort(values[np.flatnonzero(beyond)])
    darker, brighter = ends[: np.searchsorted(ends, dark)], ends[np.searchsorted(ends, bright, "right") :]
    too_few = darker.size <= low and np.count_nonzero(values <= dark) <= low
    if too_few or (brighter.size <= last - high and np.count_nonzero(values >= bright) <= last - high):
        whole = np.sort(values)
        return float(whole[0]), float(whole[low]), float(whole[high]), float(whole[-1])
    least = darker[0] if darker.size else dark
    most = brighter[-1] if brighter.size else bright
    at_low = darker[low] if low < darker.size else dark
    at_high = brighter[-1 - (last - high)] if last - high < brighter.size else bright
    return float(least), float(at_low), float(at_high), float(most)
