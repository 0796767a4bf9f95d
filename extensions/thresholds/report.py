"""Thresholds: psychometric functions fitted to each observer's answers, and means over observers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from analysis.records import SessionLog
from analysis.report import Citations, Part, as_words, draws_of_means, listed
from documents.figures import DEEP, FAINT, INK, NARROW_IN, WIDE_IN, Drawing, drawing, drawn, short
from documents.pages import Block, Cell, Column, Figure, Interval, Paragraph, Section, Table
from extensions.thresholds.fit import ThresholdFit
from extensions.thresholds.record import ThresholdRecord
from extensions.thresholds.summary import ObserverThreshold, QuestionSummary, ThresholdSummary, summarise_thresholds

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The figure of thresholds: the data of each observer as blobs, and the fitted psychometric function.

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


_METHODS = {
    "quest_plus": ("QUEST+ {}", "Watson2017"),
    "staircase": ("weighted up-down staircases {}", "Kaernbach1991"),
}
_FUNCTIONS = {"weibull": "Weibull", "logistic": "logistic", "normal": "cumulative normal"}


def thresholds_part(sessions: Sequence[SessionLog]) -> Part | None:
    """Return what a report says of thresholds; None without any."""
    trials = [trial for session in sessions for trial in session.of(ThresholdRecord)]
    if not trials:
        return None
    summary = summarise_thresholds(sessions)
    return Part(
        key="thresholds",
        result=summary.questions,
        sentences=(summary.sentence,),
        notes=summary.notes,
        sections=lambda _: (thresholds_section(summary),),
        analysis=lambda cited: _analysis(trials, cited),
        draws=(draws_of_means(),),
        effects="Effect sizes of thresholds are the thresholds in units of their factor, with 95 % intervals.",
    )


def _analysis(trials: Sequence[ThresholdRecord], cited: Citations) -> str:
    """Say how levels were chosen, and how thresholds were estimated."""
    methods, functions = {trial.method for trial in trials}, {trial.function for trial in trials}
    by = listed(words.format(cited.cite(work)) for method, (words, work) in _METHODS.items() if method in methods)
    return (
        f"Levels were chosen by {by}. Thresholds, slopes and rates are those of the "
        f"{listed(name for key, name in _FUNCTIONS.items() if key in functions)} function, of each "
        f"observer from the posterior over a grid of parameters {cited.cite('Schutt2016')}; means over observers have "
        "percentile intervals by bootstrap over observers, at levels widened for few observers "
        f"{cited.cite('Hesterberg2015')}."
    )


def thresholds_section(summary: ThresholdSummary) -> Section:
    """Return the means over observers, and for each question a figure with each observer's numbers."""
    blocks: list[Block] = [_means(summary)]
    blocks += [_figure(question, number) for number, question in enumerate(summary.questions)]
    blocks.append(Paragraph(_explained(summary), small=True))
    return Section("thresholds", "Thresholds", tuple(blocks))


def _columns(first: Column, *, false_alarms: bool) -> tuple[Column, ...]:
    return (
        first,
        Column("Threshold", "threshold", "number", 4),
        Column("95 %", "threshold", "interval", 4),
        Column("Slope", "slope", "number", 2),
        Column("95 %", "slope", "interval", 2),
        Column("Lapse rate", "lapse", "number", 3),
        Column("95 %", "lapse", "interval", 3),
        Column("Guess rate", "guess", "number", 3),
        *((Column("95 %", "guess", "interval", 3),) if false_alarms else ()),
    )


