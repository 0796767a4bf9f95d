"""Paired comparisons: scores, classes, counts, and diagnostics."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from analysis.classes.multiplicity import ADJUSTMENT_NAMES
from analysis.errors import ResultsError
from analysis.kinds.pair import PairRecord
from analysis.observers.concordance import Concordance
from analysis.observers.responses import catch_results
from analysis.report.agreement import agreement_words
from analysis.report.figures import ROW_IN, draw_classes, draw_scores
from analysis.report.summary import ReportSummary, Summary
from analysis.report.words import COVARIANCE_WORDS, fixed, percent
from analysis.scaling.fitting import fit_model
from analysis.scaling.result import Fit, OrderTest
from analysis.scaling.scores import Scores
from analysis.scaling.shown import Published
from documents.figures import FAINT, INK, NARROW_IN, WIDE_IN, Drawing, class_colours, drawing, drawn, rows_only, short
from documents.pages import Cell, Column, Facts, Figure, Matrix, MatrixCell, Paragraph, Section, Table

# The significance figure of graphics papers: stimuli by score, those that are not distinguished joined.
#
# Each stimulus is a triangle at its score, best at the top, as the ranking triangles of [PerezOrtiz2017] stand on their
# axis. Below the axis there is a line for each class: it joins the stimuli between which no difference is significant.

MOST_LINES = 12
"""Classes up to which the figure is drawn; nobody reads more lines below one axis."""
_LINE_ROWS = 0.7  # between two lines, in rows


def draws_ranking(summary: Summary) -> bool:
    """Return whether there is something to draw: classes, not too many, and a score of every stimulus."""
    classes = summary.scores.classes
    scored = all(item.log10_score is not None for item in summary.scores.items)
    return classes is not None and len(classes.members) <= MOST_LINES and scored


def draw_ranking(summary: Summary, width_in: float) -> Drawing:
    """Draw a triangle for each stimulus at its log10 score, and a line for each class with a dot at each member.

    A stimulus between the ends of a line that has no dot on it is not of its class. A class of one stimulus is its
    dot alone.
    """
    scores = summary.scores
    classes = scores.classes
    assert classes is not None
    items = scores.items
    at = [float(item.log10_score or 0.0) for item in items]
    place = {item: row for row, item in enumerate(scores.order)}
    rows = len(items) + 0.2 + _LINE_ROWS * len(classes.members)
    with drawing("ranking", width_in, 0.75 + ROW_IN * rows) as (figure, axes):
        axes.vlines(at, range(len(items)), rows - 0.4, color=FAINT, linewidth=0.7, zorder=1)
        axes.scatter(at, range(len(items)), s=70, marker="v", color=INK, linewidths=0, zorder=4)
        ticks = []
        for number, members in enumerate(classes.members):
            line = len(items) + 0.2 + _LINE_ROWS * number
            (colour,) = class_colours(str(number + 1))
            dots = sorted(at[place[item]] for item in members)
            axes.plot([dots[0], dots[-1]], [line, line], color=colour, linewidth=3.5, solid_capstyle="butt", zorder=2)
            axes.plot(dots, [line] * len(dots), "o", color="white", markeredgecolor=INK, markersize=5, zorder=3)
            ticks.append(line)
        axes.set_yticks(
            [*range(len(items)), *ticks],
            [*(short(item.name) for item in items), *(f"class {number + 1}" for number in range(len(ticks)))],
        )
        axes.yaxis.set_label_coords(0.0, 0.5)
        axes.set_ylim(rows - 0.4, -0.6)
        axes.set_xlabel("log₁₀ score", color=INK)
        rows_only(axes, 0)
        return drawn(figure, f"Ranking of {len(items)} stimuli, with lines that join those not significantly different")


Pictures = Mapping[str, str]


def scores_section(summary: Summary, published: Published, pictures: Pictures = MappingProxyType({})) -> Section:
    """Return the scores: a figure like the thesis's Figure 4.18 [Medina2016], the table, and which differ."""
    caption = score_caption(summary, "best at the top")
    figure = Figure("scores", draw_scores(summary, WIDE_IN), draw_scores(summary, NARROW_IN), caption)
    table = score_table(summary, published, pictures=pictures)
    return Section("scores", "Scores", (figure, table, score_explanation(summary), *ranking_figure(summary)))


