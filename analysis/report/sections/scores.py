"""Scores and classes of paired comparisons."""

from __future__ import annotations

import math

from analysis.report.blocks import Cell, Column, Figure, Paragraph, Section, Table
from analysis.report.class_diagram import classes_svg
from analysis.report.figure import scores_svg
from analysis.report.summary import Summary
from analysis.report.words import fixed, percent
from analysis.scaling.terminal import Published
from documents.pages.drawing import NARROW_IN, WIDE_IN


def scores_section(summary: Summary, published: Published) -> Section:
    """Return the scores: a picture like the thesis's Figure 4.18 [Medina2016], and the table."""
    sure = summary.estimate
    interval = (
        "95 % intervals from observers drawn anew"
        if sure.interval_kind != "model"
        else "95 % intervals that take all answers for independent"
    )
    caption = (
        f"{_method_words(summary)} on a logarithmic scale, best at the top, with {interval}. Colour and number give "
        "the perceptual class: stimuli that share a class are not told apart."
    )
    figure = Figure(scores_svg(summary, WIDE_IN), scores_svg(summary, NARROW_IN), caption)
    clustered = "the differences between observers" if sure.covariance == "sandwich" else "the model"
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
    }[summary.estimate.way]


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
        row: list[Cell] = [item.name, item.label, item.score, item.log10_score, (_told(low), _told(high))]
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
        f"standard errors clustered by observer, Student's law with {summary.estimate.df} degrees of freedom"
        if summary.estimate.covariance == "sandwich"
        else "the model's standard errors, which take all answers for independent"
    )
    caption = (
        f"Each bar is a class: stimuli on the same bar are not told apart at level {summary.alpha:g} ({adjustment}; "
        f"{errors})."
    )
    names = [item.name for item in scores.items]
    columns = [Column("Stimulus", "stimulus"), Column("Class", "class", "class")]
    cells: list[list[Cell]] = [[item.name, item.label] for item in scores.items]
    if stability is not None:
        caption += (
            " Between the rows: in how many of "
            f"{stability.replicates - stability.without_fit:,} draws of observers the two share a class."
        )
        place = {name: index for index, name in enumerate(stability.items)}
        columns += [
            Column("Most frequent class", "most_frequent_class", "class"),
            Column("in draws", "most_frequent_share", "number", 2),
        ]
        columns += [Column(name, f"with {name}", "number", 2) for name in names]
        for row, name in zip(cells, names, strict=True):
            own = place[name]
            row += [stability.labels[own], stability.label_shares[own]]
            row += [float(stability.shared[own, place[other]]) for other in names]
    table = Table(
        "classes", "Classes, and the share of draws in which two stimuli share one", tuple(columns), _rows(cells)
    )
    figure = Figure(classes_svg(summary, WIDE_IN), classes_svg(summary, NARROW_IN), caption, table)
    words = []
    if stability is not None:
        counts = sorted(stability.class_counts.items(), key=lambda entry: -entry[1])
        total = sum(stability.class_counts.values())
        told = ", ".join(f"{number} in {percent(times / total)}" for number, times in counts[:4])
        words.append(Paragraph(f"Number of classes over the draws: {told}.", small=True))
    return Section("classes", "Perceptual classes", (figure, *words))


def _rows(cells: list[list[Cell]]) -> tuple[tuple[Cell, ...], ...]:
    return tuple(tuple(row) for row in cells)


def _told(value: float) -> float | None:
    return None if math.isnan(value) else value


def fit_words(summary: Summary) -> str:
    """Say how well one scale fits the answers."""
    fit = summary.scores.fit
    if summary.fit_p is None:
        return "Not available."
    p = "< 0.001" if summary.fit_p < 0.001 else f"= {fixed(summary.fit_p, 3)}"
    verdict = (
        "The answers depart from a single scale: read the scores with care."
        if summary.fit_p < 0.05
        else "The answers are compatible with one scale."
    )
    return f"Deviance {fixed(fit.deviance, 1)} on {fit.df} degrees of freedom, p {p}. {verdict}"