def _means(summary: ThresholdSummary) -> Table:
    false_alarms = any(question.question.task == "yes_no" for question in summary.questions)
    columns = (
        *_columns(Column("Threshold of", "question"), false_alarms=false_alarms),
        Column("Observers", "observers", "number"),
        Column("of", "of", "number"),
    )
    rows = []
    for question in summary.questions:
        cells: list[Cell] = [_title(question, summary)]
        for estimate in (question.threshold, question.slope, question.lapse, question.guess):
            cells += [estimate.value, (estimate.low, estimate.high)]
        cells = cells if false_alarms else cells[:-1]
        rows.append((*cells, question.threshold.observers, len(question.observers)))
    title = "Means over the observers whose threshold can be estimated, with 95 % intervals by bootstrap over them"
    return Table("thresholds", title, columns, tuple(rows))


_TASKS = {"yes_no": "yes or no", "two_intervals": "two intervals", "two_places": "two places"}
_SHARES = {"yes_no": "“yes”", "two_intervals": "right answers", "two_places": "right answers"}
_FUNCTIONS = {"weibull": "Weibull function", "logistic": "logistic function", "normal": "cumulative normal function"}


def _figure(question: QuestionSummary, number: int) -> Figure:
    own, fits = question.question, question.observers
    axis = as_words(own.factor)
    panels = [(f"observer {each.observer}", each.fit) for each in fits]
    images = [draw_psychometric(panels, axis, width) for width in (WIDE_IN, NARROW_IN)]
    reasons = any(each.fit.reason for each in fits)
    columns = (
        *_columns(Column("Observer", "observer"), false_alarms=own.task == "yes_no"),
        Column("Trials", "trials", "number"),
        *((Column("Not estimated because", "reason"),) if reasons else ()),
    )
    rows = tuple(
        _row(each, false_alarms=own.task == "yes_no") + ((each.fit.reason or None,) if reasons else ()) for each in fits
    )
    name = f"thresholds_{number + 1}"
    title = f"Threshold of {own.name}: {_TASKS[own.task]}, {_FUNCTIONS[own.function]}"
    caption = f"{title}. Shares of {_SHARES[own.task]} by level; the area of a blob is the number of trials."
    if len(panels) > MOST_PANELS:
        caption += f" The first {MOST_PANELS} of {len(panels)} observers are drawn."
    return Figure(name, images[0], images[1], caption, Table(name, title, columns, rows))


def _row(each: ObserverThreshold, *, false_alarms: bool) -> tuple[Cell, ...]:
    fit = each.fit
    none: Interval = (None, None)
    cells: tuple[Cell, ...] = (each.observer, fit.threshold, fit.threshold_interval or none)
    cells += (fit.slope, fit.slope_interval or none, fit.lapse, fit.lapse_interval or none, fit.guess)
    if false_alarms:
        cells += (fit.guess_interval or none,)
    return (*cells, sum(fit.trials) + fit.blanks[1])


def _title(question: QuestionSummary, summary: ThresholdSummary) -> str:
    """Return the question's name, with what differs where another has the same name."""
    own = question.question
    alike = [each.question for each in summary.questions if each.question.name == own.name]
    parts = (
        ({each.task for each in alike}, _TASKS[own.task]),
        ({each.function for each in alike}, _FUNCTIONS[own.function]),
        ({each.easier for each in alike}, f"{own.easier} levels easier"),
    )
    more = [said for values, said in parts if len(values) > 1]
    return f"{own.name} ({', '.join(more)})" if more else own.name


def _explained(summary: ThresholdSummary) -> str:
    functions = {question.question.function for question in summary.questions}
    where = []
    if "weibull" in functions:
        where.append("63 % by the Weibull function")
    if functions & {"logistic", "normal"}:
        where.append("50 % by the logistic and the normal function")
    return (
        "A threshold is the level that is seen in this share of trials, once guesses and lapses are taken off: "
        f"{', '.join(where)}. Each observer's numbers are medians, of rates means, of the posterior with 95 % "
        "intervals of equal tails; slopes are per unit of the axis, decimal logarithms of the level where it is "
        "logarithmic. The guess rate of a forced choice is given, that of yes or no (false alarms) is estimated. "
        "Thresholds that answers cannot tell have no number but a reason."
    )
