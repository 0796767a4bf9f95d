"""Solve with the Laplacian of a weighted graph, H = diag(Σw) − w, on vectors that sum to zero.

The information matrix of the Bradley-Terry model is such a Laplacian. Where the weights span few orders of magnitude
LAPACK solves (H + 11ᵀ/n) s = g. Where they span many, H contains differences that double precision has already lost, so
the items are eliminated one by one as Grassmann, Taksar and Heyman do [Grassmann1985]: the pivots are then sums of
weights, nothing positive is ever subtracted, and even a link 10²⁰ times weaker than the rest keeps its digits. For
many small graphs elimination is also the faster way, since each of its steps serves them all.

The first axis of every array is the batch of graphs. Elimination works on arrays whose batch runs fastest in memory.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from documents import one_blas_thread
from documents.arrays import Floats

WIDEST_FOR_LAPACK = 1e10
WIDEST_FOR_PLAIN_SUMS = 1e3
SMALL_GRAPH = 32
LARGE_BATCH = 16
ALONE = 16  # equations that no BLAS shares among threads; of more it rounds otherwise with other numbers of threads
BLOCK_ROWS = 256
ROUNDING = 64 * float(np.finfo(np.float64).eps)
SLOPE_ROUNDING = 1e-12


def solve(weights: Floats, right: Floats, precision: float = 0.0, ratio: float | None = None) -> Floats:
    """Return s with (H + precision) s = ``right`` and Σs = 0.

    Parameters
    ----------
    weights
        Shape (B, n, n): symmetric, at least zero, the graph connected; the diagonal is zero.
    right
        Shape (B, n, m); each column sums to zero.
    precision
        At least zero. On vectors that sum to zero it is the same as precision/n more weight for every pair.
    ratio
        Of the largest to the smallest positive weight without it, where that is known.

    Returns
    -------
    Shape (B, n, m).
    """
    batch, n, _ = weights.shape
    if (n <= SMALL_GRAPH and batch >= LARGE_BATCH) or _condition(weights, precision, ratio) > WIDEST_FOR_LAPACK:
        return by_elimination(weights + precision / n if precision else weights, right)
    return by_lapack(weights, right, precision)


def pseudo_inverse(
    weights: Floats, precision: float = 0.0, ratio: float | None = None, *, overwrite: bool = False
) -> Floats:
    """Return the inverse of H + precision on vectors that sum to zero. Shapes (B, n, n) to (B, n, n).

    It is the covariance of estimates that sum to zero; without a precision, H's pseudo-inverse. ``ratio`` is as for
    `solve`. With ``overwrite`` the array of one graph's ``weights`` is used for the result.
    """
    batch, n, _ = weights.shape
    if batch == 1 and _condition(weights, precision, ratio) <= WIDEST_FOR_LAPACK:
        with for_equations(n):
            return np.asarray(_pseudo_inverse_in_place(weights if overwrite else weights.copy(), precision)[None])
    centred = np.broadcast_to(np.eye(n) - 1 / n, weights.shape)
    inverse = solve(weights, centred, precision, ratio)
    return np.asarray((inverse + inverse.transpose(0, 2, 1)) / 2)


def _pseudo_inverse_in_place(weights: Floats, precision: float) -> Floats:
    """As `pseudo_inverse` for one graph: by Cholesky's decomposition, in the memory of ``weights``."""
    n = weights.shape[-1]
    matrix, added = grounded(weights[0], precision, weights[0])
    factor, failed = lapack().dpotrf(matrix.T, lower=1, overwrite_a=1)  # sets the other triangle to zero
    if failed:
        return np.full_like(matrix, np.nan)  # the graph is not connected
    inverse: Floats
    if n <= ALONE:
        inverse = lapack().dpotrs(factor, np.eye(n), lower=1)[0]
        return np.asarray((inverse + inverse.T) / 2 - 1 / (n * (n * added + precision)))
    inverse = lapack().dpotri(factor, lower=1, overwrite_c=1)[0]
    inverse.T.reshape(-1)[:: n + 1] /= 2
    for start in range(0, n, BLOCK_ROWS):  # mirror the triangle, block by block
        rows, further = slice(start, start + BLOCK_ROWS), slice(start + BLOCK_ROWS, None)
        inverse[rows, rows] += inverse[rows, rows].T
        inverse[rows, further] = inverse[further, rows].T
    inverse -= 1 / (n * (n * added + precision))  # what 11ᵀ was given
    return inverse


def contrast_variances(covariance: Floats) -> Floats:
    """Return var(θ_i − θ_j), at least zero. Shapes (..., n, n) to (..., n, n).

    A variance no larger than the rounding of the numbers that it is the difference of is 0: it is no evidence, and
    what it is exactly depends on the processor.
    """
    variance = np.diagonal(covariance, axis1=-2, axis2=-1)
    both = variance[..., :, None] + variance[..., None, :]
    apart = both - 2 * covariance
    return np.where(apart > ROUNDING * both, apart, 0.0)


