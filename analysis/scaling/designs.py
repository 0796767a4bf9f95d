"""What the strengths are free to do: one for each item, or combinations of the columns of a matrix.

A design solves the linear equations of a Newton step, and knows in which way: `Items` solves the Laplacian of all items
as `analysis.covariance.laplacian` does, `SparseItems` by conjugate gradients where few pairs were compared, `Columns`
for strengths θ = Q γ in a space with the orthonormal basis Q, such as that of stimulus factors.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from analysis.covariance import laplacian
from analysis.scaling.counts import Counts
from documents.arrays import Floats


class ModelDesign(Protocol):
    """How to solve (H + precision) s = g for strengths of the design; H is the Laplacian of the pairs' weights."""

    @property
    def is_exact(self) -> bool:
        """Whether the weights met so far let the solution keep its digits."""
        ...

    def solve(self, counts: Counts, weight: Floats, precision: float, right: Floats, ratio: float) -> Floats:
        """Return s. Shapes (B, m) of ``weight`` and (B, n, r) of ``right`` to (B, n, r); ``ratio`` is `pair_span`'s."""
        ...

    def covariance(self, counts: Counts, weight: Floats, precision: float) -> Floats:
        """Return the inverse of H + precision on strengths of the design, shape (B, n, n)."""
        ...


class Items:
    """Each item has a strength of its own; their sum is zero."""

    is_exact = True

    def solve(self, counts: Counts, weight: Floats, precision: float, right: Floats, ratio: float) -> Floats:
        """Return s, which sums to zero."""
        return laplacian.solve(counts.matrix(weight), right, precision, ratio)

    def covariance(self, counts: Counts, weight: Floats, precision: float) -> Floats:
        """Return the pseudo-inverse."""
        return laplacian.pseudo_inverse(counts.matrix(weight), precision, laplacian.pair_span(weight), overwrite=True)


class Columns:
    """Strengths θ = Q γ, with ``basis`` Q of shape (n, p): orthonormal columns that sum to zero; p may be 0."""

    is_exact = True

    def __init__(self, basis: Floats) -> None:
        self.basis = basis

    def solve(self, counts: Counts, weight: Floats, precision: float, right: Floats, ratio: float) -> Floats:
        """Return Q (QᵀHQ + precision)⁻¹ Qᵀ g; NaN where the matrix is singular in floating point."""
        along = self.basis.T @ right
        return np.asarray(self.basis @ _solved(self._curvature(counts, weight, precision), along))

    def covariance(self, counts: Counts, weight: Floats, precision: float) -> Floats:
        """Return Q (QᵀHQ + precision)⁻¹ Qᵀ."""
        return np.asarray(self.basis @ self.inverse(counts, weight, precision) @ self.basis.T)

    def inverse(self, counts: Counts, weight: Floats, precision: float) -> Floats:
        """Return the covariance of γ, shape (B, p, p)."""
        curvature = self._curvature(counts, weight, precision)
        inverse = _solved(curvature, np.broadcast_to(np.eye(curvature.shape[-1]), curvature.shape))
        return np.asarray((inverse + inverse.transpose(0, 2, 1)) / 2)

    def _curvature(self, counts: Counts, weight: Floats, precision: float) -> Floats:
        weights = counts.matrix(weight)
        times_basis = weights.sum(axis=2)[:, :, None] * self.basis - weights @ self.basis
        return np.asarray(self.basis.T @ times_basis + precision * np.eye(self.basis.shape[1]))


ITEMS: ModelDesign = Items()


def outweighed(counts: Counts, design: ModelDesign = ITEMS) -> bool:
    """Return whether what links some compared pair, directly or not, is worth less than an answer, as Firth's term."""
    total = counts.total
    if not ((total > 0) & (total < 1)).any():
        return False
    apart = laplacian.contrast_variances(design.covariance(counts, total, 0.0))[:, counts.first, counts.second]
    return bool((apart[total > 0] > 1 + 1e-9).any())


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Solve with unit diagonal; NaN where the matrix is singular in floating point."""
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = 1 / np.sqrt(np.diagonal(matrix, axis1=1, axis2=2))[:, :, None]
    try:
        return np.asarray(unit * np.linalg.solve(matrix * unit * unit.transpose(0, 2, 1), unit * right))
    except np.linalg.LinAlgError:
        return np.full_like(right, np.nan)
