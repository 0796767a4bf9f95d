"""Firth's penalised fit: finite strengths even for an item that always wins [Firth1993].

Maximises l(θ) + ½ log det H on the vectors that sum to zero (Jeffreys' prior). The gradient is that of the plain
likelihood with h/2 wins added on both sides of each pair, h_ij = v_ij var(θ_i − θ_j) being the pair's leverage: the
fit is a sequence of plain Newton steps on counts that are updated with θ.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.scaling import laplacian

Floats = NDArray[np.float64]

MOST_ITERATIONS = 1000
STEP_TOLERANCE = 1e-12
MOST_HALVINGS = 60


def maximise(wins: Floats) -> tuple[Floats, int, bool]:
    """Return theta (n,) with mean 0, the iterations and whether they converged.

    Parameters
    ----------
    wins
        Shape (n, n): counts as in `analysis.scaling.bradley_terry.fit`, every item linked to every other by
        comparisons.
    """
    from scipy.special import expit

    totals = wins + wins.T
    first, second = np.nonzero(np.triu(totals, 1))
    theta = np.zeros(len(wins))
    objective = penalised_log_likelihood(wins, theta)
    for iteration in range(1, MOST_ITERATIONS + 1):
        p = expit(theta[:, None] - theta[None, :])
        weights = totals * p * p.T
        leverage = weights * laplacian.contrast_variances(laplacian.pseudo_inverse(weights))
        flow = ((wins + leverage / 2) * p.T)[first, second] - ((wins + leverage / 2) * p.T)[second, first]
        gradient = laplacian.net_flows(flow[:, None], first, second, len(wins), exact=True)
        step = laplacian.solve(((totals + leverage) * p * p.T)[:, :, None], gradient[:, None])[:, 0, 0]
        slack = 1e-12 * (1 + abs(objective))
        share = 1.0
        for _ in range(MOST_HALVINGS):
            ahead = theta + share * step
            objective_ahead = penalised_log_likelihood(wins, ahead)
            if objective_ahead >= objective - slack:
                break
            share /= 2
        theta, objective = ahead, objective_ahead
        if np.abs(step).max() <= STEP_TOLERANCE * max(1.0, float(np.abs(theta).max())):
            return theta - theta.mean(), iteration, True
    return theta - theta.mean(), MOST_ITERATIONS, False


def penalised_log_likelihood(wins: Floats, theta: Floats) -> float:
    """Return l(θ) + ½ log det H, the determinant taken on the vectors that sum to zero, up to a constant."""
    from scipy.special import expit, log_expit

    difference = theta[:, None] - theta[None, :]
    p = expit(difference)
    weights = (wins + wins.T) * p * p.T
    information = np.diag(weights.sum(axis=1)) - weights
    # Leaving out one row and column divides the determinant by n, a constant.
    _, log_determinant = np.linalg.slogdet(information[1:, 1:])
    return float((wins * log_expit(difference)).sum() + log_determinant / 2)
