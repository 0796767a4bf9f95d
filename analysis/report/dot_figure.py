"""Values with intervals, a row each, as SVG."""

from __future__ import annotations

from collections.abc import Sequence

from documents.pages.drawing import DEEP, INK, drawing, rows_only, short, svg_of

Row = tuple[str, float | None, float | None, float | None]


def dots_svg(rows: Sequence[Row], axis: str, title: str, width_in: float, reference: float | None = None) -> str:
    """Return an ``<svg>``: for each (name, value, low, high) a dot with its interval; a line at ``reference``."""
    with drawing(title, width_in, 0.75 + 0.31 * len(rows)) as (figure, axes):
        for place, (_, value, low, high) in enumerate(rows):
            if value is None:
                continue
            if low is not None and high is not None:
                axes.plot([low, high], [place, place], color=INK, linewidth=1.3, solid_capstyle="butt", zorder=2)
                axes.plot([low, high], [place, place], "|", color=INK, markersize=7, markeredgewidth=1.3, zorder=2)
            axes.plot([value], [place], "o", color=DEEP, markersize=8, zorder=3)
        if reference is not None:
            axes.axvline(reference, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
        axes.set_yticks(range(len(rows)), [short(row[0]) for row in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_xlabel(axis, color=INK)
        rows_only(axes, len(rows))
        return svg_of(figure, title)
