"""The picture of the scores, like the thesis's Figure 4.18, as SVG to be put into a page."""

from __future__ import annotations

import numpy as np

from analysis.report.drawing import FAINT, INK, drawing, short, svg_of
from analysis.report.palette import class_colours
from analysis.report.summary import Summary

MOST_NAMED = 5


def scores_svg(summary: Summary, width_in: float) -> str:
    """Return an ``<svg>`` element: log10 scores with 95 % intervals, a row per stimulus, best at the top.

    Text stays text. An item in several classes has a marker of several colours; the class stands beside each row,
    so that nothing depends on colour.
    """
    from matplotlib.path import Path

    items = summary.scores.items
    height_in = 0.75 + 0.31 * len(items)
    with drawing("scores", width_in, height_in) as (figure, axes):
        rows = np.arange(len(items))
        for row, item, (low, high) in zip(rows, items, summary.log10_interval, strict=True):
            if item.log10_score is None:
                continue
            axes.plot([low, high], [row, row], color=INK, linewidth=1.3, solid_capstyle="butt", zorder=2)
            axes.plot([low, high], [row, row], "|", color=INK, markersize=7, markeredgewidth=1.3, zorder=2)
            colours = class_colours(item.label)
            for part, colour in enumerate(colours):
                # Wedges from the top, anticlockwise: the better class on the left.
                turn = 360 / len(colours)
                wedge = Path.wedge(90 + part * turn, 90 + (part + 1) * turn) if len(colours) > 1 else "o"
                axes.scatter([item.log10_score], [row], s=95, marker=wedge, color=colour, linewidths=0, zorder=4)
            axes.scatter(
                [item.log10_score], [row], s=95, marker="o", facecolors="none", edgecolors=INK, linewidths=1.1, zorder=5
            )
        axes.set_yticks(rows, [short(item.name) for item in items])
        axes.set_ylim(len(items) - 0.4, -0.6)
        beside = axes.secondary_yaxis("right")
        beside.set_yticks(rows, [_few(item.label or "–") for item in items], fontweight="bold")
        beside.tick_params(length=0)
        beside.set_ylabel("class", rotation=0, ha="left", va="bottom", color=INK)
        beside.yaxis.set_label_coords(1.01, 1.0)
        axes.set_xlabel("log₁₀ score")
        axes.hlines(rows, 0, 1, transform=axes.get_yaxis_transform(), color=FAINT, linewidth=0.7, zorder=1)
        axes.tick_params(axis="y", length=0, colors=INK)
        axes.tick_params(axis="x", colors=INK)
        for spines in (axes.spines, beside.spines):
            spines[["top", "right", "left"]].set_visible(False)
        axes.spines["bottom"].set_color(INK)
        return svg_of(figure, f"Scores of {len(items)} stimuli with 95 % intervals")


def _few(label: str) -> str:
    """Return a label such as "3+4", that of an item in very many classes cut short."""
    return label if label.count("+") < MOST_NAMED else "+".join(label.split("+")[:MOST_NAMED]) + "+…"
