"""Counts of answers by compared pair: what every model of paired comparison is fitted to.

The container lists only pairs that were compared, so that thousands of items of which few pairs met stay small. The
first axis of its arrays is the batch, such as the replicates of a bootstrap; in memory the batch runs fastest, since
one step of an algorithm then serves the whole batch at once.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.comparisons import Comparisons
from analysis.covariance.laplacian import split
from analysis.errors import ResultsError
from documents import Finding
from documents.arrays import Floats, Indices

if TYPE_CHECKING:
    from scipy.sparse import csr_array

MOST_ITEMS_KEPT = 256


@dataclass(frozen=True, slots=True, eq=False)
class Counts:
    """Counts of m pairs of n items in B replicates.

    Attributes
    ----------
    n
        Number of items.
    first, second
        Shape (m,): indices of the items of a pair. If ``ordered``, ``first`` was shown first, and a pair may occur in
        both orders; otherwise each pair occurs once.
    won, lost, tied
        Shape (B, m): how often ``first`` was preferred, ``second``, and neither. ``tied`` is all zero for a law
        without ties.
    ordered
        Whether the pairs say which item was shown first.
    """

    n: int
    first: Indices
    second: Indices
    won: Floats
    lost: Floats
    tied: Floats
    ordered: bool = False
    _cells: list[Indices] = field(default_factory=list, init=False, repr=False)

    @property
    def cells(self) -> list[Indices]:
        """Places of (first, second) and of (second, first) in a matrix (n, n) row by row, computed once."""
        if not self._cells:
            self._cells.extend((self.first * self.n + self.second, self.second * self.n + self.first))
        return self._cells

    @classmethod
    def from_wins(cls, wins: Floats) -> Counts:
        """List the pairs that occur in any of the matrices ``wins``, shape (B, n, n)."""
        batch, n, _ = wins.shape
        happened = np.asarray(wins.any(axis=0))
        if n <= MOST_ITEMS_KEPT:
            pairs = _all_pairs(n)
            compared = happened.take(pairs[2]) | happened.take(pairs[3])
            first, second, cells, mirrored = pairs if compared.all() else (part[compared] for part in pairs)
        else:
            first, second, cells, mirrored = _pairs(n, happened | happened.T)
        each = wins.reshape(batch, n * n).T
        won, lost = each.take(cells, axis=0).T, each.take(mirrored, axis=0).T
        counts = cls(n, first, second, won, lost, _no_ties(batch, len(first)))
        counts._cells.extend((cells, mirrored))
        return counts

    @classmethod
    def from_sparse(cls, wins: csr_array) -> Counts:
        """List the pairs of a SciPy sparse array (n, n), as one replicate."""
        n = wins.shape[0]
        edges = wins.tocoo()
        pair = np.minimum(edges.row, edges.col).astype(np.intp) * n + np.maximum(edges.row, edges.col)
        pairs, place = np.unique(pair, return_inverse=True)
        ahead = edges.row < edges.col
        won, lost = (_summed(place[side], edges.data[side], len(pairs))[None] for side in (ahead, ~ahead))
        return cls(n, pairs // n, pairs % n, won, lost, _no_ties(1, len(pairs)))

    @property
    def total(self) -> Floats:
        """Shape (B, m): how often the pair was compared."""
        return self.won + self.lost + self.tied

    def select(self, replicates: NDArray[np.bool_]) -> Counts:
        """Return the counts of some of the replicates."""
        won, lost, tied = (part.T[:, replicates].T for part in (self.won, self.lost, self.tied))
        return Counts(self.n, self.first, self.second, won, lost, tied, self.ordered)

    def without_order(self) -> Counts:
        """Return the same counts by pair, whichever item was shown first."""
        flipped = self.first > self.second
        low, high = np.minimum(self.first, self.second), np.maximum(self.first, self.second)
        pairs, place = np.unique(low * self.n + high, return_inverse=True)
        won, lost = np.where(flipped, self.lost, self.won), np.where(flipped, self.won, self.lost)
        won, lost, tied = (
            np.stack([_summed(place, row, len(pairs)) for row in part]) for part in (won, lost, self.tied)
        )
        return Counts(self.n, pairs // self.n, pairs % self.n, won, lost, tied)

    def differences(self, theta: Floats, order: Floats | float = 0.0) -> Floats:
        """Return what speaks for ``first``: θ_first − θ_second, plus ``order`` (B, 1) if the pairs are ordered.

        Shapes (B, n) to (B, m).
        """
        if len(theta) == 1:
            apart: Floats = (theta[0][self.first] - theta[0][self.second])[None]
        else:
            strengths = theta.T
            apart = (strengths[self.first] - strengths[self.second]).T
        return apart + order if self.ordered else apart

    def net_flows(self, flow: Floats, *, exact: bool = True) -> Floats:
        """Return what flows into each item along pairs: ``flow`` (B, m) to ``first``, its negative to ``second``.

        Parameters
        ----------
        exact
            Sum as if in twice the precision, in two parts as `analysis.covariance.laplacian.split` gives them.

        Returns
        -------
        Shape (B, n).
        """
        if not exact:
            return self._net_flows(flow)
        high, low = split(flow, max(self.n, len(self.first)))
        return self._net_flows(high) + self._net_flows(low)

    def _net_flows(self, flow: Floats) -> Floats:
        n = self.n
        if len(flow) == 1:
            return (_summed(self.first, flow[0], n) - _summed(self.second, flow[0], n))[None]
        matrix = self._spread(flow, -flow)
        return np.asarray(matrix.sum(axis=1)).T

    def wins(self) -> Floats:
        """Return how often each item was preferred over each other one, shape (B, n, n)."""
        return self._spread(self.won, self.lost).transpose(2, 0, 1)

    def matrix(self, values: Floats) -> Floats:
        """Spread ``values`` (B, m) over symmetric matrices (B, n, n)."""
        return self._spread(values, values).transpose(2, 0, 1)

    def _spread(self, values: Floats, mirrored: Floats) -> Floats:
        """Return a matrix (n, n, B) of ``values`` at (first, second) and ``mirrored`` at (second, first), added."""
        n, single = self.n, len(values) == 1
        there, back = (values[0], mirrored[0]) if single else (values.T, mirrored.T)
        matrix = np.zeros((n * n, *there.shape[1:]))
        cells, mirror = self.cells
        matrix[cells] = there
        if self.ordered:
            matrix[mirror] += back
        else:
            matrix[mirror] = back
        return matrix.reshape(n, n, len(values))


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """Kinds of answers: ``pair``, ``outcome`` (0 won, 1 lost, 2 tied), ``observer`` and ``count``, each of shape (k,).

    ``pair`` indexes the pairs of `Counts`.
    """

    pair: Indices
    outcome: Indices
    observer: Indices
    count: Floats


def count_pairs(comparisons: Comparisons, *, ordered: bool = False, ties: bool = False) -> tuple[Counts, Answers]:
    """Count the answers by pair, or by pair and order; answers that prefer neither only with ``ties``.

    Raises
    ------
    ResultsError
        If ``ordered`` and the source does not say of every answer which item was shown first.
    """
    tied = comparisons.tied
    item_a, item_b = comparisons.winner, comparisons.loser
    observer, count, a_first = comparisons.observer, comparisons.count, comparisons.winner_was_first
    kind = np.zeros(len(item_a), dtype=np.intp)
    if ties:
        item_a, item_b = np.r_[item_a, tied.item_a], np.r_[item_b, tied.item_b]
        observer, count = np.r_[observer, tied.observer], np.r_[count, tied.count]
        a_first = np.r_[a_first, tied.a_was_first]
        kind = np.r_[kind, np.full(len(tied.item_a), 2)]
    if ordered:
        unknown = float(count[a_first < 0].sum())
        if unknown:
            what = f"{unknown:g} of {count.sum():g} answers do not say which item was shown first"
            raise ResultsError(Finding(what, remedy="note it for every answer, or leave the order effect out"))
        flipped = a_first == 0
    else:
        flipped = item_a > item_b
    n = len(comparisons.items)
    first, second = np.where(flipped, item_b, item_a), np.where(flipped, item_a, item_b)
    outcome = np.where(kind == 2, 2, flipped.astype(np.intp))
    pairs, pair = np.unique(first * n + second, return_inverse=True)
    won, lost, even = (_summed(pair[outcome == kind], count[outcome == kind], len(pairs))[None] for kind in range(3))
    counts = Counts(n, pairs // n, pairs % n, won, lost, even, ordered)
    return counts, Answers(pair.astype(np.intp), outcome, observer, count)


@lru_cache(maxsize=4)
def _all_pairs(n: int) -> tuple[Indices, Indices, Indices, Indices]:
    """Return `_pairs` of all items, kept for the next table of as many; not to be written to."""
    pairs = _pairs(n, np.ones((n, n), dtype=np.bool_))
    for part in pairs:
        part.flags.writeable = False
    return pairs


def _pairs(n: int, compared: NDArray[np.bool_]) -> tuple[Indices, Indices, Indices, Indices]:
    """Return the items of the pairs ``compared`` (n, n) above the diagonal, and their two places in such a matrix."""
    cells = np.flatnonzero(np.triu(compared, 1))
    first, second = np.divmod(cells, n)
    return first, second, cells, second * n + first


def _summed(place: Indices, values: Floats, size: int) -> Floats:
    return np.bincount(place, values, size).astype(np.float64, copy=False)


def _no_ties(batch: int, pairs: int) -> Floats:
    return np.ndarray((batch, pairs), np.float64, np.zeros(1), strides=(0, 0))
