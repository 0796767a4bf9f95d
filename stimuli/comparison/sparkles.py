"""The sparkles of one area in both pictures, as pairs of numbers with their standard errors.

Two plates of one paint have flakes at random places, and their counts the errors of Poisson's law. Two pictures of one
plate have the same flakes: where most sparkles of either lie on one of the other, what both have is no chance, and the
error is that of those alone that one of them has [McNemar1947].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from documents import in_threads
from documents.arrays import Floats32
from documents.text import JsonResult
from stimuli.comparison.alignment import Alignment
from stimuli.comparison.areas import inside, window
from stimuli.comparison.evidence import SparklePair
from stimuli.comparison.eye_identity import local_contrast
from stimuli.comparison.regions import Region
from stimuli.comparison.sharpness import blurred
from stimuli.pictures.rows import Mask, RowFile, bands
from stimuli.sparkle.measures.find import Peaks, Threshold
from stimuli.sparkle.measures.measure import Estimate, SparkleMeasures, measure_sparkles, mutual_nearest

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
    region: Region,
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
    threshold = Threshold()
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
    measure: str, photo: Estimate, rendering: Estimate, unit: str, where: str, difference_se: float | None = None
) -> SparklePair:
    return SparklePair(measure, photo.value, photo.se, rendering.value, rendering.se, unit, where, difference_se)
