"""Perceptual classes: groups of items that the answers do not tell apart, as a compact letter display.

Two items share a class if and only if their difference is not significant. Class 1 holds the best item; an item in
two classes is labelled such as "3+4", as in the thesis's Table 4.4. Insert-and-absorb [Piepho2004] finds the classes;
a sweep then takes out every class, and every membership, that no pair needs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.firth import contrast_variances
from analysis.multiplicity import Adjust, adjusted_p
from documents import Finding

Floats = NDArray[np.float64]
Letters: TypeAlias = tuple[frozenset[int], ...]


@dataclass(frozen=True, slots=True, eq=False)
class Classes:
    """Perceptual classes of ``n`` items.

    Attributes
    ----------
    labels
        For each item its classes, from 1, the best: "1", or "3+4" for an item in two.
    members
        For each class the indices of its items, class 1 first.
    z
        Shape (n, n): (θ_i − θ_j) / se(θ_i − θ_j).
    p
        Shape (n, n): two-sided p values after adjustment; 1 on the diagonal.
    alpha, adjust
        Level and adjustment.
    """

    labels: tuple[str, ...]
    members: tuple[tuple[int, ...], ...]
    z: Floats
    p: Floats
    alpha: float
    adjust: Adjust


def check_level(alpha: float) -> None:
    """Raise ResultsError unless ``alpha`` lies between 0 and 1."""
    if not 0 < alpha < 1:
        raise ResultsError(Finding(f"alpha is {alpha:g}", remedy="give a level between 0 and 1, such as 0.05"))


def classify(theta: Floats, covariance: Floats, *, alpha: float = 0.05, adjust: Adjust = "holm") -> Classes:
    """Group items into perceptual classes by pairwise tests.

    Parameters
    ----------
    theta
        Shape (n,): strengths, finite.
    covariance
        Shape (n, n): their covariance.
    alpha
        Level, between 0 and 1: two items differ where p ≤ alpha.
    adjust
        ``none``, ``holm``, ``bh`` (Benjamini-Hochberg) or ``maxz`` (single step by the largest z), over all pairs.

    Raises
    ------
    ResultsError
        If ``alpha`` is out of range or ``theta`` is not finite.
    """
    check_level(alpha)
    if not np.isfinite(theta).all():
        raise ResultsError(Finding("items without a finite strength have no class", remedy="use the method 'firth'"))
    difference = theta[:, None] - theta[None, :]
    error = np.sqrt(contrast_variances(covariance))
    z = np.divide(difference, error, out=np.zeros_like(difference), where=error > 0)
    p = adjusted_p(z, covariance, adjust)
    members = numbered(letter_display(p <= alpha), theta)
    labels = tuple(
        "+".join(str(number) for number, group in enumerate(members, start=1) if item in group)
        for item in range(len(theta))
    )
    return Classes(labels, members, z, p, alpha, adjust)


def letter_display(differs: NDArray[np.bool_]) -> Letters:
    """Return sets of items such that two items share a set if and only if they do not differ.

    Parameters
    ----------
    differs
        Shape (n, n): symmetric, False on the diagonal.
    """
    n = len(differs)
    columns = [(1 << n) - 1]  # sets as bits: the loop below runs once for every pair that differs
    for first, second in np.argwhere(np.triu(differs, 1)).tolist():
        pair = 1 << first | 1 << second
        split = [column for column in columns if column & pair == pair]
        if split:
            kept = [column for column in columns if column & pair != pair]
            halves = [column & ~(1 << item) for column in split for item in (first, second)]
            columns = _absorbed(kept, halves)
    return _swept([frozenset(item for item in range(n) if column >> item & 1) for column in columns])


def _absorbed(kept: list[int], halves: list[int]) -> list[int]:
    """Add those halves that lie in no other column; what was kept lies in none, as no column lay in another."""
    unique = list(dict.fromkeys(halves))
    whole = [
        half
        for half in unique
        if not any(half & other == half for other in kept)
        and not any(half & other == half and half != other for other in unique)
    ]
    return kept + whole


def _swept(columns: list[frozenset[int]]) -> Letters:
    """Drop columns that no pair needs, the smallest first, then single memberships that no pair needs."""
    kept = sorted(columns, key=lambda column: (len(column), sorted(column)))
    for column in list(kept):
        others = [other for other in kept if other is not column]
        if all(_is_needless(item, column, others) for item in column):
            kept = others
    for index, column in enumerate(kept):
        others = kept[:index] + kept[index + 1 :]
        for item in sorted(column):
            if _is_needless(item, kept[index], others):
                kept[index] = kept[index] - {item}
    return tuple(kept)


def _is_needless(item: int, column: frozenset[int], others: list[frozenset[int]]) -> bool:
    """Say whether ``item`` shares another column with each item of ``column``, itself included."""
    elsewhere = frozenset[int]().union(*(other for other in others if item in other))
    return column <= elsewhere


def numbered(letters: Letters, theta: Floats) -> tuple[tuple[int, ...], ...]:
    """Order classes by their best item, then by their worst, best class first; members best first."""
    rank = {int(item): place for place, item in enumerate(np.argsort(-theta, kind="stable"))}
    groups = [tuple(sorted(letter, key=lambda item: rank[item])) for letter in letters]
    return tuple(sorted(groups, key=lambda group: (rank[group[0]], rank[group[-1]], len(group), group)))
