"""Paired comparisons: scores, classes, counts, and diagnostics."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.observers.concordance import Concordance
from analysis.observers.responses import catch_results
from analysis.report.blocks import Cell, Column, Facts, Figure, Matrix, MatrixCell, Paragraph, Section, Table
from analysis.report.figures import classes_svg, scores_svg
from analysis.report.summary import Summary
from analysis.report.words import fixed, p_words, percent
from analysis.scaling.fitting import fit_model
from analysis.scaling.result import Fit
from analysis.scaling.scores import Scores
from analysis.scaling.terminal import Published
from documents.pages import NARROW_IN, WIDE_IN


def scores_section(summary: Summary, published: Published) -> Section:
    """Return the scores: a figure like the thesis's Figure 4.18 [Medina2016], and the table."""
    estimate = summary.estimate
    interval = (
        "95 % intervals by bootstrap over observers"
        if estimate.interval_kind != "model"
        else "95 % intervals that treat all answers as independent"
    )
    caption = (
        f"{_method_words(summary)} on a logarithmic scale, best at the top, with {interval}. Colour and number give "
        "the perceptual class: stimuli that share a class do not differ significantly."
    )
    figure = Figure(scores_svg(summary, WIDE_IN), scores_svg(summary, NARROW_IN), caption)
    clustered = "the sandwich clustered by observer" if estimate.covariance == "sandwich" else "the model"
    explanation = (
        "A score is the stimulus's share of 1: of two stimuli with scores a and b, the first is chosen with "
        f"probability a / (a + b). The standard error is that of the centred log strength, in nats, by {clustered}."
    )
    return Section("scores", "Scores", (figure, _table(summary, published), Paragraph(explanation, small=True)))


def _method_words(summary: Summary) -> str:
    return {
        "ml": "Bradley-Terry scores",
        "firth": "Bradley-Terry scores (Firth's penalised fit)",
        "learnt_prior": "Bradley-Terry scores (posterior under a prior learnt from the answers)",
    }[summary.estimate.method]


def _table(summary: Summary, published: Published) -> Table:
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
    rows = []
    for item, (low, high) in zip(summary.scores.items, summary.log10_interval.tolist(), strict=True):
        row: list[Cell] = [item.name, item.label, item.score, item.log10_score, (_finite(low), _finite(high))]
        row += [item.se, item.wins, item.comparisons]
        if published:
            row += list(published.get(item.name, (None, None)))
        rows.append(tuple(row))
    return Table("scores", "Scores, best first", tuple(columns), tuple(rows))