def ranking_figure(summary: Summary) -> tuple[Figure, ...]:
    """Return the significance figure: stimuli by score, joined where not distinguished; nothing without classes."""
    classes = summary.scores.classes
    if classes is None or not draws_ranking(summary):
        return ()
    caption = (
        "Ranking: each triangle is a stimulus at its score. A line joins stimuli that are not distinguished at level "
        f"{summary.alpha:g}. A stimulus that a line passes without a dot is distinguished from some that it joins."
    )
    return (Figure("ranking", draw_ranking(summary, WIDE_IN), draw_ranking(summary, NARROW_IN), caption),)


def score_caption(summary: Summary, order: str) -> str:
    """Return the caption of a figure of scores."""
    interval = (
        "95 % intervals that treat all answers as independent"
        if summary.estimate.covariance == "model"
        else "95 % intervals over observers"
    )
    return (
        f"{_method_words(summary)} on a logarithmic scale, {order}, with {interval}. Colour and number give "
        "the perceptual class: stimuli that share a class are not distinguished, which is no proof that they are equal."
    )


def score_explanation(summary: Summary) -> Paragraph:
    """Return what a score and its standard error are."""
    words = (
        "A score is the stimulus's share of 1: of two stimuli with scores a and b, the first is chosen with "
        "probability a / (a + b). The standard error is that of the centred log strength, in nats, by "
        f"{COVARIANCE_WORDS[summary.estimate.covariance]}."
    )
    if summary.beside is not None:
        words += f" The settings beside, which the experiment names: {beside_words(summary.beside)}."
    return Paragraph(words, small=True)


def beside_words(scores: Scores) -> str:
    """Return the settings of classes, in words."""
    classes = scores.classes
    tests = f"level {classes.alpha:g}, {ADJUSTMENT_NAMES[classes.adjust]}, " if classes else ""
    return f"{tests}standard errors by {COVARIANCE_WORDS[scores.fit.covariance_kind]}"


def _method_words(summary: Summary) -> str:
    return {
        "ml": "Bradley-Terry scores",
        "firth": "Bradley-Terry scores (Firth's penalised fit)",
        "learnt_prior": "Bradley-Terry scores (posterior under a prior learnt from the answers)",
    }[summary.estimate.method]


def score_table(
    summary: Summary,
    published: Published,
    name: str = "scores",
    title: str = "Scores, best first",
    *,
    pictures: Pictures = MappingProxyType({}),
    folded: bool = False,
) -> Table:
    """Return the scores, best first; ``folded`` is for a table that a reader may want to open."""
    columns = [
        Column("Stimulus", "stimulus"),
        Column("Class", "class", "class"),
        Column("Score", "score", "number", 4),
        Column("log₁₀", "log10_score", "number", 3),
        Column("95 % interval", "log10_score", "interval", 2),
        Column("s.e. (nats)", "se_nats", "number", 3),
        Column("Wins", "wins", "number", 0),
        Column("of", "comparisons", "number", 0),
    ]
    if published:
        columns += [
            Column("Published score", "published_score", "number", 4),
            Column("Class", "published_class", "class"),
        ]
    beside = {item.name: item.label for item in summary.beside.items} if summary.beside else {}
    if beside:
        columns.append(Column("Class by the settings beside", "class_beside", "class"))
    rows = []
    for item, (low, high) in zip(summary.scores.items, summary.log10_interval.tolist(), strict=True):
        row: list[Cell] = [item.name, item.label, item.score, item.log10_score, (_finite(low), _finite(high))]
        row += [item.se, item.wins, item.comparisons]
        if published:
            row += list(published.get(item.name, (None, None)))
        row += [beside[item.name]] if beside else []
        rows.append(tuple(row))
    return Table(name, title, tuple(columns), tuple(rows), folded, pictures)


