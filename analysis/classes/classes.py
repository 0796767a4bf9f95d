"""Perceptual classes: groups of items whose differences are not significant, as a compact letter display.

Two items share a class if and only if their difference is not significant. Class 1 has the best item; an item in
two classes is labelled such as "3+4", as in the thesis's Table 4.4. The classes are the largest groups of items that
are all alike, found by insert-and-absorb [Piepho2004], item by item rather than pair by pair: there are then never more
groups than in the end. A sweep takes out every class, and every membership, that no pair needs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from analysis.choices import Adjust
from analysis.classes.multiplicity import adjusted_p, corrected
from analysis.covariance.laplacian import pair_variances
from analysis.covariance.shrinkage import Spread
from analysis.errors import ResultsError
from documents import Finding, count_work
from documents.arrays import Floats

Items: TypeAlias = list[int]
Pairs: TypeAlias = list[tuple[int, int]]
Column: TypeAlias = tuple[int, Items]  # its items as bits, and in order
Letters: TypeAlias = tuple[frozenset[int], ...]
# Largest groups of items that are all alike can be exponentially many; nobody reads as many classes as this.
MOST_CLASSES = 2000
TIED = 1e-10  # of the largest value


class TooManyClasses(ResultsError):
    """The items overlap in more classes than can be listed."""


class PairTests(Protocol):
    """Tests of the pairs i < j, shape (P,) each, such as `analysis.scaling.profile.Profiles`."""

    @property
    def at_zero(self) -> Floats:
        """The statistics t, positive where i is above j."""

    @property
    def p(self) -> Floats:
        """Two-sided p values."""

    @property
    def spread(self) -> Floats:
        """κ: how many times the model's variance the one by observers is."""


@dataclass(frozen=True, slots=True, eq=False)
class Classes:
    """Perceptual classes of ``n`` items.

    Attributes
    ----------
    labels
        For each item its classes, from 1, the best: "1", or "3+4" for an item in two.
    members
        For each class the indices of its items, class 1 first.
    pair_z, pair_p
        Shape (P,): (θ_i − θ_j) / se(θ_i − θ_j) and two-sided p values after adjustment, of the pairs i < j in the order
        of ``numpy.triu_indices``.
    alpha, adjust
        Level and adjustment.
    without_spread
        How many pairs differ in strength but have no standard error, since all observers agree about them: no
        evidence of how much other observers would vary, so they are not significant.
    """

    labels: tuple[str, ...]
    members: tuple[tuple[int, ...], ...]
    pair_z: Floats
    pair_p: Floats
    alpha: float
    adjust: Adjust
    without_spread: int

    @property
    def z(self) -> Floats:
        """Shape (n, n), antisymmetric: ``pair_z`` of every two items."""
        upper = _square(self.pair_z, len(self.labels))
        return upper - upper.T

    @property
    def p(self) -> Floats:
        """Shape (n, n), symmetric: ``pair_p`` of every two items; 1 on the diagonal."""
        upper = _square(self.pair_p, len(self.labels))
        return upper + upper.T + np.eye(len(self.labels))


def best_first(values: Floats) -> tuple[int, ...]:
    """Return the indices of ``values`` (n,), largest first; those that are equal but for rounding in their order."""
    return tuple(np.argsort(levels(-values), kind="stable").tolist())


def levels(values: Floats) -> NDArray[np.intp]:
    """Return the place of each of ``values`` (n,) among the distinct ones, 0 for the least.

    Values that are equal but for rounding have one place, so that no rank depends on the processor.
    """
    order = np.argsort(values, kind="stable")
    rises = np.diff(values[order]) > TIED * np.abs(values).max(initial=0.0)
    place = np.empty(len(values), dtype=np.intp)
    place[order] = np.concatenate([[0], np.cumsum(rises)])[: len(values)]
    return place


