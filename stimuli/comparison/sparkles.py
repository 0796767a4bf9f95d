"""The sparkles of one area in both pictures, as pairs of numbers with their standard errors, and their reasons.

Two plates of one paint have flakes at random places, and their counts the errors of Poisson's law. Two pictures of one
plate have the same flakes: where most sparkles of either lie on one of the other, what both have is no chance, and the
error is that of those alone that one of them has [McNemar1947].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from documents import in_threads
from documents.arrays import Floats32
from documents.text import JsonResult, significant, with_error
from stimuli.comparison.alignment import Alignment
from stimuli.comparison.areas import inside, window
from stimuli.comparison.eye_identity import local_contrast
from stimuli.comparison.regions import PairedArea
from stimuli.comparison.sharpness import blurred
from stimuli.comparison.verdict import Limits, Outcome, Reason
from stimuli.pictures.rows import Mask, RowFile, bands
from stimuli.sparkles.find import Peaks, SparkleThreshold
from stimuli.sparkles.measure import SparkleMeasures, Uncertain, measure_sparkles, mutual_nearest

# Less is no turn and no growth.
_TURNED_DEG, _GROWN = 1e-6, 1e-6
# Sparkles are one if they lie nearer, and pictures of one plate if this share of them are.
SAME_PX, SAME_SHARE = 1.5, 0.5
# With fewer sparkles it is not known whether both show the same flakes.
_SPARKLING = 20
# Local contrasts of the same flakes, both as blurred as the blurrier picture, correlate by more; of others, by nothing.
_SAME_CORRELATION = 0.5
# Of larger areas, the middle is correlated.
_MIDDLE_PX = 2048
# From so many standard errors on, their decimals are of no use.
_MANY = 1000


@dataclass(frozen=True, slots=True)
class SparklePair(JsonResult):
    """One measure of sparkle (density, width, contrast) of both pictures, with standard errors.

    NaN where there are too few sparkles. ``where`` is the region's name, ``unit`` is for print. ``difference_se`` is
    the standard error of their difference, where both have part of what they show in common; None where each has its
    own.
    """

    measure: str
    photo: float
    photo_se: float
    rendering: float
    rendering_se: float
    unit: str = ""
    where: str = ""
    difference_se: float | None = None
    json_also: ClassVar = ("relative", "relative_se", "z")

    @property
    def relative(self) -> float:
        """How much more the rendering has, as a share of the photograph's; infinite if that has none."""
        if self.rendering == self.photo:
            return 0.0
        return (self.rendering - self.photo) / self.photo if self.photo else math.inf

    @property
    def relative_se(self) -> float:
        """The standard error of ``relative``; infinite if there is none.

        Of a ratio of two independent numbers, or of their difference where they have part in common.
        """
        if not self.photo:
            return math.inf
        if self.difference_se is not None:
            return self.difference_se / abs(self.photo)
        ratio = self.rendering / self.photo
        return math.hypot(self.rendering_se, ratio * self.photo_se) / abs(self.photo)

    @property
    def z(self) -> float:
        """The difference in its standard errors; 0 where the numbers are equal, NaN where it is not known."""
        apart = self.rendering - self.photo
        se = math.hypot(self.photo_se, self.rendering_se) if self.difference_se is None else self.difference_se
        if apart == 0:
            return 0.0
        return apart / se if se != 0 else math.copysign(math.inf, apart)


@dataclass(frozen=True, eq=False, slots=True)
class SparkleArea(JsonResult):
    """The sparkles of one region in both pictures; ``pixels`` lie inside it. ``matched`` is how many sparkles both
    have, None where the plates are not one and the same.

    ``own_pixels`` is true if the rendering was measured on its own pixels: if it was only shifted, by whole pixels
    then, so that the blur of interpolation does not count as a difference. ``correlation`` is that of both pictures'
    local contrasts, the sharper one blurred like the other, where ``matched`` is None: a blurred picture has few
    sparkles, and the same flakes.
    """

    name: str
    pixels: int
    own_pixels: bool
    matched: int | None
    correlation: float | None
    photo: SparkleMeasures
    rendering: SparkleMeasures
    pairs: tuple[SparklePair, ...]
    json_keys: ClassVar = {
        "name": "region",
        "own_pixels": "rendering_as_rendered",
        "matched": "in_both",
        "photo": "photograph",
    }

    @property
    def other_flakes(self) -> bool:
        """Whether both sparkle, and elsewhere."""
        sparkling = min(len(self.photo.peaks), len(self.rendering.peaks)) >= _SPARKLING
        return self.correlation is not None and sparkling and self.correlation < _SAME_CORRELATION


