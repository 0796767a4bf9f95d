"""Thresholds: psychometric functions fitted to each observer's answers, and means over observers."""

from __future__ import annotations

from analysis.report.psychometric import MOST_PANELS, draw_psychometric
from analysis.report.series import words
from analysis.thresholds.summary import ObserverThreshold, QuestionSummary, ThresholdSummary
from documents.figures import NARROW_IN, WIDE_IN
from documents.pages import Block, Cell, Column, Figure, Interval, Paragraph, Section, Table


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
    axis = words(own.factor)
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
        where.append("for the Weibull function at 63 %")
    if functions & {"logistic", "normal"}:
        where.append("for the logistic and the normal function at 50 %")
    return (
        "A threshold is the level at which, of what guesses and lapses leave, that share is seen: "
        f"{', '.join(where)}. Each observer's numbers are medians, of rates means, of the posterior with 95 % "
        "intervals of equal tails; slopes are per unit of the axis, decimal logarithms of the level where it is "
        "logarithmic. The guess rate of a forced choice is given, that of yes or no (false alarms) is estimated. "
        "Thresholds that answers cannot tell have no number but a reason."
    )