def check_level(alpha: float) -> None:
    """Raise ResultsError unless ``alpha`` lies between 0 and 1."""
    if not 0 < alpha < 1:
        raise ResultsError(Finding(f"alpha is {alpha:g}", remedy="give a level between 0 and 1, such as 0.05"))


def classify(
    theta: Floats,
    covariance: Floats,
    *,
    alpha: float = 0.05,
    adjust: Adjust = "holm",
    df: Floats | float | None = None,
    spread: Spread | None = None,
    profiles: PairTests | None = None,
) -> Classes:
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
    df
        Degrees of freedom of the standard errors, of all or of each pair i < j, shape (P,); None for the model's.
    spread
        Where ``covariance`` is clustered by observer, what it comes from: ``maxz`` draws from it.
    profiles
        Tests of the pairs by likelihood ratios, which take the place of those by ``covariance`` and ``df``.

    Returns
    -------
    Classes
        Labels and members of the classes, and z and adjusted p of every pair, shape (n (n − 1) / 2,).

    Raises
    ------
    ResultsError
        If ``alpha`` is out of range or ``theta`` is not finite; TooManyClasses as `letter_display`.

    Examples
    --------
    >>> import numpy as np
    >>> classify(np.array([1.0, 0.9, -1.9]), 0.1 * np.eye(3), adjust="none").labels
    ('1', '1', '2')
    """
    check_level(alpha)
    count_work("classes_found")
    if not np.isfinite(theta).all():
        raise ResultsError(Finding("items without a finite strength have no class", remedy="use the method 'firth'"))
    n = len(theta)
    if profiles is not None:
        z = profiles.at_zero
        if adjust == "maxz":
            p = adjusted_p(np.abs(z), covariance, adjust, df, spread)
        else:
            p = corrected(profiles.p.copy(), adjust)
        without_spread = int(((profiles.spread == 0) & (profiles.p == 1)).sum())
        return _classes(theta, z, p, alpha, adjust, without_spread)
    error = pair_variances(covariance)
    np.sqrt(error, out=error)
    z = np.empty_like(error)  # first the differences
    end = 0
    for item in range(n):
        start, end = end, end + n - 1 - item
        np.subtract(theta[item], theta[item + 1 :], out=z[start:end])
    certain = error == 0
    without_spread = int((np.abs(z[certain]) > TIED * np.abs(theta).max(initial=0.0)).sum())
    np.divide(z, error, out=z, where=~certain)
    z[certain] = 0.0
    p = adjusted_p(np.abs(z, out=error), covariance, adjust, df, spread)
    del error
    return _classes(theta, z, p, alpha, adjust, without_spread)


def _classes(theta: Floats, z: Floats, p: Floats, alpha: float, adjust: Adjust, without_spread: int) -> Classes:
    members = numbered(letter_display(_differing(p <= alpha, len(theta))), theta)
    return Classes(labelled(members, len(theta)), members, z, p, alpha, adjust, without_spread)


def _differing(differs: NDArray[np.bool_], n: int) -> NDArray[np.bool_]:
    """Return a symmetric matrix (n, n) from pairs i < j."""
    matrix = np.zeros((n, n), dtype=np.bool_)
    matrix[np.triu(np.ones((n, n), dtype=np.bool_), 1)] = differs
    return matrix | matrix.T


def _square(pairs: Floats, n: int) -> Floats:
    matrix = np.zeros((n, n))
    matrix[np.triu_indices(n, 1)] = pairs
    return matrix


def letter_display(differs: NDArray[np.bool_]) -> Letters:
    """Return sets of items such that two items share a set if and only if they are not distinguished.

    Parameters
    ----------
    differs
        Shape (n, n): symmetric, False on the diagonal.

    Raises
    ------
    TooManyClasses
        If on the way there are more than 2000 sets.
    """
    n = len(differs)
    packed = np.packbits(~np.asarray(differs), axis=1, bitorder="little")
    alike = [int.from_bytes(row.tobytes(), "little") for row in packed]
    columns: list[int] = []  # sets as bits
    for item in np.argsort(differs.sum(axis=0), kind="stable").tolist():  # this order meets the fewest columns
        met = [column & alike[item] for column in columns] or [0]
        columns = [column for column in columns if column & ~alike[item]]
        columns += [group | 1 << item for group in _largest(met)]
        if len(columns) > MOST_CLASSES:
            what = f"{n} items overlap in more than {MOST_CLASSES} classes"
            raise TooManyClasses(Finding(what, remedy="collect more answers, or compare fewer items"))
    return _swept(columns, n)


def classes_if_few(classified: Callable[[], Classes]) -> Classes | None:
    """Return what `classify` does, None where there are too many classes to list."""
    try:
        return classified()
    except TooManyClasses:
        return None


def _largest(groups: list[int]) -> list[int]:
    """Absorb: drop the groups that lie in another one."""
    kept: list[int] = []
    others: list[int] = []  # what is not in each group kept
    for group in sorted(dict.fromkeys(groups), key=int.bit_count, reverse=True):
        if all(map(group.__and__, others)):
            kept.append(group)
            others.append(~group)
    return kept


def _swept(sets: list[int], n: int) -> Letters:
    """Drop columns that no pair needs, the smallest first, then single memberships that no pair needs."""
    columns = sorted(((bits, _items(bits, n)) for bits in sets), key=lambda column: (len(column[1]), column[1]))
    last = _last(columns, n)
    kept = _needed(columns, last, n, whole=True)
    if len(kept) < len(columns):
        last = _last(kept, n)
    return tuple(frozenset(items) for _, items in _needed(kept, last, n, whole=False))


def _last(columns: list[Column], n: int) -> list[Pairs]:
    """Return for each column the pairs of items that no column after it has; an item is a pair with itself.

    They are the items with pairs, and with which others each of them, as bits.
    """
    after, last = [0] * n, []
    for bits, items in reversed(columns):
        last.append([(item, new) for item in items if (new := bits & ~after[item])])
        for item, new in last[-1]:
            after[item] |= new
    return last[::-1]


def _needed(columns: list[Column], last: list[Pairs], n: int, *, whole: bool) -> list[Column]:
    """Return the columns without the items that no pair needs there, or ``whole``; a column without items is dropped.

    A pair needs the ``last`` column that has both, unless they are in what is left of one before it.
    """
    kept, before = [], [0] * n
    for column, pairs in zip(columns, last, strict=True):
        needed = [item for item, others in pairs if others & ~before[item]]
        if not needed:
            continue
        bits, left = column if whole or len(needed) == len(column[1]) else (sum(1 << item for item in needed), needed)
        for item in left:
            before[item] |= bits
        kept.append((bits, left))
    return kept


def _items(column: int, n: int) -> Items:
    """Return the items of a column, in order."""
    data = np.frombuffer(column.to_bytes(-(-n // 8), "little"), dtype=np.uint8)
    items: Items = np.flatnonzero(np.unpackbits(data, bitorder="little")).tolist()
    return items


def labelled(members: tuple[tuple[int, ...], ...], n: int) -> tuple[str, ...]:
    """Return for each of ``n`` items the numbers of its classes, such as "3+4"."""
    numbers: list[list[str]] = [[] for _ in range(n)]
    for number, group in enumerate(members, start=1):
        for item in group:
            numbers[item].append(str(number))
    return tuple("+".join(names) for names in numbers)


def numbered(letters: Letters, theta: Floats) -> tuple[tuple[int, ...], ...]:
    """Order classes by their best item, then by their worst, best class first; members best first."""
    rank = {item: place for place, item in enumerate(best_first(theta))}
    groups = [tuple(sorted(letter, key=lambda item: rank[item])) for letter in letters]
    return tuple(sorted(groups, key=lambda group: (rank[group[0]], rank[group[-1]], len(group), group)))
