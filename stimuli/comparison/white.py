"""Which light counts as white: lightness, and with it every ΔE00, is relative to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from devices.chart.layout import COLORCHECKER
from devices.colour.white_points import white_point
from documents import Finding
from stimuli.comparison.area_means import AreaMean
from stimuli.comparison.errors import PictureError
from stimuli.comparison.regions import Floats, PlacedRegions
from stimuli.comparison.regions_file import RegionsFile

# The white patch of a ColorChecker begins its last row.
_WHITE_PATCH = 3 * COLORCHECKER.columns + 1


def choose_white(
    regions: RegionsFile, placed: PlacedRegions, areas: Sequence[AreaMean], display_white_cd_m2: float | None
) -> tuple[Floats, str]:
    """Return the white of CIELAB, XYZ (3,), and a sentence on where its luminance comes from.

    It is the first of these that is there: what the regions file gives, the photograph's mean over the region that it
    names, over a chart's white patch, the white of the display that the pictures are seen on, and the photograph's
    brightest region. ``areas`` are the photograph's. Saturated patches and regions are not taken where there are
    others, nor is a display's white that a region outshines.

    Raises
    ------
    PictureError
        If that is no light.
    """
    luminance, where = _luminance(regions, placed, areas, display_white_cd_m2)
    if not (np.isfinite(luminance) and luminance > 0):
        raise PictureError(
            Finding("the photograph holds no light to be white", regions.file, remedy="give 'white_luminance_cd_m2'")
        )
    white = regions.spec.white
    return white_point(white, luminance), f"white is {white} at {luminance:.4g} cd/m², {where}"


def _luminance(
    regions: RegionsFile, placed: PlacedRegions, areas: Sequence[AreaMean], display: float | None
) -> tuple[float, str]:
    spec = regions.spec
    if spec.white_luminance_cd_m2 is not None:
        return spec.white_luminance_cd_m2, "given"
    means = [float(area.XYZ[1]) for area in areas]
    if spec.white_region is not None:
        place = [one.name for one in placed.regions].index(spec.white_region)
        return means[place], f"the photograph's of '{spec.white_region}'"
    usable = [place for place, area in enumerate(areas) if area.saturated_share <= spec.most_saturated_share]
    charts = {chart.entry for chart in placed.charts}
    patches = [
        place
        for place in usable
        if placed.regions[place].number == _WHITE_PATCH
        and placed.regions[place].kind == "patch"
        and placed.regions[place].entry in charts
    ]
    if patches:
        place = max(patches, key=lambda one: means[one])
        return means[place], f"that of the chart's white patch, '{placed.regions[place].name}'"
    brightest = max(usable or range(len(areas)), key=lambda one: means[one])
    if display is not None and display >= means[brightest]:
        return display, "the display's"
    return means[brightest], f"that of the brightest region, '{placed.regions[brightest].name}'"
