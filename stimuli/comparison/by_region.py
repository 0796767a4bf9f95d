"""Two pictures compared by their regions: charts the right way round, which light is white, and the table.

Lightness is relative to white, and with it every ΔE00.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from devices.camera import CameraModel, Exposure
from devices.chart import COLORCHECKER, MOST_OFF, WAYS, misfit, patch_quadrangles
from devices.colour import XYZ_from_xyY, white_point
from devices.colour_matching import DEFAULT_OBSERVER
from devices.readings import colorchecker_xyY
from documents import Finding, in_threads
from documents.arrays import Floats
from documents.text import significant
from stimuli.comparison.areas import AreaMean, area_means
from stimuli.comparison.camera_rgb import CameraRGBTable, camera_rgb_table
from stimuli.comparison.regions import Chart, PlacedRegions
from stimuli.comparison.regions_file import RegionsFile
from stimuli.comparison.table import RegionTable, region_table
from stimuli.errors import StimulusError
from stimuli.pictures.rows import Mask, Rows, RowsDone, bands

Side = Literal["photograph", "rendering"]

# Looks at a patch along each side, and patches that are needed.
_LOOKS, _LEAST = 7, 8
# The white patch of a ColorChecker begins its last row.
_WHITE_PATCH = 3 * COLORCHECKER.columns + 1


@dataclass(frozen=True, slots=True)
class ComparedRegions:
    """The table, notes, a sentence each, and the regions in camera RGB where a camera is known."""

    table: RegionTable
    notes: tuple[str, ...]
    camera_rgb: CameraRGBTable | None = None


def compare_regions(
    photo: Rows,
    rendering: Rows,
    placed: PlacedRegions,
    regions: RegionsFile,
    *,
    white_XYZ: ArrayLike | None = None,
    display_white_cd_m2: float | None = None,
    scaled_by: float | None = None,
    photo_saturated: Mask | None = None,
    rendering_saturated: Mask | None = None,
    safe_luminance_cd_m2: tuple[float, float] | None = None,
    rows_done: RowsDone | None = None,
    observer: str = DEFAULT_OBSERVER,
    camera: CameraModel | None = None,
    exposure: Exposure | None = None,
) -> ComparedRegions:
    """Return the differences between the regions of two pictures.

    Parameters
    ----------
    photo, rendering
        XYZ in cd/m², (height, width, 3): arrays, or anything whose rows can be sliced. Their sizes may differ where the
        regions were placed in each.
    placed
        The regions at their places: see `place_regions`.
    regions
        The file that they come from.
    white_XYZ
        The white of CIELAB, (3,); without it, that of `choose_white`.
    display_white_cd_m2
        The luminance of the display's white, which `choose_white` may take.
    scaled_by
        The luminance factor to undo, in place of that of these regions, where it is known from more pictures.
    photo_saturated, rendering_saturated
        Where a sensor was full, bool (height, width) or (height, width, 3).
    safe_luminance_cd_m2
        The zone of luminance that the camera was tested in at this exposure.
    rows_done
        Called with how many rows of how many are done.
    observer
        The colorimetric observer of both pictures' XYZ, whose white `choose_white` takes.
    camera, exposure
        The camera whose RGB the regions are compared in as well, at the photograph's exposure; None for none.

    Returns
    -------
    ComparedRegions
        The table of thesis Tables 5.2 to 5.5, notes, and the regions in camera RGB.

    Raises
    ------
    StimulusError
        As `check_charts` and `area_means` do, or if the white's luminance is not known.

    Examples
    --------
    >>> from pathlib import Path
    >>> from stimuli.comparison import place_regions, read_regions
    >>> regions = read_regions(Path("configs/regions/plate.yaml"))
    >>> light = np.full((200, 300, 3), 5.0, np.float32)
    >>> placed = place_regions(regions, light.shape)
    >>> compared = compare_regions(light, light, placed, regions, white_XYZ=[95.047, 100.0, 108.883])
    >>> compared.table.mean_delta_e
    0.0
    """
    notes = [
        *check_charts(photo, placed.charts, "photograph", photo_saturated, regions.file),
        *check_charts(rendering, placed.charts, "rendering", rendering_saturated, regions.file),
    ]
    outlines = [[(region.name, px) for region, px in zip(placed.regions, side, strict=True)] for side in _sides(placed)]
    pictures, saturated, names = (photo, rendering), (photo_saturated, rendering_saturated), ("photograph", "rendering")
    done, total = [0, 0], photo.shape[0] + rendering.shape[0]

    def means(number: int) -> tuple[AreaMean, ...]:
        def count(rows: int, _: int) -> None:
            done[number] = rows
            if rows_done is not None:
                rows_done(sum(done), total)

        return area_means(
            pictures[number],
            outlines[number],
            saturated[number],
            least_pixels=regions.spec.least_pixels,
            what=names[number],
            rows_done=count,
        )

    photo_areas, rendering_areas = in_threads(means, (0, 1))
    if white_XYZ is None:
        white_XYZ, remark = choose_white(regions, placed, photo_areas, display_white_cd_m2, observer)
        notes.append(remark)
    table = region_table(
        placed.regions,
        photo_areas,
        rendering_areas,
        white_XYZ,
        luminance=regions.spec.luminance,
        safe_luminance_cd_m2=safe_luminance_cd_m2,
        most_saturated_share=regions.spec.most_saturated_share,
        scaled_by=scaled_by,
    )
    in_camera_rgb = None
    if camera is not None and camera.observer == observer:
        in_camera_rgb = camera_rgb_table(table, photo_areas, rendering_areas, camera, exposure)
    elif camera is not None:
        notes.append(f"camera RGB is left out: the camera file is for {camera.observer}, the pictures for {observer}")
    return ComparedRegions(table, tuple(notes), in_camera_rgb)


def _sides(placed: PlacedRegions) -> tuple[list[np.ndarray], list[np.ndarray]]:
    return [region.photo_px for region in placed.regions], [region.rendering_px for region in placed.regions]


def choose_white(
    regions: RegionsFile,
    placed: PlacedRegions,
    areas: Sequence[AreaMean],
    display_white_cd_m2: float | None,
    observer: str = DEFAULT_OBSERVER,
) -> tuple[Floats, str]:
    """Return the white of CIELAB, XYZ (3,), and a sentence on where its luminance comes from.

    It is the first of these that is there: what the regions file gives, the photograph's mean over the region that it
    names, over a chart's white patch, the white of the display that the pictures are seen on, and the photograph's
    brightest region. ``areas`` are the photograph's. Saturated patches and regions are not taken where there are
    others, nor is a display's white that a region outshines.

    Raises
    ------
    StimulusError
        If that is no light.
    """
    luminance, where = _luminance(regions, placed, areas, display_white_cd_m2)
    if not (np.isfinite(luminance) and luminance > 0):
        raise StimulusError(
            Finding("the photograph holds no light to be white", regions.file, remedy="give 'white_luminance_cd_m2'")
        )
    white = regions.spec.white
    named = white if observer == DEFAULT_OBSERVER else f"{white} for {observer}"
    return white_point(white, luminance, observer), f"white is {named} at {significant(luminance, 4)} cd/m², {where}"


def _luminance(
    regions: RegionsFile, placed: PlacedRegions, areas: Sequence[AreaMean], display: float | None
) -> tuple[float, str]:
    spec = regions.spec
    if spec.white_luminance_cd_m2 is not None:
        return spec.white_luminance_cd_m2, "given"
    means = [float(area.XYZ[1]) for area in areas]
    if spec.white_region is not None:
        place = [region.name for region in placed.regions].index(spec.white_region)
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
        place = max(patches, key=lambda index: means[index])
        return means[place], f"that of the chart's white patch, '{placed.regions[place].name}'"
    brightest = max(usable or range(len(areas)), key=lambda index: means[index])
    if display is not None and display >= means[brightest]:
        return display, "the display's"
    return means[brightest], f"that of the brightest region, '{placed.regions[brightest].name}'"


def check_charts(
    picture: Rows,
    charts: Sequence[Chart],
    side: Side,
    saturated: Mask | None = None,
    file: str | None = None,
) -> tuple[str, ...]:
    """Return notes on charts of a picture whose way round is not known.

    Raises
    ------
    StimulusError
        If a chart lies another way round than its corners, with the corners as they should be; or if the colours
        there are the ColorChecker's in no way round.
    """
    _, xyY = colorchecker_xyY()
    reference = XYZ_from_xyY(xyY)
    findings: list[Finding] = []
    notes: list[str] = []
    for chart in charts:
        corners = chart.photo_px if side == "photograph" else chart.rendering_px
        offs: dict[str, float] = {}
        for way, order in WAYS.items():
            quadrangles = patch_quadrangles(corners[list(order)], chart.layout, min(chart.inner, 0.5))
            values, full = _glance(picture, saturated, quadrangles)
            usable = ~full & np.isfinite(values).all(axis=1)
            if usable.sum() >= _LEAST:
                offs[way] = misfit(values[usable], reference[usable])
        if not offs:
            notes.append(f"which way '{chart.entry}' lies in the {side} is not known: too few unsaturated patches")
            continue
        best = min(offs, key=lambda way: offs[way])
        if not offs[best] <= MOST_OFF:
            findings.append(
                Finding(
                    f"the colours between the corners of '{chart.entry}' are the ColorChecker's in no way round in the "
                    f"{side} (median ΔE00 {offs[best]:.0f} at best)",
                    file,
                    remedy="give the outer corners of its patches, or 'colours: other' if it is another chart",
                )
            )
        elif best:
            right = ", ".join(f"[{x:.6g}, {y:.6g}]" for x, y in corners[list(WAYS[best])])
            findings.append(
                Finding(
                    f"the chart '{chart.entry}' lies {best} in the {side}",
                    file,
                    remedy=f"begin with the corner at its dark skin patch; in pixels: [{right}]",
                )
            )
    if findings:
        raise StimulusError(findings)
    return tuple(notes)


def _glance(picture: Rows, saturated: Mask | None, quadrangles: Floats) -> tuple[Floats, Mask]:
    """Return the median of a few pixels of each quadrangle (n, 4, 2), (n, 3), and whether one is saturated, (n,)."""
    steps = (np.arange(_LOOKS) + 0.5) / _LOOKS
    u, v = (grid.ravel()[None, :, None] for grid in np.meshgrid(steps, steps))
    a, b, c, d = (quadrangles[:, corner, None, :] for corner in range(4))
    points = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c)
    height, width = picture.shape[:2]
    column = np.clip(np.floor(points[..., 0]).astype(int), 0, width - 1)
    row = np.clip(np.floor(points[..., 1]).astype(int), 0, height - 1)
    values = np.empty((*row.shape, 3))
    full = np.zeros(row.shape, dtype=np.bool_)
    for band in bands(picture.shape):
        here = (row >= band.start) & (row < band.stop)
        if not here.any():
            continue
        rows = slice(int(row[here].min()), int(row[here].max()) + 1)
        at = (row[here] - rows.start, column[here])
        values[here] = picture[rows][at]
        if saturated is not None:
            flags = saturated[rows][at]
            full[here] = flags.any(axis=1) if flags.ndim == 2 else flags
    return np.median(values, axis=1), np.asarray(full.any(axis=1))