def pair_variances(covariance: Floats) -> Floats:
    """Return `contrast_variances` of the pairs i < j, in the order of ``numpy.triu_indices``. Shapes (n, n) to (P,)."""
    variance = np.diag(covariance)
    n = len(variance)
    apart = np.empty(n * (n - 1) // 2)
    end = 0
    for item in range(n - 1):
        start, end = end, end + n - 1 - item
        both = variance[item] + variance[item + 1 :]
        own = both - 2 * covariance[item, item + 1 :]
        apart[start:end] = np.where(own > ROUNDING * both, own, 0.0)
    return apart


def differences_of(n: int, first: NDArray[np.intp], second: NDArray[np.intp]) -> Floats:
    """Return the contrasts (K, n) of ``n`` parameters that are the differences of two items each."""
    contrasts, each = np.zeros((len(first), n)), np.arange(len(first))
    contrasts[each, first], contrasts[each, second] = 1, -1
    return contrasts


def without_rounding(slopes: Floats, answers: Floats) -> Floats:
    """Return ``slopes`` of likelihoods, those that are only rounding of as many ``answers`` set to 0; same shapes."""
    return np.where(np.abs(slopes) > SLOPE_ROUNDING * answers, slopes, 0.0)


def pair_span(weight: Floats) -> float:
    """Return the ratio of the largest to the smallest positive weight of compared pairs; times n, H's condition."""
    if not weight.size:
        return 0.0
    least = float(np.minimum.reduce(weight, axis=None))
    return float(np.maximum.reduce(weight, axis=None)) / least if least > 0 else _ratio(weight)


def _condition(weights: Floats, precision: float, ratio: float | None) -> float:
    """Return a bound on the condition of H + precision; the arguments are those of `solve`."""
    n = len(weights[0])
    if precision and weights.any():
        return float(weights.max()) * n * n / precision
    return n * (_ratio(weights) if ratio is None else ratio)


def _ratio(weights: Floats) -> float:
    return float(weights.max()) / float(weights.min(where=weights > 0, initial=np.inf))


def by_lapack(weights: Floats, right: Floats, precision: float = 0.0) -> Floats:
    """As `solve`, by Cholesky's decomposition of H + precision + c·11ᵀ, graph by graph.

    NaN where that matrix is not positive definite in floating point.
    """
    dposv, solutions = lapack().dposv, np.empty_like(right)
    with for_equations(weights.shape[-1]):
        for place, weight in enumerate(weights):
            _, solved, failed = dposv(grounded(weight, precision)[0].T, right[place], lower=1, overwrite_a=1)
            solutions[place] = np.nan if failed else solved
    return solutions


def for_equations(n: int) -> AbstractContextManager[None]:
    """Return a context in which ``n`` equations are solved by one thread, so that any processor gives the same bits."""
    return nullcontext() if n <= ALONE else one_blas_thread()


@cache
def lapack() -> Any:
    """Return SciPy's LAPACK, imported at the first call."""
    from scipy.linalg import lapack

    return lapack


def grounded(weights: Floats, precision: float, out: Floats | None = None) -> tuple[Floats, float]:
    """Return H + precision + c·11ᵀ of one graph, shape (n, n), and c.

    Any c gives the same solution; c n = mean strength / n makes the added part as large as H, whatever the counts.
    """
    n = len(weights)
    strength = np.add.reduce(weights, axis=1)
    added = float(np.add.reduce(strength)) / n**2
    matrix: Floats = np.subtract(added, weights, out=out, order="C")
    matrix.reshape(-1)[:: n + 1] = strength + (added + precision)
    return matrix, added


def by_elimination(weights: Floats, right: Floats) -> Floats:
    """As `solve`, by elimination without subtraction; accurate for any weights, slow for one large graph."""
    weight, flow = (np.array(array.transpose(1, 2, 0), order="C") for array in (weights, right))
    n = len(weight)
    pivots: list[Floats] = [np.empty(0)]
    for k in range(n - 1, 0, -1):
        # The pivot is the sum of what is left, never a difference [Grassmann1985]; k's links pass on.
        pivot = weight[k, :k].sum(axis=0)
        share = weight[:k, k] / pivot
        weight[:k, :k] += share[:, None] * weight[k, None, :k]
        flow[:k] += share[:, None] * flow[k]
        pivots.insert(1, pivot)
    solution = np.zeros_like(flow)
    for k in range(1, n):
        # Item 0 is the ground: the potentials follow outwards from it.
        inflow = (weight[k, :k, None] * solution[:k]).sum(axis=0)
        solution[k] = (flow[k] + inflow) / pivots[k]
    centred: Floats = solution - solution.mean(axis=0)
    return centred.transpose(2, 0, 1)


def split(flow: Floats, terms: int) -> tuple[Floats, Floats]:
    """Split ``flow`` into high parts, of which up to ``terms`` add without rounding, and what is left [Rump2008].

    The high parts are multiples of one power of two. Flows within a group of items cancel in their sums, and the weak
    flow between two groups survives.
    """
    largest = np.abs(flow).max(initial=np.finfo(np.float64).tiny)
    # σ of [Rump2008]: adding and subtracting it rounds to multiples of its last bit.
    unit = np.exp2(np.ceil(np.log2(largest)) + np.ceil(np.log2(2 * terms)))
    high = (unit + flow) - unit
    return high, flow - high
