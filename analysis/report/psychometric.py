"""The figure of thresholds: the data of each observer as blobs, and the fitted psychometric function."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from analysis.thresholds.fit import ThresholdFit
from documents.figures import DEEP, FAINT, INK, Drawing, drawing, drawn, short

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_PANELS = 24
_PANEL_IN, _HEIGHT_IN = 2.4, 2.1
_MOST_TICKS = 4
_LARGEST_PT2 = 220.0  # area of the blob of the level with the most trials


def draw_psychometric(panels: Sequence[tuple[str, ThresholdFit]], axis: str, width_in: float) -> Drawing:
    """Draw a panel for each (title, fit): shares of right answers by level, areas as the numbers of trials.

    All panels have one axis of levels. The threshold with its interval is a bar on the curve; a fit without an estimate
    has no curve.
    """
    shown = panels[:MOST_PANELS]
    across = min(len(shown), max(1, int(width_in / _PANEL_IN)))
    down = -(-len(shown) // across)
    with drawing(f"psychometric {axis}", width_in, 0.5 + _HEIGHT_IN * down) as (figure, axes):
        axes.remove()
        figure.set_layout_engine("constrained")
        grid = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False)
        levels = [level for _, fit in shown for level in fit.levels]
        for number, panel in enumerate(grid.flat):
            panel.patch.set_alpha(0)
            if number >= len(shown):
                panel.set_visible(False)
                continue
            title, fit = shown[number]
            _draw(panel, fit)
            if levels and fit.axis == "log10":
                ticks = _ticks(min(levels), max(levels))
                panel.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
                panel.minorticks_off()
            panel.set_title(short(title), fontsize=9, loc="left", color=INK)
            if number + across >= len(shown):
                panel.tick_params(labelbottom=True)
                panel.set_xlabel(short(axis, int(9 * width_in / across)), color=INK)
            if number % across == 0:
                panel.set_ylabel("share", color=INK)
        return drawn(figure, f"Psychometric functions of {len(shown)} observers by {axis}")


def _ticks(low: float, high: float) -> list[float]:
    """Return levels to name on a logarithmic axis: 1, 2 and 5 in each decade, or fewer where these are many."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for steps in ((1, 2, 5), (1, 3), (1,)):
        ticks = [step * 10.0**decade for decade in decades for step in steps]
        within = [tick for tick in ticks if low * 0.999 <= tick <= high * 1.001]
        if len(within) <= _MOST_TICKS:
            break
    every = -(-len(within) // _MOST_TICKS)
    return within[::every] if len(within) > 1 else [low, high]


def _draw(axes: Axes, fit: ThresholdFit) -> None:
    if fit.axis == "log10":
        axes.set_xscale("log")
    trials = np.array(fit.trials, np.float64)
    if fit.threshold is not None and fit.threshold_interval is not None:
        ends = (fit.levels[0], fit.levels[-1])
        at = np.geomspace(*ends, 101) if fit.axis == "log10" else np.linspace(*ends, 101)
        curve = [fit.probability(float(level)) or 0.0 for level in at]
        axes.plot(at, curve, color=DEEP, linewidth=1.6, zorder=2)
        height = fit.probability(fit.threshold) or 0.0
        axes.plot(fit.threshold_interval, [height, height], "|-", color=INK, linewidth=1.3, markersize=8, zorder=4)
    if len(trials):
        areas = _LARGEST_PT2 * trials / trials.max()
        shares = np.array(fit.right) / trials
        axes.scatter(fit.levels, shares, s=areas, color=DEEP, alpha=0.45, linewidths=0, zorder=3)
    axes.set_ylim(-0.05, 1.05)
    axes.grid(color=FAINT, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(colors=INK, labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)
