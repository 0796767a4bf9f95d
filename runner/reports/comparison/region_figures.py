"""Figures of regions: luminances as they are and scaled (thesis Figures 5.9 and 5.10), chromaticities, ΔE00."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from devices.colour.spaces import xyY_from_XYZ
from documents.pages.drawing import DEEP, FAINT, INK, NARROW_IN, WIDE_IN, drawing, rows_only, short, svg_of
from stimuli.comparison.table import RegionRow, RegionTable

RENDERED = "#c2571a"
# Bars for the regions that differ most, no more than can be read.
MOST_BARS = 60
# Luminances that span more than this are drawn on logarithmic axes.
_WIDE_SPAN = 30.0
_TIMES = (1, 2, 5, 10, 20, 50, 100, 200, 500)
# Difference vectors are drawn as long as this share of what the figure spans, at most.
_VECTOR_SHARE = 0.12


def luminance_figure(table: RegionTable, label: str) -> str:
    """Return the photograph's luminances over the rendering's as ``<svg>``: as rendered, and times the mean ratio.

    Equal luminances lie on the line. Excluded regions are left out.
    """
    photo = np.array([row.photo.luminance_cd_m2 for row in table.compared])
    rendering = np.array([row.rendering.luminance_cd_m2 for row in table.compared])
    factor = table.factor.mean_ratio if table.factor is not None else 1.0
    with drawing("region-luminance", NARROW_IN, 3.8) as (figure, axes):
        if len(photo):
            everything = np.concatenate([photo, rendering, factor * rendering])
            low, high = float(everything.min()), float(everything.max())
            if high > _WIDE_SPAN * low:
                axes.set(xscale="log", yscale="log")
                ends = (low / 1.3, high * 1.3)
            else:
                ends = (0.0, high * 1.05)
            axes.plot(ends, ends, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
            axes.plot(rendering, photo, "o", color=RENDERED, markerfacecolor="none", label="as rendered", zorder=2)
            scaled = f"rendering × {factor:.4g}"
            axes.plot(factor * rendering, photo, "o", color=DEEP, markersize=4, label=scaled, zorder=3)
            axes.set(xlim=ends, ylim=ends, aspect="equal")
            axes.legend(frameon=False, fontsize=8)
        axes.set_xlabel("rendering (cd/m²)", color=INK)
        axes.set_ylabel("photograph (cd/m²)", color=INK)
        axes.spines[["top", "right"]].set_visible(False)
        return svg_of(figure, label)


def chromaticity_figure(table: RegionTable, label: str) -> str:
    """Return the photograph's chromaticities as ``<svg>``, with vectors towards the rendering's.

    Vectors are drawn a round number of times as long, so that they can be seen; the figure says how many. Excluded
    regions are left out; the cross is the white.
    """
    rows = table.compared
    start = np.array([[row.photo.x, row.photo.y] for row in rows]).reshape(-1, 2)
    apart = np.array([[row.delta_x, row.delta_y] for row in rows]).reshape(-1, 2)
    times = _times(start, apart)
    with drawing("region-chromaticity", NARROW_IN, 3.8) as (figure, axes):
        white = xyY_from_XYZ(table.white_XYZ)
        axes.plot([white[0]], [white[1]], "+", color=INK, markersize=9, zorder=1)
        axes.plot(start[:, 0], start[:, 1], "o", color=DEEP, markersize=4, zorder=3)
        end = start + times * apart
        for one, two in zip(start, end, strict=True):
            axes.plot(*zip(one, two, strict=True), color=RENDERED, linewidth=1.2, zorder=2)
        everything = np.concatenate([start, end, [white[:2]]])
        middle, reach = (everything.max(axis=0) + everything.min(axis=0)) / 2, float(np.ptp(everything, axis=0).max())
        half = 0.55 * max(reach, 0.02)
        axes.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half), aspect="equal")
        axes.grid(color=FAINT, linewidth=0.7)
        axes.set_axisbelow(True)
        axes.set_xlabel("x" if times == 1 else f"x    (differences drawn {times} × as long)", color=INK)
        axes.set_ylabel("y", color=INK)
        axes.spines[["top", "right"]].set_visible(False)
        return svg_of(figure, label)


def delta_e_figure(table: RegionTable, limit: float, label: str) -> str:
    """Return ΔE00 of each region as ``<svg>``, with the ``limit`` as a line; excluded regions are grey.

    Of more than `MOST_BARS` regions, those that differ most.
    """
    rows = _most(table.rows)
    with drawing("region-delta-e", WIDE_IN, 0.8 + 0.22 * max(len(rows), 1)) as (figure, axes):
        for place, row in enumerate(rows):
            colour = FAINT if row.excluded else RENDERED if row.delta_e > limit else DEEP
            axes.barh(place, row.delta_e, height=0.62, color=colour, zorder=2)
            if row.delta_e_se is not None:
                ends = [row.delta_e - row.delta_e_se, row.delta_e + row.delta_e_se]
                axes.plot(ends, [place, place], color=INK, linewidth=1.1, zorder=3)
        axes.axvline(limit, color=INK, linewidth=1, linestyle=(0, (4, 2)), zorder=4)
        axes.set_yticks(range(len(rows)), [short(row.name) + (" (excluded)" if row.excluded else "") for row in rows])
        axes.set_ylim(max(len(rows), 1) - 0.4, -0.6)
        axes.set_xlim(0, 1.05 * max([limit, *(row.delta_e + (row.delta_e_se or 0.0) for row in rows)]))
        axes.set_xlabel(f"ΔE00 (the line is the limit, {limit:g})", color=INK)
        rows_only(axes, len(rows))
        axes.tick_params(axis="y", labelsize=8)
        return svg_of(figure, label)


def _most(rows: Sequence[RegionRow]) -> Sequence[RegionRow]:
    if len(rows) <= MOST_BARS:
        return rows
    kept = sorted(range(len(rows)), key=lambda place: -rows[place].delta_e)[:MOST_BARS]
    return [rows[place] for place in sorted(kept)]


def _times(start: np.ndarray, apart: np.ndarray) -> int:
    """Return how many times as long the vectors are drawn: the longest then has a share of what the points span."""
    longest = float(np.hypot(*apart.T).max()) if len(apart) else 0.0
    if longest == 0.0:
        return 1
    room = _VECTOR_SHARE * max(float(np.ptp(start, axis=0).max()), 0.02)
    return max((times for times in _TIMES if times * longest <= room), default=1)
