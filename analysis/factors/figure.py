"""The effects of the factors with their intervals, as SVG to be put into a page."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.errors import ResultsError
from analysis.factors.drawn_rows import DrawnRow, drawn_rows
from analysis.factors.result import FactorEffects
from documents import Finding
from documents.pages.drawing import FAINT, INK, drawing, svg_of

EFFECT, LONGEST_NAME = "#165466", 34


def effects_svg(found: FactorEffects, width_in: float = 6.5) -> str:
    """Return an ``<svg>`` element: effects in nats, a row per level, factor by factor.

    The thick bar is the model's 95 % interval, the thin line with ends the one by observers. A reference level is a
    hollow circle at 0. The numbers are those of `analysis.factors.drawn_rows.drawn_rows`.

    Raises
    ------
    ResultsError
        If there are no effects to draw.
    """
    rows = drawn_rows(found)
    if not rows:
        why = " ".join(found.separation) or "there are none"
        raise ResultsError(Finding(f"there are no finite effects to draw: {why}", remedy="fit with a prior (map)"))
    places = _places(rows)
    height_in = 0.75 + 0.31 * (max(places) + 1)
    with drawing("factors", width_in, height_in) as (figure, axes):
        axes.axvline(0, color=INK, linewidth=0.8, zorder=1)
        axes.hlines(places, 0, 1, transform=axes.get_yaxis_transform(), color=FAINT, linewidth=0.7, zorder=0)
        for place, row in zip(places, rows, strict=True):
            level = [place, place]
            if row.interval is not None:
                axes.plot(row.interval, level, color=EFFECT, linewidth=6, alpha=0.35, solid_capstyle="butt", zorder=2)
            if row.robust_interval is not None:
                axes.plot(row.robust_interval, level, color=INK, linewidth=1.3, solid_capstyle="butt", zorder=3)
                axes.plot(row.robust_interval, level, "|", color=INK, markersize=7, markeredgewidth=1.3, zorder=3)
            face = "white" if row.is_reference else EFFECT
            axes.plot([row.estimate], [place], "o", color=INK, markerfacecolor=face, markersize=7, zorder=5)
        axes.set_yticks(places, [_label(row) for row in rows])
        axes.set_ylim(max(places) + 0.6, -0.6)
        axes.set_xlabel("effect on the strength (nats)", color=INK)
        axes.tick_params(axis="y", length=0, colors=INK)
        axes.tick_params(axis="x", colors=INK)
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.spines["bottom"].set_color(INK)
        count = len(found.factors)
        return svg_of(figure, f"Effects of {count} factor{'s' if count > 1 else ''} with 95 % intervals")


def _places(rows: Sequence[DrawnRow]) -> list[float]:
    """Return where rows stand, with half a row between factors."""
    places: list[float] = []
    for row, before in zip(rows, (None, *rows), strict=False):
        apart = 1.0 if before is not None and before.factor == row.factor else 1.5
        places.append(places[-1] + apart if places else 0.0)
    return places


def _label(row: DrawnRow) -> str:
    text = f"{row.factor}: {row.level}"
    return text if len(text) <= LONGEST_NAME else text[: LONGEST_NAME - 1] + "…"
