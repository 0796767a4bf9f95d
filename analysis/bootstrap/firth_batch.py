"""Firth's penalised fit [Firth1993] of many matrices of counts at once: the iteration of `analysis.scaling.firth`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.scaling import laplacian, newton
from analysis.scaling.firth import MOST_HALVINGS, MOST_ITERATIONS

Floats = NDArray[np.float64]


def maximise(wins: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return theta (B, n) with mean 0, and whether it converged (B,).

    Parameters
    ----------
    wins
        Shape (B, n, n): counts, in each matrix every item linked to every other by comparisons.
    """
    theta_all = np.zeros(wins.shape[:2])
    converged = np.zeros(len(wins), dtype=np.bool_)
    active = np.arange(len(wins))
    theta = theta_all.copy()
    objective = _penalised(wins, theta)
    last_size = np.full(len(wins), np.inf)
    for _ in range(MOST_ITERATIONS):
        p = _probabilities(theta)
        spread = p * p.transpose(0, 2, 1)
        totals = wins + wins.transpose(0, 2, 1)
        leverage = totals * spread * laplacian.contrast_variances(pseudo_inverses(totals * spread))
        pull = (wins + leverage / 2) * p.transpose(0, 2, 1)
        gradient = (pull - pull.transpose(0, 2, 1)).sum(axis=2)
        step = _solved((totals + leverage) * spread, gradient[:, :, None])[:, :, 0]
        theta, objective = _climb(wins, theta, step, objective)
        size = np.abs(step).max(axis=1) / np.maximum(np.abs(theta).max(axis=1), 1)
        done = newton.has_settled(size, last_size)
        theta_all[active], converged[active] = theta, done
        if done.all():
            break
        left = ~done
        active, wins, theta, objective, last_size = active[left], wins[left], theta[left], objective[left], size[left]
    return theta_all - theta_all.mean(axis=1, keepdims=True), converged


def pseudo_inverses(weights: Floats) -> Floats:
    """Return the pseudo-inverse of the Laplacian of each graph of ``weights``. Shapes (B, n, n) to (B, n, n)."""
    batch, n, _ = weights.shape
    right = np.broadcast_to(np.eye(n) - 1 / n, (batch, n, n))
    inverse = _solved(weights, right)
    symmetric: Floats = (inverse + inverse.transpose(0, 2, 1)) / 2
    return symmetric


def _solved(weights: Floats, right: Floats) -> Floats:
    last = [np.ascontiguousarray(array.transpose(1, 2, 0)) for array in (weights, right)]
    return laplacian.solve(*last).transpose(2, 0, 1)


def _climb(wins: Floats, theta: Floats, step: Floats, objective: Floats) -> tuple[Floats, Floats]:
    slack = 1e-12 * (1 + np.abs(objective))
    share = np.ones(len(theta))
    for _ in range(MOST_HALVINGS):
        ahead = theta + share[:, None] * step
        objective_ahead = _penalised(wins, ahead)
        falls = objective_ahead < objective - slack
        if not falls.any():
            break
        share[falls] /= 2
    return ahead, objective_ahead


def _penalised(wins: Floats, theta: Floats) -> Floats:
    from scipy.special import log_expit

    p = _probabilities(theta)
    weights = (wins + wins.transpose(0, 2, 1)) * p * p.transpose(0, 2, 1)
    information = -weights
    diagonal = np.arange(weights.shape[1])
    information[:, diagonal, diagonal] = weights.sum(axis=2)
    _, log_determinant = np.linalg.slogdet(information[:, 1:, 1:])
    log_p = log_expit(theta[:, :, None] - theta[:, None, :])
    return np.asarray((wins * log_p).sum(axis=(1, 2)) + log_determinant / 2)


def _probabilities(theta: Floats) -> Floats:
    from scipy.special import expit

    return np.asarray(expit(theta[:, :, None] - theta[:, None, :]))
