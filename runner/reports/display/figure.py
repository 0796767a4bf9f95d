"""A diagnosis's panel as a figure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from devices.diagnostics import PlotAxes, Trace
from documents.figures import MARKERS, SERIES_COLOURS, Drawing, drawing, drawn
from documents.text import visible

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH_IN, HEIGHT_IN, EQUAL_HEIGHT_IN = 4.8, 3.1, 4.3
COLOURS: Mapping[str, str] = {
    "red": "#c8322b",
    "green": "#2a8c4a",
    "blue": "#2f62c4",
    "grey": "#7b858d",
    "ink": "#23282d",
    "soft": "#9aa3ab",
    "accent": "#165466",
}
FAINT = "#d8dde1"
LIMIT = "#b06a00"
_MOST_NAMES = 8
_LONGEST_NAME = 24


def draw_panel(panel: PlotAxes, description: str) -> Drawing:
    """Return a panel as a figure."""
    with drawing(panel.title, WIDTH_IN, EQUAL_HEIGHT_IN if panel.equal else HEIGHT_IN) as (figure, axes):
        for line, look in zip(panel.lines, looks(panel.lines), strict=True):
            _draw(axes, line, look)
        for level in panel.levels:
            axes.axhline(level, color=LIMIT, linewidth=1.1, linestyle=(0, (4, 3)), zorder=1)
        if panel.equal:
            axes.set_aspect("equal", adjustable="datalim")
        if panel.x_names:
            axes.set_xticks(range(1, len(panel.x_names) + 1), [_short(name) for name in panel.x_names])
            axes.set_xlim(0.5, len(panel.x_names) + 0.5)
        axes.set_title(panel.title, fontsize=10, loc="left", color=COLOURS["ink"])
        axes.set_xlabel(panel.x_label, color=COLOURS["ink"])
        axes.set_ylabel(panel.y_label, color=COLOURS["ink"])
        axes.grid(color=FAINT, linewidth=0.6)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(colors=COLOURS["ink"])
        names = [line.name for line in panel.lines if line.name]
        if 1 < len(names) <= _MOST_NAMES:
            axes.legend(frameon=False, fontsize=9)
        return drawn(figure, description)


@dataclass(frozen=True, slots=True)
class SeriesStyle:
    """How a series looks: no two named ones of a panel agree in colour, marker and dashes."""

    colour: str
    marker: str
    dashes: str | tuple[float, tuple[float, ...]]


DASHES = ("-", (0, (1.5, 1.5)), (0, (7, 2, 1.5, 2)), (0, (3, 2, 1.5, 2, 1.5, 2)))
DASHED = (0, (5, 3))


def looks(lines: Sequence[Trace]) -> list[SeriesStyle]:
    """Return how each series of a panel is drawn.

    The first has the colour that its check asks for, a dot and a whole line. Each further named one with points has a
    marker of its own, each with a line dashes of its own, and another colour where its own is taken.
    """
    count: Counter[str] = Counter()
    taken: set[tuple[str, str]] = set()
    found = []
    for line in lines:
        kind = "points" if line.style == "points" else "line"
        number = count[kind]
        colour = COLOURS[line.colour]
        if line.name:
            count[kind] += line.style in ("points", "line")
            if (kind, colour) in taken:
                colour = SERIES_COLOURS[number % len(SERIES_COLOURS)]
            taken.add((kind, colour))
        else:
            number = 0
        dashes = DASHED if line.style == "dashed" else DASHES[number % len(DASHES)] if line.style == "line" else "-"
        found.append(SeriesStyle(colour, MARKERS[number % len(MARKERS)], dashes))
    return found


def _draw(axes: Axes, line: Trace, look: SeriesStyle) -> None:
    label = _short(line.name) or "_"
    x, y = list(line.x), list(line.y)
    if line.style == "outline":
        x, y = [*x, *x[:1]], [*y, *y[:1]]
    if line.style == "points":
        size = {"*": 7.0, "P": 5.5, "X": 5.5}.get(look.marker, 4.5)
        axes.plot(
            x,
            y,
            look.marker,
            color=look.colour,
            markersize=size,
            markeredgewidth=0,
            alpha=0.85,
            label=label,
            zorder=3,
        )
    else:
        axes.plot(x, y, color=look.colour, linewidth=1.5, linestyle=look.dashes, label=label, zorder=2)


def _short(name: str) -> str:
    seen = visible(name)
    return seen if len(seen) <= _LONGEST_NAME else seen[: _LONGEST_NAME - 1] + "…"
