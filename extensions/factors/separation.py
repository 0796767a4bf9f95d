"""Which effects of factors have no finite maximum, by name and direction; the test is `analysis.scaling.separation`'s.

If the items themselves are not separated (Ford's condition), neither are the effects, and nothing is solved.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.scaling import DIRECTION_ROUNDING, Counts, items_are_linked, recession
from documents.arrays import Floats
from extensions.factors.terms import Term


def is_separated(counts: Counts, terms: Sequence[Term]) -> bool:
    """Say whether some effects have no finite maximum."""
    return not items_are_linked(counts) and recession(counts, np.hstack([term.columns for term in terms])) is not None


def separated_effects(counts: Counts, terms: Sequence[Term]) -> tuple[str, ...]:
    """Say in sentences which effects have no finite maximum; nothing if all have one.

    ``terms`` are independent, as `extensions.factors.aliasing.choose_terms` leaves them. One sentence stands for each
    term that runs away by itself; if only several together do, one sentence for them.
    """
    if items_are_linked(counts):
        return ()
    direction = recession(counts, np.hstack([term.columns for term in terms]))
    if direction is None:
        return ()
    alone = tuple(
        f"No answer goes against {_order(term, own[: term.width])}: the larger this effect, the better the fit, "
        "without end."
        for term in terms
        if (own := recession(counts, term.columns)) is not None
    )
    if alone:
        return alone
    starts = np.cumsum([0, *(term.width for term in terms)])
    orders = [
        _order(term, direction[start : start + term.width])
        for term, start in zip(terms, starts, strict=False)
        if np.abs(direction[start : start + term.width]).max() > DIRECTION_ROUNDING
    ]
    return (f"The likelihood rises without end as these effects grow: {'; '.join(orders)}.",)


def _order(term: Term, coefficients: Floats) -> str:
    """Name the levels from best to worst, or which way a number goes."""
    name = " × ".join(term.names)
    if not term.labels:
        return f"'{name}'"
    if term.labels[0].startswith("per "):
        return f"'{name}' ({'more' if coefficients[0] > 0 else 'less'} is preferred)"
    values, groups = _levels(term, coefficients)
    ranked = sorted(set(values), reverse=True)
    above = " over ".join(", ".join(f"'{level}'" for level in groups[value]) for value in ranked)
    return f"'{name}' ({above})"


def _levels(term: Term, coefficients: Floats) -> tuple[list[float], dict[float, list[str]]]:
    along = term.contrasts @ coefficients
    values = [round(float(value) / DIRECTION_ROUNDING) * DIRECTION_ROUNDING for value in along]
    groups: dict[float, list[str]] = {}
    if term.reference is not None:
        values.insert(0, 0.0)
    labels = term.labels if term.reference is None else (term.reference, *term.labels)
    for value, label in zip(values, labels, strict=True):
        groups.setdefault(value, []).append(label)
    return values, groups
