"""Answers counted by pair, or by pair and order: what every law of paired comparison is fitted to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.scaling.laplacian import split
from documents import Finding

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Counts of m pairs of n items.

    Attributes
    ----------
    n
        Number of items.
    first, second
        Shape (m,): indices of the items of a pair. If ``ordered``, ``first`` was shown first, and a pair may stand
        there in both orders; otherwise each pair stands there once.
    won, lost, tied
        Shape (m,): how often ``first`` was preferred, ``second``, and neither; their sum is above zero.
    ordered
        Whether the cells tell which item was shown first.
    """

    n: int
    first: Indices
    second: Indices
    won: Floats
    lost: Floats
    tied: Floats
    ordered: bool

    @property
    def total(self) -> Floats:
        """Shape (m,): how often the pair was compared."""
        return self.won + self.lost + self.tied

    def differences(self, theta: Floats, order: float) -> Floats:
        """Return what speaks for ``first``: θ_first − θ_second, with ``order`` added if the cells are ordered."""
        apart: Floats = theta[self.first] - theta[self.second]
        return apart + order if self.ordered else apart

    def net_flows(self, flow: Floats) -> Floats:
        """Return what flows into each item: ``flow`` (m,) to ``first``, its negative to ``second``."""
        sums: Floats = np.zeros(self.n)
        for part in split(flow, max(self.n, len(flow))):
            sums += np.bincount(self.first, part, self.n) - np.bincount(self.second, part, self.n)
        return sums

    def matrix(self, values: Floats) -> Floats:
        """Sum ``values`` (m,) into a symmetric matrix (n, n)."""
        sums = np.bincount(self.first * self.n + self.second, values, self.n**2).reshape(self.n, self.n)
        return np.asarray(sums + sums.T, dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Which cell each answer fell into: ``cell``, ``outcome`` (0 won, 1 lost, 2 tied), ``observer``, ``count``."""

    cell: Indices
    outcome: Indices
    observer: Indices
    count: Floats


def count_cells(comparisons: Comparisons, *, ordered: bool, ties: bool) -> tuple[Cells, Lines]:
    """Count the answers by pair, or by pair and order; answers that prefer neither only with ``ties``.

    Raises
    ------
    ResultsError
        If ``ordered`` and the source does not say of every answer which item was shown first.
    """
    tied = comparisons.tied
    one, other = comparisons.winner, comparisons.loser
    observer, count, one_first = comparisons.observer, comparisons.count, comparisons.winner_was_first
    kind = np.zeros(len(one), dtype=np.intp)
    if ties:
        one, other = np.r_[one, tied.one], np.r_[other, tied.other]
        observer, count = np.r_[observer, tied.observer], np.r_[count, tied.count]
        one_first = np.r_[one_first, tied.one_was_first]
        kind = np.r_[kind, np.full(len(tied.one), 2)]
    if ordered:
        untold = float(count[one_first < 0].sum())
        if untold:
            what = f"{untold:g} of {count.sum():g} answers do not say which item was shown first"
            raise ResultsError(Finding(what, remedy="note it for every answer, or leave the order effect out"))
        flipped = one_first == 0
    else:
        flipped = one > other
    n = len(comparisons.items)
    first, second = np.where(flipped, other, one), np.where(flipped, one, other)
    outcome = np.where(kind == 2, 2, flipped.astype(np.intp))
    pairs, cell = np.unique(first * n + second, return_inverse=True)
    won, lost, even = (np.bincount(cell[outcome == o], count[outcome == o], len(pairs)).astype(float) for o in range(3))
    cells = Cells(n, pairs // n, pairs % n, won, lost, even, ordered)
    return cells, Lines(cell.astype(np.intp), outcome, observer, count)
