"""From two pictures and their placed regions to the region table: one pass over each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from analysis.validation.area_means import AreaMean, FlagSource, RowsDone, area_means
from analysis.validation.chart_way import check_charts
from analysis.validation.errors import PictureError
from analysis.validation.region_table import RegionTable, region_table
from analysis.validation.regions import PlacedRegions
from analysis.validation.regions_file import RegionsFile
from analysis.validation.row_source import RowSource
from devices.white_points import white_point
from documents import Finding


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
    photo_saturated: FlagSource | None = None,
    rendering_saturated: FlagSource | None = None,
    safe_luminance_cd_m2: tuple[float, float] | None = None,
    rows_done: RowsDone | None = None,
) -> ComparedRegions:
    """Return what the ``placed`` regions of two pictures in XYZ, (height, width, 3), differ by.

    Without ``white_XYZ``, (3,), the white is that of the regions file. ``safe_luminance_cd_m2`` is the camera's for
    this exposure. The pictures need not be of one size where the regions were placed in each.

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
        white_XYZ, told = _white(regions, placed, one)
        said.append(told)
    table = region_table(
        placed.regions,
        one,
        two,
        white_XYZ,
        luminance=regions.spec.luminance,
        safe_luminance_cd_m2=safe_luminance_cd_m2,
        most_saturated_share=regions.spec.most_saturated_share,
    )
    return ComparedRegions(table, tuple(said))


def _sides(placed: PlacedRegions) -> tuple[list[np.ndarray], list[np.ndarray]]:
    return [one.photo_px for one in placed.regions], [one.rendering_px for one in placed.regions]


def _white(regions: RegionsFile, placed: PlacedRegions, areas: tuple[AreaMean, ...]) -> tuple[np.ndarray, str]:
    """Return the white of a regions file and a sentence on where its luminance comes from."""
    spec = regions.spec
    if spec.white_luminance_cd_m2 is not None:
        luminance, where = spec.white_luminance_cd_m2, "given"
    elif spec.white_region is not None:
        by_name = {one.name: area for one, area in zip(placed.regions, areas, strict=True)}
        luminance, where = float(by_name[spec.white_region].XYZ[1]), f"the photograph's of '{spec.white_region}'"
    else:
        usable = [place for place, area in enumerate(areas) if area.saturated_share <= spec.most_saturated_share]
        brightest = max(usable or range(len(areas)), key=lambda place: float(areas[place].XYZ[1]))
        luminance, where = (
            float(areas[brightest].XYZ[1]),
            f"that of the brightest region, '{placed.regions[brightest].name}'",
        )
    if not (np.isfinite(luminance) and luminance > 0):
        raise PictureError(
            Finding(
                "the photograph holds no light to be white",
                regions.file,
                remedy="give 'white_luminance_cd_m2'",
            )
        )
    return white_point(spec.white, luminance), f"white is {spec.white} at {luminance:.4g} cd/m², {where}"
