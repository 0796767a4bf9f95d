"""The sparkles of one picture in a few numbers, each with its standard error.

Two pictures, such as a photograph and a rendering, have the same sparkle if these numbers agree within their errors.
Counts have the error of Poisson's law, as flakes at random places have; means that of the scatter between sparkles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from documents.arrays import Floats
from documents.text import JsonResult
from stimuli.errors import StimulusError
from stimuli.sparkles.background import Luminance
from stimuli.sparkles.find import SEPARATION_PX, Peaks, SparkleThreshold, find_peaks
from stimuli.sparkles.moments import FWHM_PER_SD, Moments, sparkle_moments
from stimuli.sparkles.profile import RadialProfile, radial_profile

# Two equal Gaussians have one top up to two standard deviations apart, unequal ones up to more: so many in the mean.
_ONE_TOP_SD = 2.7


@dataclass(frozen=True, slots=True)
class Uncertain(JsonResult):
    """A number and its standard error; NaN where there are too few sparkles."""

    value: float
    se: float

    def times(self, factor: float) -> Uncertain:
        """Return it in another unit."""
        return Uncertain(self.value * factor, self.se * factor)


@dataclass(frozen=True, slots=True)
class PixelScale:
    """How large a pixel is, on the plate and for the eye; None for what is not known."""

    pixels_per_mm: float | None = None
    pixels_per_degree: float | None = None

    def __post_init__(self) -> None:
        for name in ("pixels_per_mm", "pixels_per_degree"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise StimulusError(f"{name} is {value}; it must be a finite number above 0")


@dataclass(frozen=True, eq=False, slots=True)
class SparkleMeasures:
    """The result of `measure_sparkles`.

    ``contrast`` is the mean Weber contrast of each sparkle's brightest pixel (Expression 2.13), of those whose
    background is above 0. ``area_px`` and ``width_px``, the mean area above the threshold and full width at half
    maximum, are of sparkles that overlap with no other; ``overlapping`` do. ``merged_expected`` are further sparkles
    that lie so near another that one was seen, if places are random. ``unfit`` have no Gaussian's form.
    """

    threshold: SparkleThreshold
    scale: PixelScale
    pixels: int
    peaks: Peaks
    moments: Moments
    profile: RadialProfile
    contrast: Uncertain
    area_px: Uncertain
    width_px: Uncertain
    merged_expected: float

    @property
    def count(self) -> Uncertain:
        """How many; of none, the standard error is that of one."""
        return Uncertain(float(len(self.peaks)), math.sqrt(max(len(self.peaks), 1)))

    @property
    def overlapping(self) -> int:
        """How many share their area above the threshold with others."""
        return int((self.peaks.peaks_in_area > 1).sum())

    @property
    def unfit(self) -> int:
        """How many have no Gaussian's form, so that neither width nor place within their pixel is known."""
        return int((~self.moments.fits).sum())

    @property
    def density_per_cm2(self) -> Uncertain | None:
        """Sparkles per square centimetre of the plate."""
        per_mm = self.scale.pixels_per_mm
        return None if per_mm is None else self.count.times(100.0 * per_mm**2 / self.pixels)

    @property
    def density_per_deg2(self) -> Uncertain | None:
        """Sparkles per square degree of the visual field."""
        per_degree = self.scale.pixels_per_degree
        return None if per_degree is None else self.count.times(per_degree**2 / self.pixels)

    @property
    def half_width_px(self) -> Uncertain:
        """Half width at half maximum of the mean profile."""
        return Uncertain(self.profile.half_width_px, self.profile.half_width_se_px)

    def to_json(self) -> dict[str, Any]:
        """Return the numbers for a manifest, without lists of sparkles."""
        per_mm, per_degree = self.scale.pixels_per_mm, self.scale.pixels_per_degree
        result: dict[str, Any] = {
            "threshold": {"times": self.threshold.times, "above_cd_m2": self.threshold.above_cd_m2},
            "count": self.count.to_json(),
            "overlapping": self.overlapping,
            "merged_expected": self.merged_expected,
            "unfit": self.unfit,
            "weber_contrast": self.contrast.to_json(),
            "area_px": self.area_px.to_json(),
            "full_width_px": self.width_px.to_json(),
            "half_width_px": self.half_width_px.to_json(),
        }
        for name, density in (("per_cm2", self.density_per_cm2), ("per_deg2", self.density_per_deg2)):
            if density is not None:
                result[name] = density.to_json()
        if per_mm is not None:
            result["half_width_um"] = self.half_width_px.times(1000.0 / per_mm).to_json()
            result["full_width_um"] = self.width_px.times(1000.0 / per_mm).to_json()
            result["area_um2"] = self.area_px.times(1e6 / per_mm**2).to_json()
        if per_degree is not None:
            result["half_width_arcmin"] = self.half_width_px.times(60.0 / per_degree).to_json()
        return result


