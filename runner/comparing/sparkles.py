"""The sparkles of one area in both pictures, as pairs of numbers with their standard errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.validation.evidence import SparklePair
from analysis.validation.regions import Region, inside, window
from runner.comparing.placing import Placing
from runner.comparing.row_file import RowFile
from stimuli.sparkle_measures.find import Threshold
from stimuli.sparkle_measures.measure import Estimate, SparkleMeasures, measure_sparkles

Floats32 = NDArray[np.float32]

# A mirror-like turn is nothing to a count, but interpolation takes a little off each top.
_TURNED_DEG, _GROWN = 1e-6, 1e-6


@dataclass(frozen=True, eq=False, slots=True)
class SparkleArea:
    """What was measured of one region in both; ``pixels`` lie inside it. ``own_pixels`` says that the rendering's were.

    They are where the rendering was only shifted: its own pixels then serve, by whole pixels, and nothing that
    interpolation does to a sparkle is held against it.
    """

    name: str
    pixels: int
    own_pixels: bool
    photo: SparkleMeasures
    rendering: SparkleMeasures
    pairs: tuple[SparklePair, ...]


def sparkle_area(
    region: Region,
    photo: RowFile,
    rendering: RowFile,
    brought: RowFile,
    placing: Placing,
    pixels_per_degree: float | None = None,
) -> SparkleArea | None:
    """Return the sparkles of a region of the photograph, and of the same of the rendering; None if it is too small."""
    rows, columns = window(region.photo_px, photo.shape)
    shifted = (abs(placing.rotation_deg) < _TURNED_DEG and abs(placing.scale - 1) < _GROWN) or not placing.moved
    across, down = (round(one) for one in placing.shift_px) if placing.moved else (0, 0)
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
    one = _filled(photo, rows, columns, mask)
    two = _filled(
        source, slice(rows.start + down, rows.stop + down), slice(columns.start + across, columns.stop + across), mask
    )
    threshold = Threshold()
    measured = measure_sparkles(one, threshold), measure_sparkles(two, threshold)
    unit, per = ("per deg²", pixels_per_degree**2 / pixels) if pixels_per_degree else ("per 10⁶ px", 1e6 / pixels)
    pairs = (
        _pair("density", measured[0].count.times(per), measured[1].count.times(per), unit, region.name),
        _pair("width", measured[0].width_px, measured[1].width_px, "px", region.name),
        _pair("contrast", measured[0].contrast, measured[1].contrast, "", region.name),
    )
    return SparkleArea(region.name, pixels, shifted, *measured, pairs)


def _filled(picture: RowFile, rows: slice, columns: slice, mask: NDArray[np.bool_]) -> Floats32:
    """Return the luminance of a window; outside of the area it is the area's median, which has no sparkles."""
    plane = np.ascontiguousarray(picture[rows][:, columns, 1])
    if not mask.all():
        plane[~mask] = np.median(plane[mask])
    return plane


def _pair(measure: str, photo: Estimate, rendering: Estimate, unit: str, where: str) -> SparklePair:
    return SparklePair(measure, photo.value, photo.se, rendering.value, rendering.se, unit, where)
