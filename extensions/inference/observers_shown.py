"""A fit with observers as a distribution: tables for pages and the terminal, and a CSV table of observers' scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from analysis.classes import LEVEL, verdict_of
from analysis.comparisons import Comparisons
from documents.files import write_whole
from documents.pages import Block, Column, Heading, Paragraph, Table
from documents.tables import csv_lines
from documents.text import counted
from extensions.inference.observers_fit import fit_observers
from extensions.inference.observers_result import GroupScores, HierarchicalFit
from runner.reports import Scored, ScoresOptions


class ScoredObservers(Scored):
    """Scores of the typical observer, of observers who differ, by ``--observers random``."""

    value: HierarchicalFit
    refused = (*Scored.refused, "method")

    @classmethod
    def of(cls, comparisons: Comparisons, options: ScoresOptions, common: Mapping[str, str] | None) -> ScoredObservers:
        """Fit observers as a distribution, and write each observer's scores where that is asked for."""
        model, adjust = options.model or "bradley-terry", options.adjust or "holm"
        fitted = fit_observers(comparisons, model, alpha=options.alpha, adjust=adjust)
        if options.observer_scores is not None:
            write_whole(options.observer_scores, observer_table(fitted), private=True)
        return cls(fitted, options)

    @property
    def title(self) -> str:
        """By which model."""
        return f"Scores of the typical observer by {self.value.model}, best first"

    def scales(self) -> Sequence[tuple[str | None, list[dict[str, Any]]]]:
        """Return the rows of each group."""
        return [(one.get("name") or None, one["items"]) for one in self.value.to_json()["groups"]]

    def told(self) -> list[Block]:
        """Return the fit."""
        return fit_blocks(self.value)


COLUMNS = ("group", "observer", "item", "theta", "sd")


def fit_blocks(fit: HierarchicalFit) -> list[Block]:
    """Return the typical observer's scores, how much observers differ, and what a new observer would say.

    Parameters
    ----------
    fit
        What `fit_observers` returns.

    Returns
    -------
    list
        Blocks for `documents.pages`.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from extensions.inference import fit_observers
    >>> answers = [Answer("a", "b", 18, "anna"), Answer("b", "a", 2, "anna"), Answer("a", "b", 9, "ben")]
    >>> fit = fit_observers(from_answers([*answers, Answer("b", "a", 11, "ben")]))
    >>> [column.heading for column in fit_blocks(fit)[0].columns]
    ['item', 'nats', 'se', 'JND', 'class']
    """
    blocks: list[Block] = []
    for group in fit.groups:
        blocks += [*([Heading(group.name)] if group.name else []), _score_table(fit, group)]
    blocks += [Paragraph(line, small=True) for line in summary_lines(fit)]
    return [*blocks, *(_prediction_table(fit, group) for group in fit.groups)]


def summary_lines(fit: HierarchicalFit) -> list[str]:
    """Say how much observers differ, and how the fit was made.

    Parameters
    ----------
    fit
        What `fit_observers` returns.

    Returns
    -------
    list[str]
        Lines of plain text.
    """
    spread, unit = fit.spread, fit.unit
    high = "no upper limit" if spread.high is None else f"{spread.high:.3g}"
    lines = [f"sd between observers: {spread.estimate:.3g} {unit} for each item (95 % {spread.low:.3g} to {high})"]
    found = verdict_of(spread.p <= LEVEL)
    lines.append(f"differences of observers: {found}, likelihood ratio {spread.statistic:.4g}, p = {spread.p:.2g}")
    lines.append(f"{fit.model}, scores of the typical observer, who is not the average answer")
    if not fit.converged:
        lines.append("the iteration has not converged")
    if fit.ties_left_out:
        them = "it" if fit.ties_left_out == 1 else "them"
        prefers = counted(fit.ties_left_out, "answer prefers", "answers prefer")
        lines.append(f"{prefers} neither item; this model leaves {them} out.")
    return lines


def observer_table(fit: HierarchicalFit) -> str:
    """Return each observer's scores as CSV: the columns group, observer, item, theta, sd.

    Parameters
    ----------
    fit
        What `fit_observers` returns.

    Returns
    -------
    str
        The table, in the units of the strengths; one line for each observer and item.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from extensions.inference import fit_observers
    >>> answers = [Answer("a", "b", 18, "anna"), Answer("b", "a", 2, "anna"), Answer("a", "b", 9, "ben")]
    >>> fit = fit_observers(from_answers([*answers, Answer("b", "a", 11, "ben")]))
    >>> observer_table(fit).splitlines()[0]
    'group,observer,item,theta,sd'
    """
    rows: list[tuple[str, ...]] = [COLUMNS]
    for group in fit.groups:
        scores = fit.observer_scores(group.name)
        for name, means, sds in zip(scores.observers, scores.mean.tolist(), scores.sd.tolist(), strict=True):
            for item, mean, sd in zip(scores.items, means, sds, strict=True):
                rows.append((group.name, name, item, f"{mean:.6g}", f"{sd:.6g}"))
    return csv_lines(rows)


def _score_table(fit: HierarchicalFit, group: GroupScores) -> Table:
    classes = fit.classes(group.name)
    columns = (
        Column("item", "item"),
        Column(fit.unit, "theta", "number", 3),
        Column("se", "se", "number", 3),
        Column("JND", "jnd", "number", 2),
        Column("class", "class", "class"),
    )
    rows = []
    for place in group.order:
        theta, label = float(group.theta[place]), classes.labels[place] if classes else None
        rows.append((group.items[place], theta, float(group.se[place]), theta / fit.jnd, label))
    return Table("scores", "", columns, tuple(rows))


def _prediction_table(fit: HierarchicalFit, group: GroupScores) -> Table:
    columns = (
        Column("item", "first"),
        Column("over", "second"),
        Column("P", "chance", "number", 3),
        Column("95 %", "chance", "interval", 3),
        Column("typical", "typical", "number", 3),
        Column("95 % of observers", "observers", "interval", 3),
        Column("share", "share", "number", 2),
    )
    rows = []
    for first, second in pairwise([group.items[place] for place in group.order]):
        new = fit.predict(first, second, group.name)
        own = new.chance, (new.chance_low, new.chance_high), new.typical, (new.lowest, new.highest), new.share
        rows.append((first, second, *own))
    title = f"a new observer, items next to each other{f', {group.name}' if group.name else ''}"
    return Table("predictions", title, columns, tuple(rows))
