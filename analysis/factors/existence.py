"""Whether a finite maximum exists: no change of effects that every answer agrees with, or is left alone by.

For strengths X β a maximum exists unless some β ≠ 0 has (x_i − x_j) β ≥ 0 wherever i was preferred over j
[Albert1984]; the linear programme that finds one is Konis's [Konis2007]. If the items themselves are not separated
(Ford's condition), neither are the effects, and nothing is solved.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.factors.terms import Term
from analysis.scaling.cells import Cells
from analysis.scaling.separation import strong_groups
from documents import Finding

Floats = NDArray[np.float64]
AGREES = 0.5
LEVEL = 1e-5


def is_separated(cells: Cells, terms: Sequence[Term]) -> bool:
    """Say whether some effects have no finite maximum."""
    return not _items_hold(cells) and direction(cells, np.hstack([term.columns for term in terms])) is not None


def separated_effects(cells: Cells, terms: Sequence[Term]) -> tuple[str, ...]:
    """Say in sentences which effects have no finite maximum; nothing if all have one.

    ``terms`` are independent, as `analysis.factors.aliasing.choose_terms` leaves them. One sentence stands for each
    term that runs away by itself; if only several together do, one sentence for them.
    """
    if _items_hold(cells):
        return ()
    found = direction(cells, np.hstack([term.columns for term in terms]))
    if found is None:
        return ()
    alone = tuple(
        f"No answer goes against {_order(term, own)}: the larger this effect, the better the fit, without end."
        for term in terms
        if (own := direction(cells, term.columns)) is not None
    )
    if alone:
        return alone
    starts = np.cumsum([0, *(term.width for term in terms)])
    orders = [
        _order(term, found[start : start + term.width])
        for term, start in zip(terms, starts, strict=False)
        if np.abs(found[start : start + term.width]).max() > LEVEL
    ]
    return (f"The answers are fitted ever better as these effects grow together without end: {'; '.join(orders)}.",)


def direction(cells: Cells, columns: Floats) -> Floats | None:
    """Return coefficients (c,), at most 1 in size, that no answer goes against and some agree with; None if none are.

    With a row of A for each kind of answer, winner's columns less loser's: maximise Σ t, 0 ≤ t ≤ 1, t ≤ A β. Any
    direction can be made so long that t reaches 1 wherever an answer agrees with it at all.

    Raises
    ------
    ResultsError
        If the solver gives up.
    """
    from scipy.optimize import linprog
    from scipy.sparse import csr_array, eye_array, hstack

    apart = columns[cells.first] - columns[cells.second]
    agreeing = np.unique(np.vstack([apart[cells.won > 0], -apart[cells.lost > 0]]), axis=0)
    rows, width = agreeing.shape
    cost = np.concatenate([np.zeros(width), -np.ones(rows)])
    bounds = [(None, None)] * width + [(0.0, 1.0)] * rows
    limits = hstack([csr_array(-agreeing), eye_array(rows)], format="csr")
    found = linprog(cost, limits, np.zeros(rows), bounds=bounds, method="highs")
    if found.x is None:
        what = f"whether the effects have a finite maximum could not be decided: {found.message}"
        raise ResultsError(Finding(what, remedy="leave a factor out, or use fewer levels"))
    beta = np.asarray(found.x, dtype=np.float64)[:width]
    if float((agreeing @ beta).max(initial=0.0)) < AGREES:
        return None
    return np.asarray(beta / np.abs(beta).max(), dtype=np.float64)


def _items_hold(cells: Cells) -> bool:
    n = cells.n
    wins: Floats = np.bincount(cells.first * n + cells.second, cells.won, n * n).astype(np.float64)
    wins += np.bincount(cells.second * n + cells.first, cells.lost, n * n)
    return len(strong_groups(wins.reshape(n, n))) == 1


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
    values = [round(float(value) / LEVEL) * LEVEL for value in along]
    groups: dict[float, list[str]] = {}
    if term.reference is not None:
        values.insert(0, 0.0)
    labels = term.labels if term.reference is None else (term.reference, *term.labels)
    for value, label in zip(values, labels, strict=True):
        groups.setdefault(value, []).append(label)
    return values, groups