def classes_section(summary: Summary, adjustment: str, warning: str = "") -> Section | None:
    """Return the classes as bars over the stimuli, with how stable they are; None without classes.

    ``warning`` names the conclusions that most other analyses contradict, and stands first.
    """
    scores, stability = summary.scores, summary.estimate.stability
    if scores.classes is None:
        return None
    errors = summary.estimate.error_words
    caption = (
        f"Each bar is a class: stimuli on the same bar are not distinguished at level {summary.alpha:g} ({adjustment}; "
        f"{errors})."
    )
    names = [item.name for item in scores.items]
    columns = [Column("Stimulus", "stimulus"), Column("Class", "class", "class")]
    cells: list[list[Cell]] = [[item.name, item.label] for item in scores.items]
    if stability is not None:
        caption += (
            " Between the rows: share of "
            f"{stability.replicates - stability.without_fit:,} bootstrap samples in which the two share a class."
        )
        place = {name: index for index, name in enumerate(stability.items)}
        columns += [
            Column("Most frequent class", "most_frequent_class", "class"),
            Column("its share", "most_frequent_share", "number", 2),
        ]
        columns += [Column(name, f"with {name}", "number", 2) for name in names]
        for row, name in zip(cells, names, strict=True):
            own = place[name]
            row += [stability.labels[own], stability.label_shares[own]]
            row += [float(stability.shared[own, place[other]]) for other in names]
    table = Table(
        "classes",
        "Classes, and the share of bootstrap samples in which two stimuli share a class",
        tuple(columns),
        _rows(cells),
    )
    figure = Figure("classes", draw_classes(summary, WIDE_IN), draw_classes(summary, NARROW_IN), caption, table)
    words = []
    if stability is not None:
        counts = sorted(stability.class_counts.items(), key=lambda entry: -entry[1])
        total = sum(stability.class_counts.values())
        frequencies = ", ".join(f"{number} in {percent(times / total)}" for number, times in counts[:4])
        words.append(Paragraph(f"Number of classes over the bootstrap samples: {frequencies}.", small=True))
    first = (Paragraph(warning),) if warning else ()
    return Section("classes", "Perceptual classes", (*first, figure, *words))


def _rows(cells: list[list[Cell]]) -> tuple[tuple[Cell, ...], ...]:
    return tuple(tuple(row) for row in cells)


def _finite(value: float) -> float | None:
    return None if math.isnan(value) else value


def fit_words(summary: Summary) -> str:
    """Return the goodness of fit in words."""
    fits = summary.one_scale
    if fits is None:
        penalised = summary.estimate.method != "ml"
        return "Not tested: a penalised fit or a prior was used." if penalised else "Not available."
    found = fits.conclusion
    care = " Interpret the scores with care." if found.verdict == "distinguished" else ""
    statistic = f"Pearson's χ² = {fixed(fits.statistic, 1)} on {fits.df} degrees of freedom"
    return f"{statistic}; {found.sentence}{care}"


MOST_DRAWN = 40  # stimuli up to which all pairs fit a page


def counts_section(summary: Summary) -> Section:
    """Return the comparison matrix: best first both ways."""
    scores = summary.scores
    wins = scores.comparisons.wins
    names = [scores.comparisons.items[index] for index in scores.order]
    shown = tuple(
        (name, tuple(None if row == column else _matrix_cell(scores, wins, row, column) for column in scores.order))
        for name, row in zip(names, scores.order, strict=True)
    )
    numbers: tuple[tuple[Cell, ...], ...] = tuple(
        (name, *(None if row == column else float(wins[row, column]) for column in scores.order))
        for name, row in zip(names, scores.order, strict=True)
    )
    columns = (Column("Preferred", "preferred"), *(Column(name, f"over {name}", "number") for name in names))
    table = Table("comparisons", "Comparison matrix", columns, numbers)
    words = Paragraph(
        "Each cell is how often the stimulus of its row was preferred over that of its column; a darker cell is a "
        "larger share of the pair's comparisons.",
        small=True,
    )
    matrix = Matrix("Comparison matrix", shown, table, folded=len(names) > MOST_DRAWN)
    return Section("comparisons", "Comparison matrix", (matrix, words))


def _matrix_cell(scores: Scores, counts: NDArray[np.float64], row: int, column: int) -> MatrixCell:
    items = scores.comparisons.items
    wins, total = float(counts[row, column]), float(counts[row, column] + counts[column, row])
    if not total:
        return MatrixCell("–", "never compared", "transparent", dark=False)
    share = wins / total
    title = f"{items[row]} over {items[column]}: {wins:g} of {total:g}"
    return MatrixCell(f"{wins:g}", title, _rgb(share), dark=share >= WHITE_FROM)


@lru_cache(maxsize=1000)
def _rgb(share: float) -> str:
    red, green, blue = tint(share)
    return f"rgb({red},{green},{blue})"


WHITE_FROM = 0.76  # share from which white letters have more contrast than black ones


def tint(share: float) -> tuple[int, int, int]:
    """Return the colour of a cell, from white (never) to a deep blue-green (always), evenly darker, also in grey."""
    red, green, blue = (round(255 + share * (deep - 255)) for deep in (22, 84, 102))
    return red, green, blue


