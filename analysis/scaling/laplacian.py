"""Solve with the Laplacian of a weighted graph, H = diag(Σw) − w, on vectors that sum to zero.

The information matrix of the Bradley-Terry model is such a Laplacian. Where the weights span few orders of magnitude
LAPACK solves (H + 11ᵀ/n) s = g. Where they span many, H holds differences that double precision has already lost, so
the items are eliminated one by one as Grassmann, Taksar and Heyman do [Grassmann1985]: the pivots are then sums of
weights, nothing positive is ever subtracted, and even a link 10²⁰ times weaker than the rest keeps its digits. For
many small graphs elimination is also the faster way, since each of its steps serves them all.

Arrays hold the graphs of a batch along their last axis, so that work on a batch runs through memory in order.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

WIDEST_FOR_LAPACK = 1e10
WIDEST_FOR_PLAIN_SUMS = 1e3
SMALL_GRAPH = 32
LARGE_BATCH = 16
ROUNDING = 64 * float(np.finfo(np.float64).eps)
SLOPE_ROUNDING = 1e-12


def solve(weights: Floats, right: Floats) -> Floats:
    """Return s with H s = ``right`` and Σs = 0.

    Parameters
    ----------
    weights
        Shape (n, n, B): symmetric, at least zero, the graph connected; the diagonal is zero.
    right
        Shape (n, m, B); each column sums to zero.

    Returns
    -------
    Shape (n, m, B).
    """
    n, _, batch = weights.shape
    if (n <= SMALL_GRAPH and batch >= LARGE_BATCH) or span(weights) > WIDEST_FOR_LAPACK:
        return by_elimination(weights, right)
    return by_lapack(weights, right)


def pseudo_inverse(weights: Floats) -> Floats:
    """Return the pseudo-inverse of H: the covariance of estimates that sum to zero. Shapes (n, n) to (n, n)."""
    n = len(weights)
    inverse = solve(weights[:, :, None], (np.eye(n) - 1 / n)[:, :, None])[:, :, 0]
    symmetric: Floats = (inverse + inverse.T) / 2
    return symmetric


def contrast_variances(covariance: Floats) -> Floats:
    """Return var(θ_i − θ_j), at least zero. Shapes (..., n, n) to (..., n, n).

    A variance no larger than the rounding of the numbers that it is the difference of is 0: it is no evidence, and
    what it is exactly depends on the processor.
    """
    variance = np.diagonal(covariance, axis1=-2, axis2=-1)
    both = variance[..., :, None] + variance[..., None, :]
    apart = both - 2 * covariance
    return np.where(apart > ROUNDING * both, apart, 0.0)


def without_rounding(slopes: Floats, answers: Floats) -> Floats:
    """Return ``slopes`` of likelihoods, those that are only rounding of as many ``answers`` set to 0; same shapes."""
    return np.where(np.abs(slopes) > SLOPE_ROUNDING * answers, slopes, 0.0)


def span(weights: Floats) -> float:
    """Return n times the ratio of the largest to the smallest positive weight: about H's condition."""
    return float(len(weights) * weights.max() / weights.min(where=weights > 0, initial=np.inf))


def by_lapack(weights: Floats, right: Floats) -> Floats:
    """As `solve`, by LU decomposition of H + c·11ᵀ/n, graph by graph."""
    n = len(weights)
    strength = weights.sum(axis=1).T
    matrix: Floats = np.negative(weights.transpose(2, 0, 1), order="C")
    matrix.reshape(-1, n * n)[:, :: n + 1] = strength
    # Any c gives the same solution; the mean strength makes the added part as large as H, whatever the counts.
    matrix += (strength.sum(axis=1) / n**2)[:, None, None]
    return np.asarray(np.linalg.solve(matrix, right.transpose(2, 0, 1)).transpose(1, 2, 0))


def by_elimination(weights: Floats, right: Floats) -> Floats:
    """As `solve`, by elimination without subtraction; accurate for any weights, slow for one large graph."""
    weight, flow = weights.copy(), right.copy()
    n = len(weights)
    pivots: list[Floats] = [np.empty(0)]
    for k in range(n - 1, 0, -1):
        pivot = weight[k, :k].sum(axis=0)
        share = weight[:k, k] / pivot
        weight[:k, :k] += share[:, None] * weight[k, None, :k]
        flow[:k] += share[:, None] * flow[k]
        pivots.insert(1, pivot)
    solution = np.zeros_like(flow)
    for k in range(1, n):
        inflow = (weight[k, :k, None] * solution[:k]).sum(axis=0)
        solution[k] = (flow[k] + inflow) / pivots[k]
    centred: Floats = solution - solution.mean(axis=0)
    return centred


def net_flows(flow: Floats, first: NDArray[np.intp], second: NDArray[np.intp], n: int, *, exact: bool) -> Floats:
    """Return what flows into each item, along pairs: ``flow`` to ``first``, its negative to ``second``.

    Parameters
    ----------
    flow
        Shape (m, B).
    first, second
        Shape (m,): indices of items, each pair once.
    exact
        Sum as if in twice the precision, in two parts as `split` gives them.

    Returns
    -------
    Shape (n, B).
    """
    if not exact:
        return _net_flows(flow, first, second, n)
    high, low = split(flow, n)
    return _net_flows(high, first, second, n) + _net_flows(low, first, second, n)


def split(flow: Floats, terms: int) -> tuple[Floats, Floats]:
    """Split ``flow`` into high parts, of which up to ``terms`` add without rounding, and what is left [Rump2008].

    The high parts are multiples of one power of two. Flows within a group of items cancel in their sums, and the weak
    flow between two groups survives.
    """
    largest = np.abs(flow).max(initial=np.finfo(np.float64).tiny)
    unit = np.exp2(np.ceil(np.log2(largest)) + np.ceil(np.log2(2 * terms)))
    high = (unit + flow) - unit
    return high, flow - high


def _net_flows(flow: Floats, first: NDArray[np.intp], second: NDArray[np.intp], n: int) -> Floats:
    matrix = np.zeros((n, n, flow.shape[1]))
    matrix[first, second] = flow
    matrix[second, first] = -flow
    sums: Floats = matrix.sum(axis=1)
    return sums
