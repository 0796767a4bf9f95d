"""Newton's method for Bradley-Terry strengths, for many matrices of counts at once.

For counts W (W_ij: how often i was preferred over j), N = W + Wᵀ, and p_ij the model's probability of i over j:

    g = Σ_j (W_ij p_ji − W_ji p_ij),  v = N p (1 − p),  H = diag(Σ_j v) − v,  H s = g,  θ ← θ + s

s is taken with sum zero, and halved while the likelihood falls. A fit has converged once the largest entry of s is
below 1e-10, or below 1e-6 and no longer shrinking: rounding then is all that moves it, as happens where an item won
against one that is stronger by far.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.scaling import laplacian
from analysis.scaling.pair_counts import PairCounts

Floats = NDArray[np.float64]

MOST_ITERATIONS = 200
STEP_TOLERANCE = 1e-10
STALL_TOLERANCE = 1e-6
MOST_HALVINGS = 60


def maximise(
    wins: Floats, most_iterations: int = MOST_ITERATIONS
) -> tuple[Floats, Floats, NDArray[np.intp], NDArray[np.bool_]]:
    """Return theta (B, n) with mean 0, and log likelihood, iterations and convergence (B,).

    Parameters
    ----------
    wins
        Shape (B, n, n): counts as in `analysis.scaling.bradley_terry.fit_batch`, each matrix strongly connected.
        Replicates
        leave the iteration as they converge.
    most_iterations
        Steps after which the rest stops without having converged.
    """
    batch, n, _ = wins.shape
    theta_all = np.zeros((n, batch))
    log_likelihood = np.zeros(batch)
    iterations = np.zeros(batch, dtype=np.intp)
    converged = np.zeros(batch, dtype=np.bool_)
    active = np.arange(batch)
    counts = PairCounts.from_wins(wins)
    theta = np.zeros((n, batch))
    terms, odds = counts.log_likelihood(theta)
    last_size = np.full(batch, np.inf)
    for iteration in range(1, most_iterations + 1):
        flow, weight = counts.slopes(theta, odds)
        weights = counts.matrix(weight)
        exact = laplacian.span(weights) > laplacian.WIDEST_FOR_PLAIN_SUMS
        gradient = laplacian.net_flows(flow, counts.first, counts.second, n, exact=exact)
        step = laplacian.solve(weights, gradient[:, None])[:, 0]
        theta, terms, odds = _climb(counts, theta, step, terms)
        size = np.abs(step).max(axis=0) / np.maximum(np.abs(theta).max(axis=0), 1)
        done = has_settled(size, last_size)
        if done.any() or iteration == most_iterations:
            theta_all[:, active], log_likelihood[active] = theta, terms.sum(axis=0)
            iterations[active], converged[active] = iteration, done
            if done.all():
                break
            left = ~done
            active, counts, theta = active[left], counts.select(left), theta[:, left]
            terms, odds, size = terms[:, left], odds[:, left], size[left]
        last_size = size
    return (theta_all - theta_all.mean(axis=0)).T, log_likelihood, iterations, converged


def has_settled(size: Floats, last_size: Floats) -> NDArray[np.bool_]:
    """Say whether steps of ``size``, relative to θ where that is above 1, after ``last_size``, mean convergence."""
    settled: NDArray[np.bool_] = (size <= STEP_TOLERANCE) | ((size <= STALL_TOLERANCE) & (size > last_size / 2))
    return settled


def _climb(counts: PairCounts, theta: Floats, step: Floats, terms: Floats) -> tuple[Floats, Floats, Floats]:
    """Go along ``step``, halved for each replicate whose likelihood falls by more than rounding."""
    slack = 1e-14 * np.abs(terms).sum(axis=0)
    share = np.ones(theta.shape[1])
    for _ in range(MOST_HALVINGS):
        ahead = theta + share * step
        ahead_terms, ahead_odds = counts.log_likelihood(ahead)
        falls = (ahead_terms - terms).sum(axis=0) < -slack
        if not falls.any():
            break
        share[falls] /= 2
    return ahead, ahead_terms, ahead_odds
