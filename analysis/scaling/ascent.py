"""Newton's method for strengths together with a law's own parameter and an order effect.

The information of θ is a graph's Laplacian H, solved as `analysis.scaling.laplacian` does, exact for strengths far
apart. The
further parameters border it: with B the information between them and θ, and C their own, the step is found by the
Schur complement S = C − Bᵀ H⁺ B. A Gaussian prior with standard deviation σ on each θ adds 1/(n σ²) to the weight of
every pair: on vectors that sum to zero that is I/σ².
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.scaling import laplacian
from analysis.scaling.cells import Cells
from analysis.scaling.law import Law, Slopes
from analysis.scaling.newton import MOST_HALVINGS, MOST_ITERATIONS, has_settled

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """Where a fit stands: strengths (n,) with sum zero, the law's parameter, and the order effect."""

    theta: Floats
    k: float = 0.0
    order: float = 0.0

    def moved(self, theta: Floats, further: Floats, law: Law, cells: Cells, share: float) -> Point:
        """Return the point a ``share`` of a step away."""
        steps = iter(further.tolist())
        k = self.k + share * next(steps) if law.parameter else self.k
        order = self.order + share * next(steps) if cells.ordered else self.order
        return Point(self.theta + share * theta, k, order)


@dataclass(frozen=True, slots=True, eq=False)
class Top:
    """Where the ascent ended; ``log_posterior`` is the log likelihood where there is no prior."""

    point: Point
    log_likelihood: float
    log_posterior: float
    iterations: int
    converged: bool


def maximise(cells: Cells, law: Law, prior_sd: float | None = None, most_iterations: int = MOST_ITERATIONS) -> Top:
    """Climb to the maximum of the likelihood, or of the posterior under a Gaussian prior.

    The maximum must exist: see `analysis.scaling.existence`.
    """
    point = Point(np.zeros(cells.n), law.start(cells))
    terms = _terms(cells, law, point, prior_sd)
    converged, iteration = False, 0
    last_size = np.array([np.inf])
    while not converged and iteration < most_iterations:
        iteration += 1
        slopes = law.slopes(cells, cells.differences(point.theta, point.order), point.k)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            theta, further = _step(cells, law, slopes, point, prior_sd)
        if not (np.isfinite(theta).all() and np.isfinite(further).all()):
            break
        slack = 1e-14 * float(np.abs(terms).sum())
        share = 1.0
        for _ in range(MOST_HALVINGS):
            ahead = point.moved(theta, further, law, cells, share)
            ahead_terms = _terms(cells, law, ahead, prior_sd)
            if (ahead_terms - terms).sum() >= -slack:
                break
            share /= 2
        point, terms = ahead, ahead_terms
        largest = max(float(np.abs(theta).max()), float(np.abs(further).max(initial=0.0)))
        size = np.array([largest / max(1.0, float(np.abs(point.theta).max()))])
        converged = bool(has_settled(size, last_size)[0])
        last_size = size
    point = Point(point.theta - point.theta.mean(), point.k, point.order)
    terms = _terms(cells, law, point, None)
    prior = _log_prior(point, prior_sd)
    likelihood = float(terms.sum())
    return Top(point, likelihood, likelihood + prior, iteration, converged)


def joint_covariance(cells: Cells, law: Law, point: Point, prior_sd: float | None = None) -> Floats:
    """Return the inverse of the observed information at ``point``: of θ, then of the further parameters.

    Shape (n + f, n + f), on strengths that sum to zero.
    """
    slopes = law.slopes(cells, cells.differences(point.theta, point.order), point.k)
    inverse = laplacian.pseudo_inverse(_weights(cells, slopes, prior_sd))
    border, corner = _border(cells, law, slopes)
    if not border.shape[1]:
        return inverse
    across = inverse @ border
    own = np.linalg.inv(corner - border.T @ across)
    block = -across @ own
    joint = np.block([[inverse - block @ across.T, block], [block.T, own]])
    symmetric: Floats = (joint + joint.T) / 2
    return symmetric


def _step(cells: Cells, law: Law, slopes: Slopes, point: Point, prior_sd: float | None) -> tuple[Floats, Floats]:
    gradient = cells.net_flows(slopes.d)
    if prior_sd is not None:
        gradient = gradient - point.theta / prior_sd**2
    border, corner = _border(cells, law, slopes)
    own = [slopes.k.sum()] if law.parameter else []
    own += [slopes.d.sum()] if cells.ordered else []
    right = np.column_stack([gradient - gradient.mean(), border - border.mean(axis=0)])
    solved = laplacian.solve(_weights(cells, slopes, prior_sd)[:, :, None], right[:, :, None])[:, :, 0]
    if not own:
        return solved[:, 0], np.empty(0)
    further: Floats = np.linalg.solve(
        corner - border.T @ solved[:, 1:], np.array(own) - border.T @ solved[:, 0]
    ).astype(np.float64)
    return solved[:, 0] - solved[:, 1:] @ further, further


def _border(cells: Cells, law: Law, slopes: Slopes) -> tuple[Floats, Floats]:
    """Return the information between θ and the further parameters (n, f), and theirs (f, f)."""
    columns, corner = [], np.array([[slopes.kk.sum(), slopes.dk.sum()], [slopes.dk.sum(), slopes.dd.sum()]])
    chosen = [bool(law.parameter), cells.ordered]
    if law.parameter:
        columns.append(cells.net_flows(slopes.dk))
    if cells.ordered:
        columns.append(cells.net_flows(slopes.dd))
    border = np.column_stack(columns) if columns else np.empty((cells.n, 0))
    return border, corner[np.ix_(chosen, chosen)]


def _weights(cells: Cells, slopes: Slopes, prior_sd: float | None) -> Floats:
    weights = cells.matrix(slopes.dd)
    if prior_sd is not None:
        weights += 1 / (cells.n * prior_sd**2)
        np.fill_diagonal(weights, 0.0)
    return weights


def _terms(cells: Cells, law: Law, point: Point, prior_sd: float | None) -> Floats:
    terms = law.log_likelihood(cells, cells.differences(point.theta, point.order), point.k)
    return terms if prior_sd is None else np.append(terms, _log_prior(point, prior_sd))


def _log_prior(point: Point, prior_sd: float | None) -> float:
    return 0.0 if prior_sd is None else float(-(point.theta**2).sum() / (2 * prior_sd**2))
