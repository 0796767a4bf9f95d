"""Bars in groups with intervals: Figures 4.14 to 4.16 of the thesis [Medina2016].

In the thesis's figures base is purple, brighter blue and grey grey, the first three colours here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.series.observer_means import Estimated
from documents.figures import FAINT, HATCHES, INK, SERIES_COLOURS, Drawing, drawing, drawn, short
from documents.text import JsonResult

_LIGHT = (2, 4)  # series whose hatch is dark
_LETTER_IN = 0.085
LONGEST_NAME = 18


@dataclass(frozen=True, slots=True)
class BarFigure(JsonResult):
    """Bars: ``estimates[g][b]`` is that of bar b in group g; None where there is none.

    ``unit`` is the label of the value axis, ``group_title`` that of the groups.
    """

    title: str
    group_title: str
    unit: str
    groups: tuple[str, ...]
    bars: tuple[str, ...]
    estimates: tuple[tuple[Estimated | None, ...], ...]

    @property
    def columns(self) -> tuple[str, ...]:
        """The table's head."""
        return (self.group_title, *self.bars)

    @property
    def rows(self) -> tuple[tuple[str, ...], ...]:
        """The table: a row for each group, each cell a value with its interval in brackets."""
        return tuple(
            (group, *(cell(estimate) for estimate in row))
            for group, row in zip(self.groups, self.estimates, strict=True)
        )

    def svg(self, width_in: float) -> str:
        """Return an ``<svg>`` element, ``width_in`` inches wide.

        Text stays text; bars differ in colour and in hatching.
        """
        return self.draw(width_in).svg

    def draw(self, width_in: float) -> Drawing:
        """Draw the bars, ``width_in`` inches wide; they differ in colour and in hatching."""
        with drawing(self.title, width_in, 3.3, hatch_pt=0.6) as (figure, axes):
            width = 0.8 / max(1, len(self.bars))
            for number, bar in enumerate(self.bars):
                here = [row[number] for row in self.estimates]
                x = np.arange(len(self.groups)) + (number - (len(self.bars) - 1) / 2) * width
                heights = [0.0 if estimate is None or estimate.value is None else estimate.value for estimate in here]
                axes.bar(
                    x,
                    heights,
                    width * 0.92,
                    label=short(bar, LONGEST_NAME),
                    color=SERIES_COLOURS[number % len(SERIES_COLOURS)],
                    hatch=HATCHES[number % len(HATCHES)],
                    edgecolor=INK if number % len(SERIES_COLOURS) in _LIGHT else "white",
                    linewidth=0,
                    zorder=2,
                )
                limits = [
                    (place, estimate.low, estimate.high)
                    for place, estimate in zip(x.tolist(), here, strict=True)
                    if estimate is not None and estimate.low is not None and estimate.high is not None
                ]
                if limits:
                    places, low, high = zip(*limits, strict=True)
                    axes.vlines(places, low, high, color="white", linewidth=3.2, zorder=3)
                    axes.vlines(places, low, high, color=INK, linewidth=1.2, zorder=4)
                    axes.plot([*places, *places], [*low, *high], "_", color=INK, markersize=5, zorder=4)
            names = [short(group, LONGEST_NAME) for group in self.groups]
            crowded = _LETTER_IN * (max(map(len, names), default=0) + 1) * len(names) > width_in - 0.8
            turned: dict[str, Any] = {"rotation": 40, "ha": "right", "rotation_mode": "anchor"} if crowded else {}
            axes.set_xticks(np.arange(len(self.groups)), names, **turned)
            axes.set_xlabel(short(self.group_title, int(9 * (width_in - 1.2))), color=INK)
            axes.set_ylabel(short(self.unit, 28), color=INK)
            axes.grid(axis="y", color=FAINT, linewidth=0.7, zorder=1)
            axes.set_axisbelow(True)
            axes.tick_params(axis="x", length=0, colors=INK)
            axes.tick_params(axis="y", length=0, colors=INK)
            axes.spines[["top", "right", "left"]].set_visible(False)
            axes.spines["bottom"].set_color(INK)
            if len(self.bars) > 1:
                longest = max(len(short(bar, LONGEST_NAME)) for bar in self.bars)
                columns = max(1, min(len(self.bars), int((width_in - 0.2) / (0.75 + _LETTER_IN * longest))))
                figure.legend(loc="outside upper left", ncols=columns, frameon=False, labelcolor=INK)
            return drawn(figure, self.title)


def cell(estimate: Estimated | None, digits: int = 2) -> str:
    """Return a value and its interval as text, with a real minus sign; a dash for none."""
    if estimate is None or estimate.value is None:
        return "–"
    text = f"{estimate.value:.{digits}f}"
    if estimate.low is not None and estimate.high is not None:
        text += f" ({estimate.low:.{digits}f} to {estimate.high:.{digits}f})"
    return text.replace("-", "−")
