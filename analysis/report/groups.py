"""Paired comparisons within groups, such as scenes: scores, classes, counts and diagnostics of each, and of all."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from types import MappingProxyType

from analysis.observers.concordance import Concordance
from analysis.report.figures import draw_group_scores
from analysis.report.grouped import GroupedSummary
from analysis.report.scores import (
    Pictures,
    classes_section,
    counts_section,
    diagnostics,
    score_caption,
    score_explanation,
    score_table,
    scores_section,
)
from analysis.report.summary import Summary
from analysis.report.words import fixed, p_words
from analysis.scaling.group_agreement import GroupAgreement
from analysis.scaling.shown import Published
from documents.figures import NARROW_IN, WIDE_IN
from documents.pages import Block, Cell, Column, Facts, Figure, Heading, Matrix, Paragraph, Section, Table
from documents.text import counted

MOST_UNFOLDED = 3  # groups whose tables stand open


def group_sections(
    grouped: GroupedSummary,
    published: Published,
    adjustment: str,
    agreement: Concordance | None,
    pictures: Pictures = MappingProxyType({}),
) -> tuple[Section, ...]:
    """Return the sections of scores, classes, counts and diagnostics; ``agreement`` is that between observers."""
    return (
        _scores(grouped, published, pictures),
        _pooled(grouped, adjustment),
        _classes(grouped, adjustment),
        _counts(grouped),
        _diagnostics(grouped, agreement),
    )


def _scores(grouped: GroupedSummary, published: Published, pictures: Pictures) -> Section:
    """Return the figure with a panel for each group, the long table behind it, and a table for each group."""
    parts = grouped.groups
    order = "in the order of all groups together" if grouped.common else "best at the top"
    caption = f"{score_caption(parts[0][1], order)} Every {grouped.factor} has a scale of its own: only scores of one "
    caption += f"{grouped.factor} can be compared."
    tables = [
        score_table(
            part,
            published,
            _named("scores", number, name),
            f"{name}: scores, best first",
            pictures=pictures,
            folded=len(parts) > MOST_UNFOLDED,
        )
        for number, (name, part) in enumerate(parts, start=1)
    ]
    columns = (Column("Group", "group"), *tables[0].columns)
    rows = tuple((name, *row) for (name, _), table in zip(parts, tables, strict=True) for row in table.rows)
    together = Table("scores", "Scores of all groups", columns, rows)
    names = [item.name for item in grouped.pooled.scores.items] if grouped.pooled else []
    wide, narrow = (draw_group_scores(parts, names, grouped.common, width_in) for width_in in (WIDE_IN, NARROW_IN))
    figure = Figure("scores", wide, narrow, caption, together)
    return Section("scores", "Scores by group", (figure, *tables, score_explanation(parts[0][1])))


def _named(table: str, number: int, group: str) -> str:
    """Return the name of a group's table; the number keeps names apart that are alike as names of files."""
    return f"{table}_{number:02d}_{group}"


def _pooled(grouped: GroupedSummary, adjustment: str) -> Section:
    """Return the scale that is common to all groups with its classes, and whether the groups agree."""
    title = "All groups together"
    if grouped.pooled is None:
        words = (
            "There is no pooled scale: the stimuli of different groups have nothing in common by which they could be "
            "matched. Give stimuli that correspond a factor with the same level in each group, such as their codec."
        )
        return Section("pooled", title, (Paragraph(words),))
    test = grouped.scored.agreement
    blocks: list[Block] = [Paragraph(agreement_words(test, grouped.factor, grouped.alpha))] if test else []
    blocks += _prefixed(scores_section(grouped.pooled, {}).blocks)
    classes = classes_section(grouped.pooled, adjustment)
    if classes is not None:
        blocks += [Heading("Perceptual classes of all groups together"), *_prefixed(classes.blocks)]
    return Section("pooled", title, tuple(blocks))


def agreement_words(test: GroupAgreement, factor: str, alpha: float) -> str:
    """Return the test whether one scale serves all groups, and what follows from it, in words."""
    if test.f is None or test.p is None or test.df_between is None or test.df_within is None:
        statistic = f"χ² = {fixed(test.statistic, 1)} on {test.df} degrees of freedom"
        basis = f" if all answers are independent (no test by observers: {test.missing})"
    else:
        degrees = f"{fixed(test.df_between, 1)} and {fixed(test.df_within, 1)} degrees of freedom"
        statistic, basis = f"F = {fixed(test.f, 2)} on {degrees}", " with the observer as the unit"
    found = test.conclusion(alpha)
    if found.verdict == "distinguished":
        verdict = f"The {factor}s are distinguished: read the scale of each, and take the pooled one for an average."
    else:
        verdict = f"The {factor}s are not distinguished, which is no evidence that their scales are the same."
    return f"Does one scale serve every {factor}? {statistic}, {p_words(found.p or 0.0)}{basis}. {verdict}"


