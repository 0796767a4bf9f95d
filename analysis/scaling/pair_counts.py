"""The counts of a batch of comparisons as a list of compared pairs, and the Bradley-Terry likelihood on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PairCounts:
    """Counts of m pairs of n items in B replicates.

    ``first`` and ``second``, shape (m,), index the items of a pair, each pair once; ``won`` and ``lost``, shape
    (m, B), say how often the first item was preferred over the second and the other way round.
    """

    n: int
    first: NDArray[np.intp]
    second: NDArray[np.intp]
    won: Floats
    lost: Floats

    @classmethod
    def from_wins(cls, wins: Floats) -> PairCounts:
        """List the pairs that occur in any of the matrices ``wins``, shape (B, n, n)."""
        summed = wins.sum(axis=0)
        first, second = np.nonzero(np.triu(summed + summed.T, 1))
        won, lost = (np.ascontiguousarray(wins[:, a, b].T) for a, b in ((first, second), (second, first)))
        return cls(wins.shape[1], first, second, won, lost)

    def select(self, replicates: NDArray[np.bool_]) -> PairCounts:
        """Return the counts of some of the replicates."""
        return PairCounts(self.n, self.first, self.second, self.won[:, replicates], self.lost[:, replicates])

    def log_likelihood(self, theta: Floats) -> tuple[Floats, Floats]:
        """Return each pair's W_ij log p_ij + W_ji log p_ji at ``theta`` (n, B), and exp(−|θ_i − θ_j|); (m, B)."""
        difference = theta[self.first] - theta[self.second]
        odds = np.exp(-np.abs(difference))
        terms: Floats = self.won * np.minimum(difference, 0) - self.lost * np.maximum(difference, 0)
        terms -= (self.won + self.lost) * np.log1p(odds)
        return terms, odds

    def slopes(self, theta: Floats, odds: Floats) -> tuple[Floats, Floats]:
        """Return r = W_ij p_ji − W_ji p_ij, what pulls the pair apart, and v = N p (1 − p); (m, B).

        Both factors of v and all of r's terms keep their relative precision however small they are.
        """
        ahead = theta[self.first] >= theta[self.second]
        share = 1 / (1 + odds)
        p = np.where(ahead, share, odds * share)
        q = np.where(ahead, odds * share, share)
        return self.won * q - self.lost * p, (self.won + self.lost) * p * q

    def matrix(self, values: Floats) -> Floats:
        """Spread ``values`` (m, B) over symmetric matrices (n, n, B)."""
        matrix = np.zeros((self.n, self.n, values.shape[1]))
        matrix[self.first, self.second] = values
        matrix[self.second, self.first] = values
        return matrix
