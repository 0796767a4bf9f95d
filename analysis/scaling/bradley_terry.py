"""Bradley-Terry scores by Newton's method [Bradley1952], with the sum of the strengths held at zero.

With strengths θ, item i is preferred over item j with probability p_ij = 1 / (1 + exp(θ_j − θ_i)). The published score
is softmax(θ): scores sum to 1. The iteration is in `analysis.scaling.newton`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.scaling import laplacian, newton
from analysis.scaling.separation import Groups, are_connected, compared_groups, separated_items, strong_groups
from documents import Finding

Floats = NDArray[np.float64]
Method = Literal["ml", "firth"]

SMALL = 64


@dataclass(frozen=True, slots=True, eq=False)
class BradleyTerryFit:
    """Strengths of ``n`` items, and whether they can be trusted.

    Attributes
    ----------
    theta
        Shape (n,): log strengths in nats, mean 0; NaN where the items are separated.
    covariance
        Shape (n, n): inverse information of ``theta`` on the vectors that sum to zero.
    se
        Shape (n,): standard errors of ``theta``, in nats.
    score, log10_score
        Shape (n,): softmax of ``theta``, which sums to 1, and its decimal logarithm.
    log_likelihood
        Σ W log p, without binomial coefficients.
    deviance
        2 Σ W log(W / (N p)) over the pairs that were compared.
    df
        Number of compared pairs less n − 1.
    converged
        Whether the last step was below the tolerance.
    iterations
        Newton steps taken.
    separated
        Groups of item indices, best first, between which no finite strength exists; empty if the fit is sound.
    method
        ``ml`` or ``firth``.
    """

    theta: Floats
    covariance: Floats
    se: Floats
    score: Floats
    log10_score: Floats
    log_likelihood: float
    deviance: float
    df: int
    converged: bool
    iterations: int
    separated: Groups
    method: Method

    @property
    def separated_items(self) -> tuple[int, ...]:
        """Indices of the items outside the largest group; all where no group is the largest; none if sound."""
        return separated_items(self.separated)


@dataclass(frozen=True, slots=True, eq=False)
class BradleyTerryBatch:
    """Strengths of ``n`` items in each of B replicates.

    ``theta`` has the shape (B, n), each row with mean 0, and NaN where ``separated``; ``log_likelihood``,
    ``converged``, ``iterations`` and ``separated`` have the shape (B,).
    """

    theta: Floats
    log_likelihood: Floats
    converged: NDArray[np.bool_]
    iterations: NDArray[np.intp]
    separated: NDArray[np.bool_]


def fit(wins: Floats, *, method: Method = "ml", most_iterations: int = newton.MOST_ITERATIONS) -> BradleyTerryFit:
    """Fit strengths to one matrix of counts.

    Parameters
    ----------
    wins
        Shape (n, n), n at least 2: ``wins[i, j]`` is how often item i was preferred over item j; finite, at least
        zero, not necessarily whole; zero on the diagonal.
    method
        ``ml`` maximises the likelihood; ``firth`` the likelihood times the root of the information's determinant
        [Firth1993], which is finite even for an item that always wins.
    most_iterations
        Newton steps after which a fit by maximum likelihood stops without having converged; at least 1.

    Raises
    ------
    ResultsError
        If ``wins`` is no such matrix.
    """
    counts = _checked(wins, dimensions=2)
    if method == "firth":
        groups = compared_groups(counts)
    else:
        groups = () if len(counts) <= SMALL and are_connected(counts[None])[0] else strong_groups(counts)
    if len(groups) > 1:
        return _unfitted(counts, groups, method)
    if method == "firth":
        from analysis.scaling.firth import maximise

        theta, iterations, converged = maximise(counts)
    else:
        thetas, _, steps, done = newton.maximise(counts[None], most_iterations)
        theta, iterations, converged = thetas[0], int(steps[0]), bool(done[0])
    return _fitted(counts, theta, iterations, converged, method)


def fit_batch(wins: Floats) -> BradleyTerryBatch:
    """Fit strengths by maximum likelihood to B matrices of counts in one call, such as bootstrap replicates.

    Parameters
    ----------
    wins
        Shape (B, n, n), each matrix as in `fit`. A replicate whose items are separated is reported and not solved.

    Raises
    ------
    ResultsError
        If ``wins`` is no such array.
    """
    counts = _checked(wins, dimensions=3)
    batch, n, _ = counts.shape
    sound = are_connected(counts)
    theta = np.full((batch, n), np.nan)
    log_likelihood = np.full(batch, np.nan)
    iterations = np.zeros(batch, dtype=np.intp)
    converged = np.zeros(batch, dtype=np.bool_)
    if sound.any():
        theta[sound], log_likelihood[sound], iterations[sound], converged[sound] = newton.maximise(counts[sound])
    return BradleyTerryBatch(theta, log_likelihood, converged, iterations, ~sound)


def probabilities(theta: Floats) -> Floats:
    """Return p_ij, the probability that item i is preferred over item j. Shapes (..., n) to (..., n, n)."""
    from scipy.special import expit

    return np.asarray(expit(theta[..., :, None] - theta[..., None, :]))


def _fitted(wins: Floats, theta: Floats, iterations: int, converged: bool, method: Method) -> BradleyTerryFit:
    from scipy.special import log_expit, log_softmax, xlogy

    totals = wins + wins.T
    p = probabilities(theta)
    covariance = laplacian.pseudo_inverse(totals * p * p.T)
    log_p = log_expit(theta[:, None] - theta[None, :])
    observed = np.divide(wins, totals, out=np.ones_like(wins), where=wins > 0)
    deviance = float(2 * (xlogy(wins, observed) - wins * log_p).sum())
    log_score = log_softmax(theta)
    return BradleyTerryFit(
        theta=theta,
        covariance=covariance,
        se=np.sqrt(np.diag(covariance)),
        score=np.exp(log_score),
        log10_score=log_score / np.log(10),
        log_likelihood=float((wins * log_p).sum()),
        deviance=max(0.0, deviance),  # below zero by rounding only (Gibbs' inequality)
        df=_degrees_of_freedom(totals),
        converged=converged,
        iterations=iterations,
        separated=(),
        method=method,
    )


def _unfitted(wins: Floats, groups: Groups, method: Method) -> BradleyTerryFit:
    n = len(wins)
    nothing = np.full(n, np.nan)
    return BradleyTerryFit(
        theta=nothing,
        covariance=np.full((n, n), np.nan),
        se=nothing,
        score=nothing,
        log10_score=nothing,
        log_likelihood=float("nan"),
        deviance=float("nan"),
        df=_degrees_of_freedom(wins + wins.T),
        converged=False,
        iterations=0,
        separated=groups,
        method=method,
    )


def _degrees_of_freedom(totals: Floats) -> int:
    return int(np.count_nonzero(np.triu(totals, 1))) - (len(totals) - 1)


def _checked(wins: Floats, dimensions: int) -> Floats:
    counts = np.asarray(wins, dtype=np.float64)
    if counts.ndim != dimensions or counts.shape[-1] != counts.shape[-2] or counts.shape[-1] < 2:
        shape = "(n, n)" if dimensions == 2 else "(B, n, n)"
        what = f"the counts have the shape {counts.shape}"
        raise ResultsError(Finding(what, remedy=f"give {shape} with n at least 2"))
    if not (np.isfinite(counts).all() and (counts >= 0).all()):
        raise ResultsError(Finding("the counts hold a negative or infinite number or NaN", remedy="count again"))
    if np.diagonal(counts, axis1=-2, axis2=-1).any():
        raise ResultsError(Finding("the diagonal of the counts is not zero", remedy="compare different items"))
    return counts
