"""Whether a ColorChecker lies the way its corners say, told by the colours of its patches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from devices.chart.layout import patch_quadrangles
from devices.chart.way_round import MOST_OFF, WAYS, misfit
from devices.colour.spaces import XYZ_from_xyY
from devices.patches.colorchecker import colorchecker_xyY
from documents import Finding
from stimuli.comparison.regions import Chart
from stimuli.comparison.rows import Floats, Mask, Rows, bands
from stimuli.errors import StimulusError

Side = Literal["photograph", "rendering"]

# Looks at a patch along each side, and patches that are needed.
_LOOKS, _LEAST = 7, 8


def check_charts(
    picture: Rows,
    charts: Sequence[Chart],
    side: Side,
    saturated: Mask | None = None,
    file: str | None = None,
) -> tuple[str, ...]:
    """Return remarks on charts of a picture whose way round cannot be told.

    Raises
    ------
    StimulusError
        If a chart lies another way round than its corners say, with the corners as they should be; or if the colours
        there are the ColorChecker's in no way round.
    """
    _, xyY = colorchecker_xyY()
    reference = XYZ_from_xyY(xyY)
    findings: list[Finding] = []
    remarks: list[str] = []
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
            remarks.append(f"which way '{chart.entry}' lies in the {side} cannot be told: too few unsaturated patches")
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
    return tuple(remarks)


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