def sparkle_area(
    region: PairedArea,
    photo: RowFile,
    rendering: RowFile,
    brought: RowFile,
    alignment: Alignment,
    pixels_per_degree: float | None = None,
) -> SparkleArea | None:
    """Return the sparkles of a region of the photograph, and of the same of the rendering; None if it is too small."""
    rows, columns = window(region.photo_px, photo.shape)
    shifted = (abs(alignment.rotation_deg) < _TURNED_DEG and abs(alignment.scale - 1) < _GROWN) or not alignment.moved
    across, down = (round(photo_plane) for photo_plane in alignment.shift_px) if alignment.moved else (0, 0)
    source = brought
    if shifted:
        # What a shift carries out of the rendering is left out of both.
        left, top = max(columns.start, -across), max(rows.start, -down)
        right, bottom = min(columns.stop, rendering.shape[1] - across), min(rows.stop, rendering.shape[0] - down)
        rows, columns = slice(top, max(top, bottom)), slice(left, max(left, right))
        source = rendering
    else:
        across = down = 0
    if min(rows.stop - rows.start, columns.stop - columns.start) < 8:
        return None
    mask = inside(region.photo_px, rows, columns)
    pixels = int(np.count_nonzero(mask))
    if pixels < 64:
        return None
    photo_plane = _filled(photo, rows, columns, mask)
    rendering_plane = _filled(
        source, slice(rows.start + down, rows.stop + down), slice(columns.start + across, columns.stop + across), mask
    )
    threshold = SparkleThreshold()
    measured = in_threads(lambda plane: measure_sparkles(plane, threshold), (photo_plane, rendering_plane))
    unit, per = ("per deg²", pixels_per_degree**2 / pixels) if pixels_per_degree else ("per 10⁶ px", 1e6 / pixels)
    left = (alignment.shift_px[0] - across, alignment.shift_px[1] - down) if alignment.moved and shifted else (0.0, 0.0)
    matched = _matched(measured[0].peaks, measured[1].peaks, left)
    # Flakes that both pictures have add nothing to the variance of the difference.
    beside = [max(photo_plane.count.value - matched, 1.0) for photo_plane in measured] if matched is not None else None
    apart = None if beside is None else per * float(np.sqrt(sum(beside)))
    pairs = (
        _pair("density", measured[0].count.times(per), measured[1].count.times(per), unit, region.name, apart),
        _pair("width", measured[0].width_px, measured[1].width_px, "px", region.name),
        _pair("contrast", measured[0].contrast, measured[1].contrast, "", region.name),
    )
    correlation = None
    if matched is None:
        correlation = _correlation(photo_plane, rendering_plane, mask, alignment.blur_px)
    return SparkleArea(region.name, pixels, shifted, matched, correlation, measured[0], measured[1], pairs)


