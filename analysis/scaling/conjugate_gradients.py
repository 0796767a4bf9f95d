"""Newton steps for many items of which few pairs were compared, by preconditioned conjugate gradients.

H s = g is solved with the diagonal of H as preconditioner, each time only as far as the step deserves [Eisenstat1996]:
roughly at first, fully at the end. Nothing of size n² is made but by `SparseItems.covariance`, whose result is.
"""

from __future__ import annotations

import numpy as np

from analysis.scaling.counts import Counts
from analysis.scaling.designs import ITEMS, ModelDesign
from documents.arrays import Floats

ROUGHEST, FINEST = 0.1, 1e-6
WIDEST_RATIO = 1e6
# Below so many items, or above this share of all pairs, dense equations are solved faster.
FEWEST_SPARSE_ITEMS = 256
LARGEST_SPARSE_SHARE = 0.1


class SparseItems:
    """Each item has a strength of its own; the design of one fit to ``counts`` with a batch of one.

    ``products`` counts how often H was multiplied with a vector.
    """

    def __init__(self, counts: Counts) -> None:
        from scipy.sparse import csr_array

        n, edges = counts.n, np.arange(len(counts.first))
        rows = np.concatenate([counts.first, counts.second])
        columns = np.concatenate([counts.second, counts.first])
        order = np.argsort(rows, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=n))])
        self._edge = np.concatenate([edges, edges])[order]
        # A pair shown in both orders has two entries in a row, which a product adds.
        self._adjacency = csr_array((np.zeros(len(rows)), columns[order], starts), shape=(n, n))
        self._steepest = 0.0
        self._ratio = 1.0
        self.products = 0

    @property
    def is_exact(self) -> bool:
        """Whether the weights met last span few enough orders of magnitude for θ to be exact to 1e-10."""
        return self._ratio <= WIDEST_RATIO

    def solve(self, counts: Counts, weight: Floats, precision: float, right: Floats, ratio: float) -> Floats:
        """Return s, column by column; the first column of ``right`` is the slope of the likelihood."""
        weight = weight[0]
        self._ratio = ratio if weight.all() else np.inf
        slope = float(np.abs(right[0, :, 0]).max())
        self._steepest = max(self._steepest, slope)
        tolerance = max(FINEST, min(ROUGHEST, slope / self._steepest)) if slope else FINEST
        self._adjacency.data = weight[self._edge]
        strength = np.bincount(counts.first, weight, counts.n) + np.bincount(counts.second, weight, counts.n)
        diagonal: Floats = strength.astype(np.float64) + precision
        columns = [self._solved(diagonal, column, tolerance) for column in right[0].T]
        return np.stack(columns, axis=1)[None]

    def covariance(self, counts: Counts, weight: Floats, precision: float) -> Floats:
        """Return the pseudo-inverse, which is dense."""
        return ITEMS.covariance(counts, weight, precision)

    def _solved(self, diagonal: Floats, right: Floats, tolerance: float) -> Floats:
        solution = np.zeros_like(right)
        residual = right - right.mean()
        scaled = residual / diagonal
        direction = scaled.copy()
        rho = float(residual @ scaled)
        enough = rho * tolerance**2
        for _ in range(10 * len(right)):
            if rho <= enough or rho == 0:
                break
            product = diagonal * direction - self._adjacency @ direction
            self.products += 1
            length = rho / float(direction @ product)
            solution += length * direction
            residual -= length * product
            scaled = residual / diagonal
            following = float(residual @ scaled)
            direction = scaled + (following / rho) * direction
            rho = following
        solution -= solution.mean()
        return solution


def items_design(counts: Counts) -> ModelDesign:
    """Return the design of free strengths: `ITEMS`, or conjugate gradients where few of many pairs were compared."""
    n, pairs = counts.n, len(counts.first)
    if len(counts.won) > 1 or n < FEWEST_SPARSE_ITEMS or pairs > LARGEST_SPARSE_SHARE * n * (n - 1) / 2:
        return ITEMS
    return SparseItems(counts)
