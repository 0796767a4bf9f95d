"""Scales in JOD as tables for pages and the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from analysis.comparisons import Comparisons
from documents.pages import Block, Column, Heading, Paragraph, Table
from documents.text import counted
from extensions.inference.jod_outliers import ObserverLikelihood
from extensions.inference.jod_scale import JodScale, JodScales, scale_jod
from runner.reports import Scored, ScoresOptions


class ScoredJod(Scored):
    """Scales in JOD as pwcmp has them, by ``--method pwcmp``."""

    value: JodScales
    model = "thurstone"

    @classmethod
    def of(cls, comparisons: Comparisons, options: ScoresOptions, common: Mapping[str, str] | None) -> ScoredJod:
        """Scale ``comparisons`` in JOD, as `scale_jod` does."""
        prior, adjust = options.distance_prior or "gaussian", options.adjust or "none"
        scales = scale_jod(comparisons, zero=options.jod_zero, prior=prior, alpha=options.alpha, adjust=adjust)
        return cls(scales, options)

    @property
    def problems(self) -> Sequence[str]:
        """Which scales have not converged."""
        return unsettled_lines(self.value)

    @property
    def title(self) -> str:
        """Within how many groups."""
        groups = len(self.value.scales)
        return f"JOD{f' within {groups} groups' if groups > 1 else ''} as pwcmp has them, best first"

    def scales(self) -> Sequence[tuple[str | None, list[dict[str, Any]]]]:
        """Return the rows of each group."""
        return [(name, [item.to_json() for item in scale.items]) for name, scale in self.value.scales]

    def told(self) -> list[Block]:
        """Return the scales, then how they were made."""
        return jod_blocks(self.value)


def jod_blocks(scales: JodScales) -> list[Block]:
    """Return each group's items in JOD, best first, with intervals and classes, then how the scale was made.

    Parameters
    ----------
    scales
        What `scale_jod` returns.

    Returns
    -------
    list
        Blocks for `documents.pages`.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from extensions.inference import scale_jod
    >>> from documents.pages import print_blocks
    >>> answers = [Answer("b", "a", 75), Answer("a", "b", 25)]
    >>> print_blocks(jod_blocks(scale_jod(from_answers(answers), prior="none"))[:1])
     item  wins   of     JOD  95 %  class
     b       75  100   0.000     –  –
     a       25  100  −1.000     –  –
    """
    blocks: list[Block] = []
    for name, scale in scales.scales:
        blocks += [Heading(name)] if name else []
        blocks += [_table(scale), *(Paragraph(line, small=True) for line in _lines(scale))]
    return [*blocks, *(Paragraph(line, small=True) for line in _observer_lines(scales.observers))]


def _table(scale: JodScale) -> Table:
    columns = (
        Column("item", "item"),
        Column("wins", "wins", "number"),
        Column("of", "comparisons", "number"),
        Column("JOD", "jod", "number", 3),
        Column(f"{100 * scale.level:g} %", "jod", "interval", 3),
        Column("class", "class", "class"),
    )
    rows = tuple(
        (item.name, f"{item.wins:g}", f"{item.comparisons:g}", item.jod, (item.low, item.high), item.label)
        for item in scale.items
    )
    return Table("jod", "", columns, rows)


def unsettled_lines(scales: JodScales) -> list[str]:
    """Say which scales have not converged, and what to do.

    Parameters
    ----------
    scales
        What `scale_jod` returns.

    Returns
    -------
    list[str]
        Lines of plain text; empty if all scales have converged.
    """
    lines = []
    for name, scale in scales.scales:
        if scale.converged:
            continue
        where = f"the group '{name}': " if name else ""
        if scale.prior == "bounded":
            lines.append(f"{where}the fit ended after {scale.iterations} steps, at a kink of the prior 'bounded'")
        else:
            lines.append(f"{where}no finite JOD fit these comparisons, even with pwcmp's prior: an item always wins")
            lines.append(
                "  Collect more comparisons, or ask for scores that stay finite: --model thurstone --method map."
            )
    return lines


def _lines(scale: JodScale) -> list[str]:
    lines = [f"pwcmp: Thurstone's Case V, prior on distances: {scale.prior}; '{scale.zero}' is at 0 JOD"]
    if np.isnan(scale.jod).any():
        pass
    elif scale.covariance is None:
        lines.append("no intervals: fewer than two observers are named, or too few draws of them link all items")
    else:
        lines.append(f"intervals and classes from {scale.replicates} draws of observers")
    if scale.without_fit:
        draws = counted(scale.without_fit, "draw has", "draws have")
        lines.append(f"{draws} no scale of all items and no place in the intervals, which are too short by that")
    if scale.ties_left_out:
        lines.append(f"{counted(scale.ties_left_out, 'answer prefers', 'answers prefer')} neither item: left out")
    return lines


def _observer_lines(observers: tuple[ObserverLikelihood, ...]) -> list[str]:
    if not observers:
        return []
    named = [f"{one.name} ({one.distance:.2f})" for one in observers if one.worth_a_look]
    rule = "interquartile ranges below the first quartile of likelihoods"
    if not named:
        farthest = max(one.distance for one in observers)
        return [f"no observer lies 1.5 or more {rule}; the farthest {farthest:.2f}"]
    return [f"look at the answers of {', '.join(named)}: {rule}"]