def classes_section(summary: Summary, adjustment: str) -> Section | None:
    """Return the classes as bars over the stimuli, with how stable they are; None without classes."""
    scores, stability = summary.scores, summary.estimate.stability
    if scores.classes is None:
        return None
    errors = (
        f"standard errors clustered by observer, Student's t with {summary.estimate.df} degrees of freedom"
        if summary.estimate.covariance == "sandwich"
        else "the model's standard errors, which treat all answers as independent"
    )
    caption = (
        f"Each bar is a class: stimuli on the same bar do not differ at level {summary.alpha:g} ({adjustment}; "
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
    figure = Figure(classes_svg(summary, WIDE_IN), classes_svg(summary, NARROW_IN), caption, table)
    words = []
    if stability is not None:
        counts = sorted(stability.class_counts.items(), key=lambda entry: -entry[1])
        total = sum(stability.class_counts.values())
        frequencies = ", ".join(f"{number} in {percent(times / total)}" for number, times in counts[:4])
        words.append(Paragraph(f"Number of classes over the bootstrap samples: {frequencies}.", small=True))
    return Section("classes", "Perceptual classes", (figure, *words))


def _rows(cells: list[list[Cell]]) -> tuple[tuple[Cell, ...], ...]:
    return tuple(tuple(row) for row in cells)


def _finite(value: float) -> float | None:
    return None if math.isnan(value) else value


def fit_words(summary: Summary) -> str:
    """Return the goodness of fit in words."""
    fit = summary.scores.fit
    if summary.fit_p is None:
        return "Not available."
    p = "< 0.001" if summary.fit_p < 0.001 else f"= {fixed(summary.fit_p, 3)}"
    verdict = (
        "The answers are not compatible with a single scale: interpret the scores with care."
        if summary.fit_p < 0.05
        else "The answers are compatible with a single scale."
    )
    return f"Deviance {fixed(fit.deviance, 1)} on {fit.df} degrees of freedom, p {p}. {verdict}"


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
    # From white (never) to a deep blue-green (always), in evenly darker steps that also work in grey.
    red, green, blue = (round(255 + share * (deep - 255)) for deep in (22, 84, 102))
    title = f"{items[row]} over {items[column]}: {wins:g} of {total:g}"
    return MatrixCell(f"{wins:g}", title, f"rgb({red},{green},{blue})", dark=share > 0.55)


def belief_section(summary: Summary, agreement: Concordance | None) -> Section:
    """Return the diagnostics of the scores."""
    comparisons = summary.scores.comparisons
    simulated = " (simulated)" if summary.simulated else ""
    sessions = f"{len(summary.sessions)} session{'' if len(summary.sessions) == 1 else 's'}"
    rows = [
        ("Observers", f"{len(summary.observers)}{simulated}, in {sessions}"),
        ("Comparisons", f"{summary.trials:,}" + (f", and {comparisons.ties:g} ties" if comparisons.ties else "")),
        ("Goodness of fit", fit_words(summary)),
    ]
    rows += _sides(summary)
    rows += _ties(summary)
    if agreement is not None:
        rows.append(("Agreement", agreement_words(agreement)))
    caught = catch_results(summary.sessions)
    if caught.obvious:
        missed = sum(wrong for wrong, _ in caught.missed.values())
        rows.append(
            ("Catch trials", f"{caught.obvious - missed} of {caught.obvious} obvious trials answered correctly.")
        )
    rows.append(("Response time", f"Median {fixed(summary.response_time_s, 2)} s"))
    return Section("belief", "Diagnostics", (Facts(tuple(rows)),))


def agreement_words(agreement: Concordance) -> str:
    """Return the agreement between observers and its test, in words."""
    words = f"Kendall's u = {fixed(agreement.u, 3)} between {agreement.observers} observers"
    if agreement.strangers_p is not None:
        return f"{words}; test against unrelated preferences: {p_words(agreement.strangers_p)}."
    if agreement.chance is not None:
        return f"{words}; test against random answers: {p_words(agreement.chance.p)}."
    return f"{words}."


def _sides(summary: Summary) -> list[tuple[str, str]]:
    if summary.first_share is None or summary.first_share_interval is None:
        return []
    low, high = summary.first_share_interval
    words = (
        f"{percent(summary.first_share, 1)} of the answers chose the position “{first_position(summary)}” "
        f"(95 %: {fixed(100 * low, 1)} to {fixed(100 * high, 1)})."
    )
    ordered = order_fit(summary)
    if ordered is not None and ordered.order_test is not None:
        effect = ordered.parameters[-1]
        if effect.factor is not None:
            value, least, most = effect.factor
            words += (
                f" In the model with an order effect, this position multiplies the odds by {fixed(value, 2)} "
                f"({fixed(least, 2)} to {fixed(most, 2)}); likelihood-ratio test {p_words(ordered.order_test.p)}."
            )
    return [("Side or order", words)]


def order_fit(summary: Summary) -> Fit | None:
    """Return the fit with an order effect; None where it cannot be fitted."""
    if summary.estimate.method != "ml" or summary.estimate.plain.separated:
        return None
    try:
        fitted = fit_model(summary.scores.comparisons, order_effect=True, covariance=summary.estimate.covariance)
    except ResultsError:
        return None
    return fitted if fitted.separation is None else None


def _ties(summary: Summary) -> list[tuple[str, str]]:
    comparisons = summary.scores.comparisons
    if not comparisons.ties:
        return []
    share = comparisons.ties / (comparisons.ties + float(comparisons.count.sum()))
    words = f"{percent(share, 1)} of the answers are ties; the scores leave them out."
    tied = tie_fit(summary)
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


def first_position(summary: Summary) -> str:
    """Return the name of the first position."""
    for session in summary.sessions:
        for trial in session.trials:
            if "first_position" in trial.data:
                return str(trial.data["first_position"])
    return "first"