def belief_section(summary: Summary, agreement: Concordance | None) -> Section:
    """Return the diagnostics of the scores."""
    return Section("belief", "Diagnostics", (Facts(diagnostics(summary, summary, agreement)),))


def diagnostics(
    whole: ReportSummary, scale: Summary | None, agreement: Concordance | None
) -> tuple[tuple[str, str], ...]:
    """Return the diagnostics of the ``whole``; ``scale`` is the one that all its answers are on, if there is one."""
    comparisons = whole.comparisons
    sessions = f"{len(whole.sessions)} session{'' if len(whole.sessions) == 1 else 's'}"
    rows = [
        ("Observers", f"{whole.who.words(whole.observers)}, in {sessions}"),
        ("Comparisons", f"{whole.trials:,}" + (f", and {comparisons.ties:g} ties" if comparisons.ties else "")),
    ]
    if scale is not None:
        rows.append(("Goodness of fit", fit_words(scale)))
    if whole.smallest is not None:
        rows.append(("Smallest difference found", f"{whole.smallest.sentence} {whole.smallest.assumed}"))
    rows += _sides(whole, scale)
    rows += _ties(whole, scale)
    if agreement is not None:
        rows.append(("Agreement", agreement_words(agreement)))
    caught = catch_results(whole.sessions)
    if caught.obvious:
        missed = sum(wrong for wrong, _ in caught.missed.values())
        rows.append(
            ("Catch trials", f"{caught.obvious - missed} of {caught.obvious} obvious trials answered correctly.")
        )
    rows.append(("Response time", f"Median {fixed(whole.response_time_s, 2)} s"))
    return tuple(rows)


def _sides(whole: ReportSummary, scale: Summary | None) -> list[tuple[str, str]]:
    if whole.first_share is None or whole.first_share_interval is None:
        return []
    low, high = whole.first_share_interval
    words = (
        f"{percent(whole.first_share, 1)} of the answers chose the position “{first_position(whole)}” "
        f"(95 %: {fixed(100 * low, 1)} to {fixed(100 * high, 1)})."
    )
    ordered = order_fit(scale) if scale is not None else None
    if ordered is not None and ordered.order_test is not None:
        effect = ordered.parameters[-1]
        if effect.factor is not None:
            value, least, most = effect.factor
            words += (
                f" In the model with an order effect, this position multiplies the odds by {fixed(value, 2)} "
                f"({fixed(least, 2)} to {fixed(most, 2)}); {order_words(ordered.order_test)}."
            )
    return [("Side or order", words)]


def order_words(test: OrderTest) -> str:
    """Return the test of no order effect in words, without a full stop."""
    return test.conclusion.sentence.rstrip(".")


def order_fit(summary: Summary) -> Fit | None:
    """Return the fit with an order effect; None where it cannot be fitted."""
    if summary.estimate.method != "ml" or summary.estimate.plain.separated:
        return None
    try:
        fitted = fit_model(summary.scores.comparisons, order_effect=True, covariance=summary.estimate.covariance)
    except ResultsError:
        return None
    return fitted if fitted.separation is None else None


def _ties(whole: ReportSummary, scale: Summary | None) -> list[tuple[str, str]]:
    comparisons = whole.comparisons
    if not comparisons.ties:
        return []
    share = comparisons.ties / (comparisons.ties + float(comparisons.count.sum()))
    words = f"{percent(share, 1)} of the answers are ties; the scores leave them out."
    tied = tie_fit(scale) if scale is not None else None
    if tied is not None and tied.parameters[0].factor is not None:
        value, low, high = tied.parameters[0].factor
        words += f" Davidson's ν = {fixed(value, 2)} ({fixed(low, 2)} to {fixed(high, 2)})."
    return [("Ties", words)]


def tie_fit(summary: Summary) -> Fit | None:
    """Return Davidson's fit of ties; None without ties, or where it has no maximum."""
    if not summary.scores.comparisons.ties:
        return None
    try:
        fitted = fit_model(summary.scores.comparisons, "davidson", covariance=summary.estimate.covariance)
    except ResultsError:
        return None
    return fitted if fitted.separation is None else None


def first_position(whole: ReportSummary) -> str:
    """Return the name of the first position."""
    for session in whole.sessions:
        for trial in session.trials:
            if isinstance(trial, PairRecord) and trial.first_position is not None:
                return trial.first_position
    return "first"