def measure_sparkles(
    luminance_cd_m2: Luminance,
    threshold: SparkleThreshold | None = None,
    scale: PixelScale | None = None,
    *,
    window_px: int = 64,
) -> SparkleMeasures:
    """Return the sparkles of a picture: how many, how wide and of what contrast, with standard errors.

    Parameters
    ----------
    luminance_cd_m2
        The picture's luminance, float32 (rows, columns), in cd/m².
    threshold
        What is a sparkle; without it, what is twice as bright as its background.
    scale
        How large a pixel is, for results per area and in minutes of arc.
    window_px
        The side of the windows whose medians are the background: several times as large as a sparkle, smaller than the
        distance over which the light falls off.

    Returns
    -------
    SparkleMeasures
        Count, contrast, width and profile, each with its standard error, and the place of each sparkle.

    Raises
    ------
    StimulusError
        As `find_peaks` does.

    Examples
    --------
    >>> plate = np.full((128, 128), 1.0, np.float32)
    >>> plate[20::40, 20::40] = 8.0                       # nine bright points
    >>> sparkles = measure_sparkles(plate)
    >>> sparkles.count, sparkles.contrast.value
    (Uncertain(value=9.0, se=3.0), 7.0)
    """
    threshold = threshold or SparkleThreshold()
    peaks = find_peaks(luminance_cd_m2, threshold, window_px=window_px)
    moments = sparkle_moments(luminance_cd_m2, peaks)
    alone = peaks.peaks_in_area == 1
    lit = peaks.background_cd_m2 > 0
    excess = peaks.luminance_cd_m2 - peaks.background_cd_m2
    # Two random places are nearer than a radius with the chance of a disc of it.
    widths = moments.sd_px[alone & moments.fits]
    radius_px = max(SEPARATION_PX, _ONE_TOP_SD * float(np.median(widths)) if len(widths) else 0.0)
    chance = math.pi * radius_px**2 / luminance_cd_m2.size
    merged = len(peaks) ** 2 / 2 * chance * (1 + len(peaks) * chance)
    return SparkleMeasures(
        threshold,
        scale or PixelScale(),
        luminance_cd_m2.size,
        peaks,
        moments,
        radial_profile(luminance_cd_m2, peaks, moments),
        mean_of(excess[lit] / peaks.background_cd_m2[lit]),
        mean_of(peaks.area_px[alone].astype(np.float64)),
        mean_of(FWHM_PER_SD * widths),
        merged,
    )


def mean_of(values: Floats) -> Uncertain:
    """Return the mean of values (n,) and its standard error."""
    if len(values) < 2:
        return Uncertain(float(values[0]) if len(values) else math.nan, math.nan)
    return Uncertain(float(values.mean()), float(values.std(ddof=1) / math.sqrt(len(values))))


@dataclass(frozen=True, slots=True)
class SharedSparkles(JsonResult):
    """Of ``left`` and ``right`` sparkles, ``both`` lie within the tolerance of one another.

    ``by_chance`` is how many of random places would.
    """

    left: int
    right: int
    both: int
    by_chance: float
    tolerance_px: float
    json_also: ClassVar = ("share",)

    @property
    def share(self) -> Uncertain:
        """Share of all sparkles, of either eye, that both see; binomial standard error."""
        either = self.left + self.right - self.both
        if either == 0:
            return Uncertain(math.nan, math.nan)
        share = self.both / either
        return Uncertain(share, math.sqrt(share * (1 - share) / either))


def shared_sparkles(
    left: SparkleMeasures, right: SparkleMeasures, *, tolerance_px: float = 1.0, parallax_px: float = 0.0
) -> SharedSparkles:
    """Pair each sparkle with the nearest of the other eye, if that one's nearest is it, within ``tolerance_px``.

    Parameters
    ----------
    left, right
        The sparkles of each eye's picture, of one size: see `measure_sparkles`.
    tolerance_px
        How far two sparkles may lie apart to count as one, in pixels, above 0.
    parallax_px
        The right picture's horizontal position minus the left one's, in pixels, on the plane of the sparkles.

    Returns
    -------
    SharedSparkles
        How many sparkles each eye sees, how many both see, and how many would be paired by chance.

    Raises
    ------
    StimulusError
        If the pictures differ in size, or the tolerance is not above 0.

    Examples
    --------
    >>> plate = np.full((128, 128), 1.0, np.float32)
    >>> plate[20::40, 20::40] = 8.0                       # nine bright points
    >>> left, right = measure_sparkles(plate), measure_sparkles(np.roll(plate, 5, axis=1))
    >>> shared_sparkles(left, right).both, shared_sparkles(left, right, parallax_px=5.0).both
    (0, 9)
    """
    if left.pixels != right.pixels:
        raise StimulusError(f"the left picture has {left.pixels} pixels and the right one {right.pixels}")
    if not (math.isfinite(tolerance_px) and tolerance_px > 0 and math.isfinite(parallax_px)):
        raise StimulusError(f"tolerance_px is {tolerance_px} and parallax_px {parallax_px}; expected finite, above 0")
    left_places, right_places = _places(left, 0.0), _places(right, -parallax_px)
    both = mutual_nearest(left_places, right_places, tolerance_px)
    per_px = len(right_places) / right.pixels
    by_chance = len(left_places) * -math.expm1(-per_px * math.pi * tolerance_px**2)
    return SharedSparkles(len(left_places), len(right_places), both, by_chance, tolerance_px)


def _places(measures: SparkleMeasures, shift_px: float) -> Floats:
    moments = measures.moments
    return np.stack([moments.row_px, moments.column_px + shift_px], axis=-1)


def mutual_nearest(first: Floats, second: Floats, within_px: float) -> int:
    """Return how many places, (n, 2) and (m, 2), are each other's nearest and lie nearer than ``within_px``."""
    if not (len(first) and len(second)):
        return 0
    from scipy.spatial import KDTree

    apart, there = KDTree(second).query(first)
    _, back = KDTree(first).query(second)
    return int(np.count_nonzero((np.asarray(back)[there] == np.arange(len(first))) & (apart < within_px)))
