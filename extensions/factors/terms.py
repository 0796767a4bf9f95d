"""Terms of the model: the columns of X that stand for a factor or an interaction, and the effects that they mean.

``treatment`` coding compares every level with the reference level; ``sum`` coding with the mean of all levels, each
level counting once. Both give the same strengths. Numbers are centred on the items' mean, so that an interaction
leaves their slopes at the mean.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from documents.arrays import Floats
from extensions.factors.values import Factor

Coding = Literal["treatment", "sum"]


@dataclass(frozen=True, slots=True, eq=False)
class Term:
    """A factor's columns.

    Attributes
    ----------
    names
        The factor, or the two that interact.
    columns
        Shape (n, c), without unit.
    contrasts
        Shape (r, c): from coefficients of the columns to the r effects in nats; none for an interaction.
    labels
        What each effect belongs to: the level, or "per unit" and "per doubling".
    reference
        The level that the effects compare with; None for numbers, interactions and sum coding.
    """

    names: tuple[str, ...]
    columns: Floats
    contrasts: Floats
    labels: tuple[str, ...]
    reference: str | None = None

    @property
    def width(self) -> int:
        """Number of columns."""
        return int(self.columns.shape[1])


def main_term(factor: Factor, coding: Coding) -> Term:
    """Return the columns and effects of one factor."""
    if factor.kind != "categorical":
        numbers = np.array(factor.values, dtype=np.float64)
        largest = float(np.abs(numbers).max())
        centred = numbers / largest - (numbers / largest).mean()
        reach = float(np.abs(centred).max())
        label = "per doubling" if factor.kind == "log2" else "per unit"
        return Term((factor.name,), centred[:, None] / reach, np.array([[1 / reach / largest]]), (label,))
    place = {level: number for number, level in enumerate(factor.levels)}
    number = np.array([place[str(value)] for value in factor.values])
    k = len(factor.levels)
    if coding == "treatment":
        code = np.vstack([np.zeros(k - 1), np.eye(k - 1)])
        return Term((factor.name,), code[number], np.eye(k - 1), factor.levels[1:], factor.levels[0])
    code = np.vstack([np.eye(k - 1), -np.ones(k - 1)])
    return Term((factor.name,), code[number], code, factor.levels)


def interaction_term(first: Term, second: Term) -> Term:
    """Return the products of two factors' columns."""
    columns = (first.columns[:, :, None] * second.columns[:, None, :]).reshape(len(first.columns), -1)
    return Term(first.names + second.names, columns, np.empty((0, columns.shape[1])), ())


def empty_cell(first: Factor, second: Factor) -> str | None:
    """Say which two levels no item has together; None where every two levels meet, or a factor is a number."""
    met = set(zip(first.values, second.values, strict=True))
    for pair in product(first.levels, second.levels):
        if pair not in met:
            return f"no stimulus is '{pair[0]}' ({first.name}) and '{pair[1]}' ({second.name})"
    return None
