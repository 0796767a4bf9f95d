"""The picture of the scores, like the thesis's Figure 4.18, as SVG to be put into a page."""

from __future__ import annotations

import numpy as np

from analysis.report.palette import class_colours
from analysis.report.summary import Summary
from documents.pages.drawing import FAINT, INK, drawing, short, svg_of

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
        scores = {row: item.log10_score for row, item in enumerate(items) if item.log10_score is not None}
        shown = list(scores)
        low, high = summary.log10_interval[shown].T
        axes.hlines(shown, low, high, color=INK, linewidth=1.3, capstyle="butt", zorder=2)
        axes.plot([*low, *high], [*shown, *shown], "|", color=INK, markersize=7, markeredgewidth=1.3, zorder=2)
        for (part, parts), markers in _markers(summary).items():
            # Wedges from the top, anticlockwise: the better class on the left.
            turn = 360 / parts
            wedge = Path.wedge(90 + part * turn, 90 + (part + 1) * turn) if parts > 1 else "o"
            at, row, colours = zip(*markers, strict=True)
            axes.scatter(at, row, s=95, marker=wedge, color=colours, linewidths=0, zorder=4)
        axes.scatter(
            list(scores.values()), shown, s=95, marker="o", facecolors="none", edgecolors=INK, linewidths=1.1, zorder=5
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


def _markers(summary: Summary) -> dict[tuple[int, int], list[tuple[float, int, str]]]:
    """Return log10 score, row and colour of the markers by shape, the part of how many: a shape is drawn at once."""
    found: dict[tuple[int, int], list[tuple[float, int, str]]] = {}
    for row, item in enumerate(summary.scores.items):
        if item.log10_score is None:
            continue
        colours = class_colours(item.label)
        for part, colour in enumerate(colours):
            found.setdefault((part, len(colours)), []).append((item.log10_score, row, colour))
    return found


def _few(label: str) -> str:
    """Return a label such as "3+4", that of an item in very many classes cut short."""
    return label if label.count("+") < MOST_NAMED else "+".join(label.split("+")[:MOST_NAMED]) + "+…"