def _correlation(photo: Floats32, rendering: Floats32, mask: Mask, blur_px: float) -> float:
    """Return the correlation of local contrasts in an area's middle, the sharper picture blurred like the other."""
    middle = tuple(
        slice(max(0, (side - _MIDDLE_PX) // 2), max(0, (side - _MIDDLE_PX) // 2) + _MIDDLE_PX) for side in mask.shape
    )
    if not mask[middle].any():
        return 0.0
    planes = blurred(photo[middle], blur_px), blurred(rendering[middle], -blur_px)
    one, other = (local_contrast(plane)[mask[middle]].astype(np.float64) for plane in planes)
    one, other = one - one.mean(), other - other.mean()
    both = float(np.sqrt((one @ one) * (other @ other)))
    return float(one @ other) / both if both > 0 else 0.0


def _matched(photo: Peaks, rendering: Peaks, shift_px: tuple[float, float]) -> int | None:
    """Return how many sparkles are each other's nearest and near, or None if they are too few of either."""
    photo_px = np.column_stack([photo.column, photo.row]).astype(np.float64)
    rendering_px = np.column_stack([rendering.column, rendering.row]) - np.asarray(shift_px)
    both = mutual_nearest(photo_px, rendering_px, SAME_PX)
    return both if both and both >= SAME_SHARE * max(len(photo_px), len(rendering_px)) else None


def _filled(picture: RowFile, rows: slice, columns: slice, mask: Mask) -> Floats32:
    """Return the luminance of a window; outside of the area it is the area's median, which has no sparkles."""
    plane = np.empty((rows.stop - rows.start, columns.stop - columns.start), dtype=np.float32)
    # A few rows at a time: only one of their three channels is kept.
    for band in bands((len(plane), *picture.shape[1:])):
        plane[band] = picture[rows.start + band.start : rows.start + band.stop][:, columns, 1]
    if not mask.all():
        plane[~mask] = np.median(plane[mask])
    return plane


def _pair(
    measure: str, photo: Uncertain, rendering: Uncertain, unit: str, where: str, difference_se: float | None = None
) -> SparklePair:
    return SparklePair(measure, photo.value, photo.se, rendering.value, rendering.se, unit, where, difference_se)


def sparkle_reasons(pairs: Sequence[SparklePair], limits: Limits) -> list[Reason]:
    """Return a reason for every measure of sparkle."""
    return [_reason(pair, limits) for pair in pairs]


def _reason(pair: SparklePair, limits: Limits) -> Reason:
    relative = pair.relative
    outcome, why = _outcome(pair, limits)
    where = f" on '{pair.where}'" if pair.where else ""
    rendering = _number(pair.rendering, pair.rendering_se, pair.unit)
    photo = _number(pair.photo, pair.photo_se, pair.unit)
    sentence = f"sparkle {pair.measure}{where} is {rendering} in the rendering and {photo} in the photograph"
    if math.isfinite(relative) and relative:
        by = with_error(100 * abs(relative), 100 * pair.relative_se)
        sentence += f", {by} % {'more' if relative > 0 else 'less'}"
    value = 100 * abs(relative) if math.isfinite(relative) else None
    return Reason(
        f"sparkle{where}",
        pair.measure,
        outcome,
        f"{sentence}: {why}",
        value,
        100 * limits.sparkle_relative,
        "%",
    )


def _outcome(pair: SparklePair, limits: Limits) -> tuple[Outcome, str]:
    relative, z, most = pair.relative, pair.z, limits.sparkle_relative
    if math.isnan(pair.photo) and math.isnan(pair.rendering):
        return "noted", "neither picture has sparkles to measure it on"
    if math.isinf(pair.photo) or math.isinf(pair.rendering):
        return "cannot say", "one of them is no number"
    if pair.photo == pair.rendering:
        return "passes", "equal"
    if math.isnan(z) or math.isnan(relative):
        return "cannot say", "there are too few sparkles"
    large, certain = abs(relative) > most, abs(z) > limits.sparkle_z
    if large and certain:
        return "fails", f"{_standard_errors(z)} and more than {100 * most:g} %"
    if certain:
        return "noted", f"{_standard_errors(z)}, but within {100 * most:g} %"
    if large:
        return "cannot say", f"more than {100 * most:g} %, but only {_standard_errors(z)}"
    if not math.isfinite(pair.relative_se):
        return "cannot say", "it is not known how closely the difference is known"
    if pair.relative_se > limits.sparkle_relative_se:
        return "cannot say", f"the difference is known to {significant(100 * pair.relative_se, 2)} % only"
    return "passes", f"within {100 * most:g} % and {limits.sparkle_z:g} standard errors"


def _number(value: float, se: float, unit: str) -> str:
    if not math.isfinite(value):
        return "unknown"
    return f"{with_error(value, se)} {unit}".rstrip()


def _standard_errors(z: float) -> str:
    """Return how many standard errors a difference is; without any error it is certain."""
    if math.isinf(z):
        return "a difference without standard error"
    return f"{f'{abs(z):.1f}' if abs(z) < _MANY else significant(abs(z))} standard errors"
