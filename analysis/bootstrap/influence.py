"""How far each observer pulls the strengths, and the sandwich standard errors that follow [Huber1967] [White1982].

With H the information of all counts and g_s the slope of observer s's own log likelihood at θ, the observer moves the
estimate by d_s = H⁻¹ g_s to first order. The d_s sum to zero, and S/(S − 1) Σ d_s d_sᵀ is the covariance of θ when
observers differ in ways the model does not know: answers of one observer may then hang together in any manner.
"""

from __future__ import annotations

import numpy as np

from analysis.covariance import laplacian
from documents.arrays import Floats


def influences(by_observer: Floats, weights: Floats, theta: Floats) -> Floats:
    """Return d_s of each observer in each replicate, in nats; shape (B, S, n).

    Parameters
    ----------
    by_observer
        Shape (S, n, n): each observer's counts.
    weights
        Shape (B, S): how often each observer was drawn; the counts of replicate b are ``weights[b] @ by_observer``.
    theta
        Shape (B, n): the strengths fitted to those counts, finite.
    """
    from scipy.special import expit

    totals = by_observer + by_observer.transpose(0, 2, 1)
    p = expit(theta[:, :, None] - theta[:, None, :])
    people = len(by_observer)
    counts = (weights @ totals.reshape(people, -1)).reshape(p.shape)
    information = counts * p * p.transpose(0, 2, 1)
    expected = np.matmul(totals.transpose(1, 0, 2), np.ascontiguousarray(p.transpose(1, 2, 0)))  # (n, S, B)
    slope = by_observer.sum(axis=2).T[:, :, None] - expected
    # After a penalised fit the slopes do not quite sum to zero: only their spread is the observers'.
    drawn = weights.T
    slope = slope - ((slope * drawn).sum(axis=1) / drawn.sum(axis=0))[:, None, :]
    slope = laplacian.without_rounding(slope, totals.sum(axis=2).T[:, :, None])
    return laplacian.solve(information, slope.transpose(2, 0, 1)).transpose(0, 2, 1)


def standard_errors(pulled: Floats, weights: Floats) -> Floats:
    """Return √(S/(S − 1) Σ w_s d_s²) of each column. Shapes (B, S, k) and (B, S) to (B, k)."""
    people = weights.sum(axis=1)
    variance = (weights[:, :, None] * pulled**2).sum(axis=1)
    return np.asarray(np.sqrt(variance * (people / (people - 1))[:, None]))
