"""Ratings of single stimuli: mean opinion scores."""

from __future__ import annotations

from analysis.ratings.ratings import RatingSummary, ScaleSummary
from analysis.report.blocks import Column, Figure, Section, Table
from analysis.report.dot_figure import dots_svg
from documents.pages.drawing import NARROW_IN, WIDE_IN


def ratings_section(summary: RatingSummary) -> Section:
    """Return a figure with its table for each scale, and how observers used it."""
    blocks: list[Figure | Table] = []
    for scale in summary.scales:
        blocks += [_scores(scale), _raters(scale)]
    return Section("ratings", "Ratings", tuple(blocks))


def _scores(scale: ScaleSummary) -> Figure:
    columns = (
        Column("Stimulus", "stimulus"),
        Column("Mean", "mean", "number", 2),
        Column("95 %", "mean", "interval", 2),
        Column("s.d.", "sd", "number", 2),
        Column("z", "z", "number", 2),
        Column("95 %", "z", "interval", 2),
        Column("Observers", "observers", "number"),
    )
    rows = tuple(
        (
            one.stimulus,
            one.mean,
            one.interval or (None, None),
            one.sd,
            one.z,
            one.z_interval or (None, None),
            one.observers,
        )
        for one in scale.scores
    )
    title = f"Mean opinion scores: {scale.scale}"
    dots = [(one.stimulus, one.mean, *(one.interval or (None, None))) for one in scale.scores]
    drawn = [dots_svg(dots, scale.scale, title, width) for width in (WIDE_IN, NARROW_IN)]
    caption = (
        f"{title}, each observer's mean counting once, with 95 % intervals by Student's t. z: in standard deviations "
        "of each observer's own ratings."
    )
    return Figure(drawn[0], drawn[1], caption, Table(f"ratings_{scale.scale}", title, columns, rows))


def _raters(scale: ScaleSummary) -> Table:
    columns = (
        Column("Observer", "observer"),
        Column("Ratings", "ratings", "number"),
        Column("Mean", "mean", "number", 2),
        Column("s.d.", "sd", "number", 2),
        Column("Far above", "above", "number"),
        Column("Far below", "below", "number"),
        Column("BT.500", "bt500"),
    )
    rows = tuple(
        (one.observer, one.ratings, one.mean, one.sd, one.above, one.below, "to look at" if one.flagged else None)
        for one in scale.observers
    )
    title = f"How observers used the scale {scale.scale}; BT.500's rule is information, nobody is left out by it"
    return Table(f"raters_{scale.scale}", title, columns, rows, folded=True)
