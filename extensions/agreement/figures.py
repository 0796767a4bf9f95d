"""The figures: scores against a measure, with observers' intervals; and the limit against the classes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from analysis.bootstrap import widened_percentiles
from documents.figures import DEEP, FAINT, INK, Drawing, drawing, drawn, short
from extensions.agreement.limits import LimitCheck
from extensions.agreement.result import Agreement, MeasureResult, same_class

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANEL_IN = 2.5
SAME, OTHER = DEEP, "white"
MOST_NAMED = 14


def score_intervals(agreement: Agreement, group: int, level: float = 0.95) -> list[tuple[float, float] | None]:
    """Return the interval of each score of a group over observers, None without a bootstrap."""
    observed = agreement.groups[group]
    if observed.drawn is None:
        return [None] * len(observed.stimuli)
    columns = np.sort(observed.scores + observed.drawn.errors, axis=0).T
    return [widened_percentiles(column, observed.observers, level) for column in columns]


def draw_scores(agreement: Agreement, result: MeasureResult, width_in: float) -> Drawing:
    """Draw for each group the score of each stimulus against the measure, as good as it is higher and further right.

    Filled stimuli are in one class with the photograph, which is a star where observers compared it; grey ones have no
    class to compare.
    """
    count = len(agreement.groups)
    across = max(1, min(count, int(width_in / PANEL_IN)))
    down = -(-count // across)
    one = result.predicted
    with drawing(f"{one.name} scores", width_in, 0.4 + down * (3.0 if across == 1 else 2.6)) as (figure, axes):
        axes.remove()
        panels = figure.subplots(down, across, squeeze=False)
        for number, panel in enumerate(panels.flat):
            panel.patch.set_alpha(0)
            if number >= count:
                panel.set_visible(False)
                continue
            _scores(panel, agreement, result, number)
        label = one.title + (f" ({one.unit})" if one.unit else "")
        figure.supxlabel(
            label + (", smaller is nearer" if one.better == "lower" else ", larger is nearer"), fontsize=9.5
        )
        return drawn(figure, f"Observers' scores against {one.title}")


def _scores(axes: Axes, agreement: Agreement, result: MeasureResult, number: int) -> None:
    group, photograph = agreement.groups[number], agreement.photographs[number]
    values = result.predicted.values[number]
    for place, ends in enumerate(score_intervals(agreement, number)):
        x, y = float(values[place]), float(group.scores[place])
        if not np.isfinite(x):
            continue
        if ends is not None and np.isfinite(ends).all():
            axes.plot([x, x], ends, color=INK, linewidth=1.1, solid_capstyle="butt", zorder=2)
        same = same_class(group, photograph, place)
        if group.stimuli[place] == photograph:
            axes.plot(x, y, "*", color=DEEP, markersize=12, zorder=4)
        else:
            face = "#9aa3ab" if same is None else SAME if same else OTHER
            axes.plot(x, y, "o", color=face, markeredgecolor=INK, markersize=6.5, zorder=3)
        if len(group.stimuli) <= MOST_NAMED:
            axes.annotate(
                short(group.stimuli[place], 14),
                (x, y),
                xytext=(5, 3),
                textcoords="offset points",
                fontsize=6.5,
                color=INK,
            )
    if result.predicted.limit is not None:
        axes.axvline(result.predicted.limit, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
    axes.margins(0.12)
    if group.name:
        axes.set_title(short(group.name), fontsize=10, fontweight="bold", loc="left", color=INK)
    axes.set_ylabel(f"score ({group.unit})", fontsize=9, color=INK)
    axes.tick_params(colors=INK, labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)


def draw_limits(agreement: Agreement, result: MeasureResult, calibration: LimitCheck, width_in: float) -> Drawing:
    """Draw the stimuli of both sorts along the measure, the limit and the one that agrees best; and the curve."""
    one = result.predicted
    with drawing(f"{one.name} limits", width_in, 2.5 if width_in > 5 else 4.6) as (figure, axes):
        axes.remove()
        wide = width_in > 5
        left, right = figure.subplots(*((1, 2) if wide else (2, 1)), width_ratios=[1.7, 1] if wide else None)
        for panel in (left, right):
            panel.patch.set_alpha(0)
            panel.tick_params(colors=INK, labelsize=8)
            panel.spines[["top", "right"]].set_visible(False)
        _strip(left, agreement, result, calibration)
        alarms = [100 * point[1] for point in calibration.curve]
        hits = [100 * point[2] for point in calibration.curve]
        right.plot([0, 100], [0, 100], color=FAINT, linewidth=1)
        right.plot(alarms, hits, color=DEEP, linewidth=1.6, marker="o", markersize=3)
        right.set_xlabel("false alarms (%)", fontsize=9, color=INK)
        right.set_ylabel("hits (%)", fontsize=9, color=INK)
        return drawn(figure, f"{one.title} and the photograph's class")


def _strip(axes: Axes, agreement: Agreement, result: MeasureResult, calibration: LimitCheck) -> None:
    one = result.predicted
    rows: tuple[list[float], list[float]] = ([], [])
    for number, (group, photograph) in enumerate(zip(agreement.groups, agreement.photographs, strict=True)):
        for place, stimulus in enumerate(group.stimuli):
            same = same_class(group, photograph, place)
            if same is not None and stimulus != photograph and np.isfinite(one.values[number][place]):
                rows[0 if same else 1].append(float(one.values[number][place]))
    if calibration.best_low is not None and calibration.best_high is not None:
        axes.axvspan(calibration.best_low, calibration.best_high, color=DEEP, alpha=0.15, linewidth=0)
    if calibration.best is not None:
        axes.axvline(calibration.best, color=DEEP, linewidth=1.6)
    if one.limit is not None:
        axes.axvline(one.limit, color=INK, linewidth=1.0, linestyle=(0, (4, 3)))
    for row, face in enumerate((SAME, OTHER)):
        axes.plot(rows[row], _spread(rows[row], row), "o", color=face, markeredgecolor=INK, markersize=6.5)
    axes.set_yticks([0, 1], ["photograph's\nclass", "another\nclass"])
    axes.set_ylim(1.5, -0.5)
    axes.set_xlabel(one.title + (f" ({one.unit})" if one.unit else ""), fontsize=9, color=INK)


def _spread(values: Sequence[float], row: int) -> list[float]:
    """Return heights at which dots of one row that lie together can be told apart."""
    return [row + 0.12 * ((place % 5) - 2) / 2 for place in range(len(values))]