def _prefixed(blocks: Iterable[Block]) -> list[Block]:
    """Return blocks whose tables and figures are named as those of all groups together."""
    named: list[Block] = []
    for block in blocks:
        if isinstance(block, Table):
            named.append(replace(block, name=f"pooled_{block.name}"))
        elif isinstance(block, Figure | Matrix):
            table = None if block.table is None else replace(block.table, name=f"pooled_{block.table.name}")
            if isinstance(block, Figure):
                named.append(replace(block, name=f"pooled_{block.name}", table=table))
            elif table is not None:
                named.append(replace(block, table=table))
        else:
            named.append(block)
    return named


def _classes(grouped: GroupedSummary, adjustment: str) -> Section:
    """Return the classes side by side, where stimuli have something in common, and those of every group."""
    words = (
        f"Within a {grouped.factor}, stimuli that share a class are not distinguished at level {grouped.alpha:g} "
        f"({adjustment}, for the pairs of one {grouped.factor}). Class 1 is the best of each "
        "group, and not the same class in different groups."
    )
    blocks: list[Block] = [Paragraph(words, small=True)]
    if grouped.pooled is not None:
        blocks.append(_side_by_side(grouped, grouped.pooled))
    columns = (
        Column("Group", "group"),
        Column("Stimulus", "stimulus"),
        Column("Class", "class", "class"),
        Column("Most frequent class", "most_frequent_class", "class"),
        Column("its share", "most_frequent_share", "number", 2),
    )
    rows: list[tuple[Cell, ...]] = []
    for name, part in grouped.groups:
        stable = part.estimate.stability
        place = {item: index for index, item in enumerate(stable.items)} if stable else {}
        for item in part.scores.items:
            frequent: tuple[Cell, Cell] = (None, None)
            if stable is not None:
                own = place[item.name]
                frequent = stable.labels[own], float(stable.label_shares[own])
            rows.append((name, item.name, item.label, *frequent))
    title = "Classes of each group, and the most frequent ones over the bootstrap samples"
    blocks.append(Table("classes", title, columns, tuple(rows), folded=bool(grouped.common) or len(rows) > 40))
    return Section("classes", "Perceptual classes by group", tuple(blocks))


def _side_by_side(grouped: GroupedSummary, pooled: Summary) -> Table:
    labels = {
        name: {grouped.common.get(item.name, item.name): item.label for item in part.scores.items}
        for name, part in grouped.groups
    }
    columns = [Column("Stimulus", "stimulus"), Column("All together", "pooled_class", "class")]
    columns += [Column(name, f"class in {name}", "class") for name in labels]
    rows = tuple(
        (item.name, item.label, *(own.get(item.name) for own in labels.values())) for item in pooled.scores.items
    )
    return Table("classes_by_group", "Classes side by side", tuple(columns), rows)


def _counts(grouped: GroupedSummary) -> Section:
    matrices: list[Block] = []
    small: list[Block] = []
    for number, (name, part) in enumerate(grouped.groups, start=1):
        for block in counts_section(part).blocks:
            if not isinstance(block, Matrix):
                small = [block]
                continue
            title = f"{name}: comparison matrix"
            table = replace(block.table, name=_named("comparisons", number, name), title=title)
            folded = block.folded or len(grouped.groups) > MOST_UNFOLDED
            if not folded:
                matrices.append(Heading(name))
            matrices.append(replace(block, title=title, table=table, folded=folded))
    return Section("comparisons", "Comparison matrices", (*matrices, *small))


def _diagnostics(grouped: GroupedSummary, agreement: Concordance | None) -> Section:
    facts = Facts(diagnostics(grouped, grouped.pooled, agreement))
    columns = (
        Column("Group", "group"),
        Column("Stimuli", "stimuli", "number"),
        Column("Observers", "observers", "number"),
        Column("Comparisons", "comparisons", "number"),
        Column("Ties", "ties", "number"),
        Column("Fit", "method"),
        Column("Standard errors", "standard_errors"),
        Column("Pearson's χ²", "pearson", "number", 1),
        Column("df", "df", "number"),
        Column("p (one scale)", "p_one_scale", "p"),
        Column("Classes", "classes", "number"),
    )
    rows = tuple(
        (
            name,
            len(part.scores.items),
            len(part.observers),
            part.trials,
            part.comparisons.ties or None,
            _METHODS[part.estimate.method],
            part.estimate.covariance,
            part.one_scale.statistic if part.one_scale else None,
            part.one_scale.df if part.one_scale else None,
            part.one_scale.p if part.one_scale else None,
            len(part.scores.classes.members) if part.scores.classes else None,
        )
        for name, part in grouped.groups
    )
    table = Table("groups", f"{counted(len(rows), 'group', 'groups')}", columns, rows)
    return Section("belief", "Diagnostics", (facts, table))


_METHODS = {"ml": "maximum likelihood", "firth": "Firth's penalised", "learnt_prior": "learnt prior"}
