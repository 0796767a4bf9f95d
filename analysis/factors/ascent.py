"""Newton's method for strengths θ = Q γ that lie in a space with the orthonormal basis Q.

    g = Qᵀ f,  f_i = Σ_j (W_ij p_ji − W_ji p_ij),  v = N p (1 − p),  H = Qᵀ (diag(Σ_j v) − v) Q,  γ ← γ + H⁻¹ g

The step is halved while the likelihood falls. A Gaussian prior with standard deviation σ on each θ, θ having mean 0,
adds |γ|² / (2 σ²) to what is minimised: it does not depend on how the factors are coded.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.scaling.cells import Cells
from analysis.scaling.logistic import Logistic
from analysis.scaling.newton import MOST_HALVINGS, MOST_ITERATIONS, has_settled

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Where the ascent ended.

    Attributes
    ----------
    gamma
        Shape (p,): coordinates in the basis, in nats.
    theta
        Shape (n,): strengths in nats, mean 0.
    terms
        Shape (m,): log likelihood of each pair, without binomial coefficients.
    inverse
        Shape (p, p): inverse of the information of ``gamma``, or of the posterior's curvature.
    converged, iterations
        Whether the last step was below the tolerance; Newton steps taken.
    """

    gamma: Floats
    theta: Floats
    terms: Floats
    inverse: Floats
    converged: bool
    iterations: int

    @property
    def log_likelihood(self) -> float:
        """Σ W log p."""
        return float(self.terms.sum())


def climb(cells: Cells, basis: Floats, prior_sd: float | None = None) -> Fit:
    """Climb to the maximum of the likelihood, or of the posterior, which must exist.

    Parameters
    ----------
    basis
        Shape (n, p): orthonormal columns that sum to zero; p may be 0, where all strengths are equal.
    prior_sd
        σ in nats, above zero; None for no prior.
    """
    law = Logistic()
    width = basis.shape[1]
    precision = 0.0 if prior_sd is None else prior_sd**-2
    gamma = np.zeros(width)
    theta = basis @ gamma
    terms = law.log_likelihood(cells, cells.differences(theta, 0.0), 0.0)
    converged, iteration = width == 0, 0
    last_size = np.array([np.inf])
    while not converged and iteration < MOST_ITERATIONS:
        iteration += 1
        slopes = law.slopes(cells, cells.differences(theta, 0.0), 0.0)
        gradient = basis.T @ cells.net_flows(slopes.d) - precision * gamma
        step = _solve(_curvature(cells, basis, slopes.dd, precision), gradient)
        if not np.isfinite(step).all():
            break
        slack = 1e-14 * float(np.abs(terms).sum())
        share = 1.0
        for _ in range(MOST_HALVINGS):
            ahead = gamma + share * step
            theta = basis @ ahead
            ahead_terms = law.log_likelihood(cells, cells.differences(theta, 0.0), 0.0)
            # What the prior loses is |ahead|² − |gamma|², without cancellation.
            lost = precision / 2 * float((ahead - gamma) @ (ahead + gamma))
            if (ahead_terms - terms).sum() - lost >= -slack:
                break
            share /= 2
        gamma, terms = ahead, ahead_terms
        size = np.array([np.abs(step).max() / max(1.0, float(np.abs(theta).max()))])
        converged = bool(has_settled(size, last_size)[0])
        last_size = size
    slopes = law.slopes(cells, cells.differences(theta, 0.0), 0.0)
    inverse = _solve(_curvature(cells, basis, slopes.dd, precision), np.eye(width))
    return Fit(gamma, theta, terms, (inverse + inverse.T) / 2, converged, iteration)


def _curvature(cells: Cells, basis: Floats, weight: Floats, precision: float) -> Floats:
    weights = cells.matrix(weight)
    laplacian_times_basis = weights.sum(axis=1)[:, None] * basis - weights @ basis
    return np.asarray(basis.T @ laplacian_times_basis + precision * np.eye(basis.shape[1]))


def _solve(matrix: Floats, right: Floats) -> Floats:
    """Solve with unit diagonal; NaN where the matrix is singular in floating point."""
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = 1 / np.sqrt(np.diag(matrix))
    scale = unit if right.ndim == 1 else unit[:, None]
    try:
        return np.asarray(scale * np.linalg.solve(matrix * unit * unit[:, None], scale * right))
    except np.linalg.LinAlgError:
        return np.full_like(right, np.nan)
