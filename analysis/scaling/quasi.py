"""Quasi-variances: one number per item, such that any two give the error of their difference [Firth2004].

The variance of θ_i − θ_j is about q_i + q_j. The q minimise Σ (log(q_i + q_j) − log var(θ_i − θ_j))² over all pairs,
by Gauss and Newton's method. The largest errors of the approximation stand beside them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from analysis.covariance.laplacian import contrast_variances
from analysis.errors import ResultsError
from documents import Finding
from documents.arrays import Floats
from documents.text import JsonResult

MOST_ITERATIONS = 200
STEP_TOLERANCE = 1e-13


@dataclass(frozen=True, slots=True, eq=False)
class QuasiVariances(JsonResult):
    """Quasi-variances of ``n`` items.

    Attributes
    ----------
    variances
        Shape (n,): q, in squared units of θ. One may be negative, where an item was
        compared with one other only; the sums are not.
    worst_below, worst_above
        Largest relative error of the standard error of a difference, too small (at most 0) and too large (at least 0).
    converged
        Whether the last step was below the tolerance.
    """

    variances: Floats
    worst_below: float
    worst_above: float
    converged: bool
    json_names: ClassVar = "variances worst_relative_errors converged"

    @property
    def worst_relative_errors(self) -> tuple[float, float]:
        """By how much standard errors of differences are off, at most: below and above."""
        return self.worst_below, self.worst_above


def quasi_variances(covariance: Floats) -> QuasiVariances:
    """Return the quasi-variances of estimates with ``covariance``, shape (n, n), n at least 3.

    Raises
    ------
    ResultsError
        If there are fewer than three items, or two of them have a difference without error, or none.

    Examples
    --------
    >>> import numpy as np
    >>> quasi_variances(np.diag([1.0, 2.0, 4.0])).variances.round(6).tolist()
    [1.0, 2.0, 4.0]
    """
    n = len(covariance)
    if n < 3:
        what = f"there are {n} items: only their one difference has an error"
        raise ResultsError(Finding(what, remedy="give three items or more"))
    first, second = np.triu_indices(n, 1)
    variance = contrast_variances(covariance)[first, second]
    if not (np.isfinite(variance).all() and (variance > 0).all()):
        raise ResultsError(Finding("a difference between two items has no finite, positive variance"))
    scale = float(np.exp(np.log(variance).mean()))
    target = np.log(variance / scale)
    q = _start(variance / scale, first, second, n)
    loss = _loss(q, target, first, second)
    converged = False
    for _ in range(MOST_ITERATIONS):
        total = q[first] + q[second]
        residual = target - np.log(total)
        weights = 1 / total**2
        normal = np.zeros((n, n))
        normal[first, second] = normal[second, first] = weights
        normal[np.diag_indices(n)] = normal.sum(axis=1)
        right = np.bincount(first, residual / total, n) + np.bincount(second, residual / total, n)
        unit = 1 / np.sqrt(np.diag(normal))
        step = unit * _solved(normal * unit * unit[:, None], unit * right)
        share = 1.0
        while share > 1e-12:
            ahead = q + share * step
            ahead_loss = _loss(ahead, target, first, second)
            if ahead_loss <= loss * (1 + 1e-12) + 1e-28:
                break
            share /= 2
        q, loss = ahead, ahead_loss
        if np.abs(share * step).max() <= STEP_TOLERANCE * np.abs(q).max():
            converged = True
            break
    ratio = np.sqrt((q[first] + q[second]) * scale / variance) - 1
    return QuasiVariances(q * scale, min(0.0, float(ratio.min())), max(0.0, float(ratio.max())), converged)


def _start(variance: Floats, first: NDArray[np.intp], second: NDArray[np.intp], n: int) -> Floats:
    """Return the least-squares solution of q_i + q_j = v_ij, or half the mean where a sum is not positive."""
    sums = np.bincount(first, variance, n) + np.bincount(second, variance, n)
    q: Floats = (sums - variance.sum() / (n - 1)) / (n - 2)
    if (q[first] + q[second] <= 0).any():
        q = np.full(n, variance.mean() / 2)
    return q


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Return the solution, the shortest where some q cannot be distinguished from others for lack of digits."""
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0])


def _loss(q: Floats, target: Floats, first: NDArray[np.intp], second: NDArray[np.intp]) -> float:
    total = q[first] + q[second]
    if (total <= 0).any():
        return float("inf")
    return float(((target - np.log(total)) ** 2).sum())
