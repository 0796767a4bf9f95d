"""From two pictures and their placed regions to the region table: one pass over each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stimuli.comparison.area_means import FlagSource, RowsDone, area_means
from stimuli.comparison.chart_way import check_charts
from stimuli.comparison.region_table import RegionTable, region_table
from stimuli.comparison.regions import PlacedRegions
from stimuli.comparison.regions_file import RegionsFile
from stimuli.comparison.row_source import RowSource
from stimuli.comparison.white import choose_white


@dataclass(frozen=True, slots=True)
class ComparedRegions:
    """The table, and remarks, a sentence each."""

    table: RegionTable
    said: tuple[str, ...]


def compare_regions(
    photo: RowSource,
    rendering: RowSource,
    placed: PlacedRegions,
    regions: RegionsFile,
    *,
    white_XYZ: ArrayLike | None = None,
    display_white_cd_m2: float | None = None,
    scaled_by: float | None = None,
    photo_saturated: FlagSource | None = None,
    rendering_saturated: FlagSource | None = None,
    safe_luminance_cd_m2: tuple[float, float] | None = None,
    rows_done: RowsDone | None = None,
) -> ComparedRegions:
    """Return what the ``placed`` regions of two pictures in XYZ, (height, width, 3), differ by.

    Without ``white_XYZ``, (3,), the white is that of `choose_white`. ``scaled_by`` takes the place of the factor that
    the regions file lets undo, where it is known from more than these two pictures. ``safe_luminance_cd_m2`` is the
    camera's for this exposure. The pictures need not be of one size where the regions were placed in each.

    Raises
    ------
    PictureError
        As `check_charts` and `area_means` do, or if the white's luminance is not known.
    """
    said = [
        *check_charts(photo, placed.charts, "photograph", photo_saturated, regions.file),
        *check_charts(rendering, placed.charts, "rendering", rendering_saturated, regions.file),
    ]
    total = photo.shape[0] + rendering.shape[0]

    def after(start: int) -> RowsDone | None:
        return None if rows_done is None else lambda done, _: rows_done(start + done, total)

    outlines = [[(one.name, px) for one, px in zip(placed.regions, side, strict=True)] for side in _sides(placed)]
    least = regions.spec.least_pixels
    one = area_means(photo, outlines[0], photo_saturated, least_pixels=least, what="photograph", rows_done=after(0))
    two = area_means(
        rendering,
        outlines[1],
        rendering_saturated,
        least_pixels=least,
        what="rendering",
        rows_done=after(photo.shape[0]),
    )
    if white_XYZ is None:
        white_XYZ, told = choose_white(regions, placed, one, display_white_cd_m2)
        said.append(told)
    table = region_table(
        placed.regions,
        one,
        two,
        white_XYZ,
        luminance=regions.spec.luminance,
        safe_luminance_cd_m2=safe_luminance_cd_m2,
        most_saturated_share=regions.spec.most_saturated_share,
        scaled_by=scaled_by,
    )
    return ComparedRegions(table, tuple(said))


def _sides(placed: PlacedRegions) -> tuple[list[np.ndarray], list[np.ndarray]]:
    return [one.photo_px for one in placed.regions], [one.rendering_px for one in placed.regions]
