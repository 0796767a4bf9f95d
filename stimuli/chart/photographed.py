"""From a photograph of a chart to colours that a camera model is fitted to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from devices.camera import Correspondences, ReferenceColours
from devices.chart import COLORCHECKER, ChartLayout
from devices.errors import DeviceError
from documents import Finding
from stimuli.chart.find import find_corners, turn_upright
from stimuli.chart.sample import Bools, Floats, PatchValues, Picture, sample_patches
from stimuli.errors import StimulusError

_MOST_SPREAD = 0.05
_MUCH_SATURATED = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class PhotographedChart:
    """The patches' values beside their reference, and ``notes``, a sentence each."""

    colours: Correspondences
    values: PatchValues
    way: str
    corners_found: bool
    notes: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "corners_px": self.values.corners_px.tolist(),
            "corners": "found" if self.corners_found else "given",
            "way_round": self.way or "upright",
            "spread_rgb": self.values.spread.tolist(),
            "pixels": self.values.pixels.tolist(),
            "said": list(self.notes),
        }


def read_chart(
    rgb: Picture,
    saturated: Bools,
    reference: ReferenceColours,
    corners_px: ArrayLike | None = None,
    layout: ChartLayout = COLORCHECKER,
    *,
    file: str | None = None,
) -> PhotographedChart:
    """Return the values of a chart in a linear picture (height, width, 3) beside its ``reference``.

    ``corners_px`` (4, 2) are the outer corners of its patches around the chart, found where they are None. A chart that
    lies another way round than the corners say is turned, with a note.

    Raises
    ------
    StimulusError
        If there is no such chart, its patches are too small, or most are saturated.
    DeviceError
        If the values cannot be those of a linear camera.
    """
    if len(reference.names) != len(layout):
        raise DeviceError(
            Finding(
                f"the reference has {len(reference.names)} colours and the chart {len(layout)} patches", reference.file
            )
        )
    was_found = corners_px is None
    if was_found:
        corners = _find(rgb, saturated, layout, file)
    else:
        corners = check_corners(corners_px if corners_px is not None else (), rgb.shape, file)
    if not np.all((corners >= 0) & (corners <= [rgb.shape[1], rgb.shape[0]])):
        raise StimulusError(Finding("the chart reaches out of the picture", file))
    corners, way = turn_upright(rgb, saturated, corners, reference.XYZ, layout, file=file)
    values = sample_patches(rgb, saturated, corners, layout, file=file)
    colours = Correspondences(values.rgb, reference.XYZ, reference.names, values.saturated, file)
    notes = []
    if way:
        verb = "lies" if not was_found else "was found"
        notes.append(f"the chart {verb} {way}; its patches were named accordingly")
    uneven = values.spread > _MOST_SPREAD * np.maximum(values.rgb, 0.02)
    if uneven.any():
        notes.append(
            f"pixels differ by more than {100 * _MOST_SPREAD:.0f} % within {colours.named(uneven.any(axis=1))}: noise, "
            "shine, or corners that do not sit well"
        )
    return PhotographedChart(colours, values, way, was_found, tuple(notes))


def _find(rgb: Picture, saturated: Bools, layout: ChartLayout, file: str | None) -> Floats:
    try:
        return find_corners(rgb, layout, file=file)
    except StimulusError as error:
        share = float(saturated.any(axis=2).mean())
        if share < _MUCH_SATURATED:
            raise
        raise StimulusError(
            Finding(
                f"no chart was found, and {100 * share:.0f} % of the picture's pixels are saturated",
                file,
                remedy="photograph the chart again with a shorter exposure",
            )
        ) from error


def check_corners(corners_px: ArrayLike, shape: tuple[int, ...], file: str | None = None) -> Floats:
    """Return the corners (4, 2), x and y in pixels; StimulusError unless they are a convex quadrangle in the picture.

    Pixel centres lie at whole numbers and a half: the picture is from 0 to its width and height.
    """
    corners = np.asarray(corners_px, dtype=np.float64)
    height, width = shape[:2]
    if corners.shape != (4, 2) or not np.all(np.isfinite(corners)):
        raise StimulusError(Finding(f"a chart has four corners x,y, not {corners.tolist()}", file))
    if np.any(corners < 0) or np.any(corners > [width, height]):
        raise StimulusError(
            Finding(
                f"a corner of the chart lies outside the picture of {width} × {height} pixels: {corners.tolist()}",
                file,
                remedy="give x,y in pixels from the top left",
            )
        )
    sides = np.roll(corners, -1, axis=0) - corners
    following = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    if not (np.all(turns > 0) or np.all(turns < 0)):
        raise StimulusError(
            Finding(
                "the chart's corners are no convex quadrangle",
                file,
                remedy="give them around the chart: top left, top right, bottom right, bottom left",
            )
        )
    return corners
