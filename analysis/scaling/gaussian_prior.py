"""Bradley-Terry strengths under a Gaussian prior: finite, with a covariance, for any answers, even for none.

Each θ_i is normal about 0 with standard deviation σ. The posterior's mode is found by Newton's method, and its
covariance is taken from the curvature there (Laplace's approximation):

    g = Σ_j (W_ij p_ji − W_ji p_ij) − θ / σ²,  v = N p (1 − p),  H = diag(Σ_j v) − v + I / σ²,  θ ← θ + H⁻¹ g

σ itself is learnt from the answers (empirical Bayes), by the fixed point of [MacKay1992]: σ² is the sum of squares of
the strengths about their mean over as many of them as the answers determine, n − 1 − Σ var θ / σ². Without that,
answers to pairs that were chosen for being close make strengths seem further apart than they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MOST_ITERATIONS = 100
STEP_TOLERANCE = 1e-10
MOST_HALVINGS = 60
# As if so many more strengths of such a size had been seen: σ stays above zero and finite for any answers.
PRIOR_ITEMS, PRIOR_SIZE, WIDEST_SD = 1.0, 1.5, 10.0
SPREAD_TOLERANCE = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Mode ``theta`` (n,) and ``covariance`` (n, n) of the strengths in nats, and how they were found."""

    theta: Floats
    covariance: Floats
    prior_sd: float
    iterations: int
    converged: bool

    def contrasts(self) -> tuple[Floats, Floats]:
        """Return mean and variance of θ_i − θ_j, each of shape (n, n)."""
        variance = np.diag(self.covariance)
        spread = variance[:, None] + variance[None, :] - 2 * self.covariance
        return self.theta[:, None] - self.theta[None, :], np.maximum(spread, 0.0)


def posterior(wins: Floats, prior_sd: float, start: Floats | None = None) -> Posterior:
    """Return the posterior of the strengths.

    Parameters
    ----------
    wins
        Shape (n, n): ``wins[i, j]`` is how often item i was preferred over item j; any counts, also none.
    prior_sd
        σ in nats, above zero.
    start
        Shape (n,): where to begin, such as the mode before the last few answers.
    """
    count = len(wins)
    precision = np.eye(count) / prior_sd**2
    theta: Floats = np.zeros(count) if start is None else start
    objective = _log_posterior(wins, theta, prior_sd)
    converged = False
    iteration = 0
    while not converged and iteration < MOST_ITERATIONS:
        iteration += 1
        lost = _logistic(theta[None, :] - theta[:, None])  # [i, j]: probability of j over i
        flow = wins * lost
        gradient = flow.sum(axis=1) - flow.sum(axis=0) - theta / prior_sd**2
        step = np.linalg.solve(_curvature(wins, lost) + precision, gradient)
        share = 1.0
        for _ in range(MOST_HALVINGS):
            ahead = theta + share * step
            objective_ahead = _log_posterior(wins, ahead, prior_sd)
            if objective_ahead >= objective - 1e-13 * (1 + abs(objective)):
                break
            share /= 2
        theta, objective = ahead, objective_ahead
        converged = bool(np.abs(step).max() <= STEP_TOLERANCE * max(1.0, float(np.abs(theta).max())))
    curvature = _curvature(wins, _logistic(theta[None, :] - theta[:, None])) + precision
    return Posterior(theta, np.asarray(np.linalg.inv(curvature), dtype=np.float64), prior_sd, iteration, converged)


def learnt_posterior(wins: Floats, before: Posterior | None = None, most_steps: int = 500) -> Posterior:
    """Return the posterior of the strengths under a prior whose standard deviation is learnt from the answers too.

    Parameters
    ----------
    wins
        Shape (n, n): as for `posterior`.
    before
        Where to begin, such as the posterior before the last few answers.
    most_steps
        Steps after which σ is taken as it is, if it still moves by more than 1e-4 of it; ``converged`` says so.
    """
    count = len(wins)
    found = posterior(wins, before.prior_sd, before.theta) if before else posterior(wins, PRIOR_SIZE)
    for _ in range(most_steps):
        squares = float(((found.theta - found.theta.mean()) ** 2).sum()) + PRIOR_ITEMS * PRIOR_SIZE**2
        unknown = float(np.trace(found.covariance) - found.covariance.sum() / count) / found.prior_sd**2
        prior_sd = min(float(np.sqrt(squares / (count - 1 - unknown + PRIOR_ITEMS))), WIDEST_SD)
        settled = abs(prior_sd / found.prior_sd - 1) < SPREAD_TOLERANCE
        found = posterior(wins, prior_sd, found.theta)
        if settled:
            return found
    return Posterior(found.theta, found.covariance, found.prior_sd, found.iterations, converged=False)


def _curvature(wins: Floats, lost: Floats) -> Floats:
    weights = (wins + wins.T) * lost * lost.T
    return np.asarray(np.diag(weights.sum(axis=1)) - weights)


def _log_posterior(wins: Floats, theta: Floats, prior_sd: float) -> float:
    difference = theta[:, None] - theta[None, :]
    return float(-(wins * np.logaddexp(0.0, -difference)).sum() - (theta**2).sum() / (2 * prior_sd**2))


def _logistic(difference: Floats) -> Floats:
    return np.asarray(0.5 * (1.0 + np.tanh(0.5 * difference)))
