"""Counts of answers by compared pair: what every model of paired comparison is fitted to.

The container lists only pairs that were compared, so that thousands of items of which few pairs met stay small. The
first axis of its arrays is the batch, such as the replicates of a bootstrap; in memory the batch runs fastest, since
one step of an algorithm then serves the whole batch at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.scaling.laplacian import split
from documents import Finding

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


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

    @classmethod
    def from_wins(cls, wins: Floats) -> Counts:
        """List the pairs that occur in any of the matrices ``wins``, shape (B, n, n)."""
        batch, n, _ = wins.shape
        summed = wins[0] if batch == 1 else wins.sum(axis=0)
        first, second = np.nonzero(np.triu(summed + summed.T, 1))
        won, lost = (np.ascontiguousarray(wins[:, a, b].T).T for a, b in ((first, second), (second, first)))
        return cls(n, first, second, won, lost, _no_ties(batch, len(first)))

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
        strengths = theta.T
        apart: Floats = (strengths[self.first] - strengths[self.second]).T
        return apart + order if self.ordered else apart

    def net_flows(self, flow: Floats, *, exact: bool = True) -> Floats:
        """Return what flows into each item along pairs: ``flow`` (B, m) to ``first``, its negative to ``second``.

        Parameters
        ----------
        exact
            Sum as if in twice the precision, in two parts as `analysis.scaling.laplacian.split` gives them.

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

    def matrix(self, values: Floats) -> Floats:
        """Spread ``values`` (B, m) over symmetric matrices (B, n, n)."""
        return self._spread(values, values).transpose(2, 0, 1)

    def _spread(self, values: Floats, mirrored: Floats) -> Floats:
        """Return a matrix (n, n, B) of ``values`` at (first, second) and ``mirrored`` at (second, first), added."""
        matrix = np.zeros((self.n, self.n, len(values)))
        matrix[self.first, self.second] = values.T
        if self.ordered:
            back = np.zeros_like(matrix)
            back[self.second, self.first] = mirrored.T
            return np.asarray(matrix + back)
        matrix[self.second, self.first] = mirrored.T
        return matrix


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


def _summed(place: Indices, values: Floats, size: int) -> Floats:
    return np.bincount(place, values, size).astype(np.float64, copy=False)


def _no_ties(batch: int, pairs: int) -> Floats:
    return np.broadcast_to(np.zeros(1), (batch, pairs))
