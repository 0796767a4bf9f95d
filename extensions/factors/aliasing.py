"""Which factors the comparisons can distinguish: those whose columns add to the span of the ones before.

Only differences within compared pairs are seen. Columns are therefore centred within each group of items that
comparisons link; what remains is all that the pairs determine.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from analysis.scaling import Groups
from documents.arrays import Floats
from extensions.factors.terms import Term
from extensions.factors.values import Omitted

TOLERANCE = 1e-9


def choose_terms(terms: Sequence[Term], groups: Groups) -> tuple[list[Term], list[Omitted]]:
    """Return the terms that add all of their columns to those before them, and why the others do not.

    Parameters
    ----------
    groups
        The items that comparisons link, as `analysis.scaling.separation.compared_groups` gives them.
    """
    kept: list[Term] = []
    left_out = []
    for term in terms:
        gained = rank_gained(kept, term, groups)
        if gained == term.width:
            kept.append(term)
        else:
            left_out.append(Omitted(" × ".join(term.names), _reason(kept, term, gained, groups)))
    return kept, left_out


def rank_gained(before: Sequence[Term], term: Term, groups: Groups) -> int:
    """Return how many of ``term``'s columns the pairs can distinguish from those of the terms before it."""
    columns = _within(term.columns, groups)
    scale = np.sqrt((term.columns**2).sum(axis=0))
    columns = columns / np.where(scale > 0, scale, 1.0)
    if before:
        basis = orthonormal(_within(np.hstack([other.columns for other in before]), groups))
        for _ in range(2):  # once more, for what rounding left
            columns = columns - basis @ (basis.T @ columns)
    return int((np.linalg.svd(columns, compute_uv=False) > TOLERANCE).sum())


def orthonormal(columns: Floats) -> Floats:
    """Return an orthonormal basis of the columns' span; the columns must be independent."""
    return np.asarray(np.linalg.qr(columns)[0])


def _within(columns: Floats, groups: Groups) -> Floats:
    centred = columns.copy()
    for group in groups:
        rows = list(group)
        centred[rows] -= centred[rows].mean(axis=0)
    return centred


def _reason(kept: Sequence[Term], term: Term, gained: int, groups: Groups) -> str:
    if not gained and rank_gained((), term, groups) == 0:
        return "it differs only between stimuli that were never compared, directly or through others"
    for count in (1, 2):
        for some in combinations(kept, count):
            if rank_gained(some, term, groups) == gained:
                return _sentence(some, term, gained)
    return _sentence(kept, term, gained)


def _sentence(some: Sequence[Term], term: Term, gained: int) -> str:
    if not some:
        return f"the comparisons determine only {gained} of its {term.width} differences"
    names = " and ".join(f"'{name}'" for other in some for name in other.names)
    if not gained:
        return f"it is aliased: {names} already {'explains' if len(some) == 1 else 'explain'} all that it could"
    return f"it is partly aliased with {names}: {gained} of its {term.width} differences can be estimated"
