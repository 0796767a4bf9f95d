"""Groups of bars with intervals, as a figure (SVG) and as the table behind it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.series.observer_means import Estimate
from documents.pages.drawing import FAINT, INK, drawing, svg_of

# In the thesis's figures base is purple, brighter blue and grey grey; what comes beyond follows.
COLOURS = ("#7b5ea7", "#3a76d2", "#9aa3ab", "#2f9e58", "#f0c52e", "#8c5a2b", "#2aa7a0", "#d03b36")
HATCHES = ("", "//", "..", "xx", "--", "\\\\", "++", "oo")


@dataclass(frozen=True, slots=True)
class BarFigure:
    """Bars: ``estimates[g][b]`` is that of bar b in group g, None where there is none.

    ``unit`` stands beside the value axis; ``group_title`` says what the groups are.
    """

    title: str
    group_title: str
    unit: str
    groups: tuple[str, ...]
    bars: tuple[str, ...]
    estimates: tuple[tuple[Estimate | None, ...], ...]

    @property
    def columns(self) -> tuple[str, ...]:
        """The table's head."""
        return (self.group_title, *self.bars)

    @property
    def rows(self) -> tuple[tuple[str, ...], ...]:
        """The table: a row for each group, each cell a value with its interval in brackets."""
        return tuple(
            (group, *(cell(one) for one in row)) for group, row in zip(self.groups, self.estimates, strict=True)
        )

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "title": self.title,
            "group_title": self.group_title,
            "unit": self.unit,
            "groups": list(self.groups),
            "bars": list(self.bars),
            "estimates": [[None if one is None else one.to_json() for one in row] for row in self.estimates],
        }

    def svg(self, width_in: float) -> str:
        """Return an ``<svg>`` element, ``width_in`` inches wide.

        Text stays text; bars differ in colour and in hatching.
        """
        with drawing(self.title, width_in, 3.3, hatch_pt=0.6) as (figure, axes):
            width = 0.8 / max(1, len(self.bars))
            for number, bar in enumerate(self.bars):
                here = [row[number] for row in self.estimates]
                x = np.arange(len(self.groups)) + (number - (len(self.bars) - 1) / 2) * width
                heights = [0.0 if one is None or one.value is None else one.value for one in here]
                axes.bar(
                    x,
                    heights,
                    width * 0.92,
                    label=_short(bar),
                    color=COLOURS[number % len(COLOURS)],
                    hatch=HATCHES[number % len(HATCHES)],
                    edgecolor="white",
                    linewidth=0,
                    zorder=2,
                )
                for place, one in zip(x, here, strict=True):
                    if one is not None and one.low is not None and one.high is not None:
                        axes.plot([place, place], [one.low, one.high], color=INK, linewidth=1.2, zorder=3)
                        axes.plot([place, place], [one.low, one.high], "_", color=INK, markersize=5, zorder=3)
            axes.set_xticks(np.arange(len(self.groups)), [_short(group) for group in self.groups])
            axes.set_xlabel(self.group_title, color=INK)
            axes.set_ylabel(self.unit, color=INK)
            axes.grid(axis="y", color=FAINT, linewidth=0.7, zorder=1)
            axes.set_axisbelow(True)
            axes.tick_params(axis="x", length=0, colors=INK)
            axes.tick_params(axis="y", length=0, colors=INK)
            axes.spines[["top", "right", "left"]].set_visible(False)
            axes.spines["bottom"].set_color(INK)
            if len(self.bars) > 1:
                figure.legend(loc="outside upper left", ncols=len(self.bars), frameon=False, labelcolor=INK)
            return svg_of(figure, self.title)


def cell(estimate: Estimate | None, digits: int = 2) -> str:
    """Return a value and its interval as text, with a real minus sign; a dash for none."""
    if estimate is None or estimate.value is None:
        return "–"
    text = f"{estimate.value:.{digits}f}"
    if estimate.low is not None and estimate.high is not None:
        text += f" ({estimate.low:.{digits}f} to {estimate.high:.{digits}f})"
    return text.replace("-", "−")


def _short(name: str) -> str:
    return name if len(name) <= 18 else name[:17] + "…"
