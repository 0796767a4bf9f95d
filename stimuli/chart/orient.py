"""Which way up a chart lies: the way in which one matrix takes the camera's values to the patches' colours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.chart.layout import COLORCHECKER, ChartLayout, patch_quadrangles
from devices.chart.way_round import MOST_OFF, WAYS, misfit
from documents import Finding
from stimuli.chart.sample import Bools, Floats, Picture
from stimuli.errors import StimulusError

_LOOKS = 7
_LEAST = 8
_COLOURS = ("red", "green", "blue")
# A channel whose patches differ by less than this share of what the strongest channel's do sees nothing.
_DEAD = 0.01


def turn_upright(
    rgb: Picture,
    saturated: Bools,
    corners_px: Floats,
    reference_XYZ: Floats,
    layout: ChartLayout = COLORCHECKER,
    *,
    file: str | None = None,
) -> tuple[Floats, str]:
    """Return the corners (4, 2) in the order of the chart's patches, and in words how the chart lay, empty if upright.

    ``reference_XYZ`` (n, 3) are the patches' colours row by row from the top left, in any unit.

    Raises
    ------
    StimulusError
        If most patches are saturated, or the colours are those of the chart in no way round.
    """
    offs: dict[str, float] = {}
    clipped = 0
    for way, order in WAYS.items():
        values, full = _glance(rgb, saturated, corners_px[list(order)], layout)
        usable = ~full & np.isfinite(values).all(axis=1)
        clipped = max(clipped, int(full.sum()))
        if usable.sum() >= _LEAST:
            offs[way] = misfit(values[usable], reference_XYZ[usable])
    if not offs:
        raise StimulusError(
            Finding(
                f"{clipped} of the chart's {len(layout)} patches are saturated",
                file,
                remedy="photograph the chart again with a shorter exposure",
            )
        )
    best = min(offs, key=lambda way: offs[way])
    if not offs[best] <= MOST_OFF:
        raise StimulusError(_unlike(rgb, saturated, corners_px, layout, offs[best], file))
    return corners_px[list(WAYS[best])], best


def _unlike(
    rgb: Picture, saturated: Bools, corners_px: Floats, layout: ChartLayout, off: float, file: str | None
) -> Finding:
    """Return why the colours between the corners are no chart's."""
    values, _ = _glance(rgb, saturated, corners_px, layout)
    range_rgb = np.ptp(np.nan_to_num(values), axis=0)
    dead = [name for name, spread in zip(_COLOURS, range_rgb, strict=True) if spread < _DEAD * range_rgb.max()]
    if dead:
        told = " and ".join(dead) + (" channel sees" if len(dead) == 1 else " channels see")
        return Finding(f"the {told} nothing of the chart", file, remedy="check how the file was made")
    return Finding(
        f"the colours there are not those of the chart in any way round (median ΔE00 {off:.0f} at best)",
        file,
        remedy="see that --corners x,y x,y x,y x,y lie on the chart's patches and that the reference is this chart's",
    )


def _glance(
    rgb: Picture, saturated: Bools, corners_px: Floats, layout: ChartLayout
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the median of a few pixels of each patch, (n, 3), and whether any of them is saturated, (n,)."""
    quadrangles = patch_quadrangles(corners_px, layout, 0.5)
    steps = (np.arange(_LOOKS) + 0.5) / _LOOKS
    u, v = (grid.ravel()[None, :, None] for grid in np.meshgrid(steps, steps))
    a, b, c, d = (quadrangles[:, i, None, :] for i in range(4))
    points = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c)
    column = np.clip(np.floor(points[..., 0]).astype(int), 0, rgb.shape[1] - 1)
    row = np.clip(np.floor(points[..., 1]).astype(int), 0, rgb.shape[0] - 1)
    return np.median(rgb[row, column].astype(np.float64), axis=1), saturated[row, column].any(axis=(1, 2))
