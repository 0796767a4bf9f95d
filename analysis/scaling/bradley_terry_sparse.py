"""Bradley-Terry strengths of many items of which few pairs were compared, by conjugate gradients.

The Newton steps of `analysis.scaling.bradley_terry` with H s = g solved by conjugate gradients, preconditioned with the
diagonal of H, each only as far as the step deserves [Eisenstat1996]: roughly at first, fully at the end. Nothing of
size n² is made. The counts are a sparse matrix; the covariance is not computed.

Where the weights of H span so many orders of magnitude that conjugate gradients could not hold θ to 1e-10, the dense
Newton method takes over; above 5000 items, for which it is too large, the fit is then returned as not converged.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from analysis.errors import ResultsError
from analysis.scaling import newton
from analysis.scaling.laplacian import split
from analysis.scaling.pair_counts import PairCounts
from documents import Finding

Floats = NDArray[np.float64]

MOST_ITERATIONS = 200
MOST_HALVINGS = 60
ROUGHEST, FINEST = 0.1, 1e-6
WIDEST_RATIO = 1e6
MOST_DENSE_ITEMS = 5000


@dataclass(frozen=True, slots=True, eq=False)
class SparseFit:
    """Strengths of ``n`` items, and whether they can be trusted.

    ``theta``, shape (n,), has mean 0 and is NaN if the items are ``separated``; ``products`` counts how
    often H was multiplied with a vector.
    """

    theta: Floats
    log_likelihood: float
    converged: bool
    iterations: int
    products: int
    separated: bool


def fit_sparse(wins: csr_array) -> SparseFit:
    """Fit strengths by maximum likelihood to sparse counts.

    Parameters
    ----------
    wins
        Shape (n, n): a SciPy sparse array whose entry (i, j) is how often item i was preferred over item j; finite,
        at least zero, zero on the diagonal. Its twin for dense counts is `analysis.scaling.bradley_terry.fit`.

    Raises
    ------
    ResultsError
        If ``wins`` is no such matrix.
    """
    counts = csr_array(wins.astype(np.float64))
    counts.eliminate_zeros()
    _check(counts)
    n = counts.shape[0]
    groups, _ = connected_components(counts, directed=True, connection="strong")
    if groups > 1:
        return SparseFit(np.full(n, np.nan), float("nan"), False, 0, 0, True)
    pairs = _pairs(counts)
    graph = _Laplacian(pairs)
    theta = np.zeros((n, 1))
    terms, odds = pairs.log_likelihood(theta)
    first_slope, last_size = 0.0, np.array([np.inf])
    converged, iterations = False, 0
    while not converged and iterations < MOST_ITERATIONS:
        iterations += 1
        flow, weight = pairs.slopes(theta, odds)
        gradient = graph.net_flows(flow[:, 0])
        slope = float(np.abs(gradient).max())
        first_slope = max(first_slope, slope)
        tolerance = max(FINEST, min(ROUGHEST, slope / first_slope)) if slope else FINEST
        step = graph.solve(weight[:, 0], gradient, tolerance)[:, None]
        theta, terms, odds = _climb(pairs, theta, step, terms)
        size = np.abs(step).max(axis=0) / max(1.0, float(np.abs(theta).max()))
        converged = bool(newton.has_settled(size, last_size)[0])
        last_size = size
    products = graph.products
    if weight.max() > WIDEST_RATIO * weight.min():
        if n > MOST_DENSE_ITEMS:
            converged = False
        else:
            dense, _, steps, done = newton.maximise(counts.toarray()[None])
            theta, iterations, converged = dense.T, iterations + int(steps[0]), bool(done[0])
            terms, _ = pairs.log_likelihood(theta)
    return SparseFit(theta[:, 0] - theta.mean(), float(terms.sum()), converged, iterations, products, False)


class _Laplacian:
    """H of one graph, applied along its edges; the order of the edges is laid down once."""

    def __init__(self, pairs: PairCounts) -> None:
        n, edges = pairs.n, np.arange(len(pairs.first))
        rows, columns = np.concatenate([pairs.first, pairs.second]), np.concatenate([pairs.second, pairs.first])
        numbered = csr_array((np.concatenate([edges, edges]) + 1, (rows, columns)), shape=(n, n))
        self._edge = numbered.data - 1
        self._adjacency = csr_array((np.zeros(len(rows)), numbered.indices, numbered.indptr), shape=(n, n))
        self._first, self._second = pairs.first, pairs.second
        self.products = 0

    def net_flows(self, flow: Floats) -> Floats:
        """Return what flows into each item: ``flow`` (m,) to the first of each pair, its negative to the second."""
        n = self._adjacency.shape[0]
        sums: Floats = np.zeros(n)
        for part in split(flow, n):
            sums += np.bincount(self._first, part, n) - np.bincount(self._second, part, n)
        return sums

    def solve(self, weight: Floats, right: Floats, tolerance: float) -> Floats:
        """Return s with H s = ``right`` to ``tolerance`` of its norm, by preconditioned conjugate gradients."""
        adjacency = self._adjacency
        adjacency.data = weight[self._edge]
        diagonal: Floats = np.bincount(self._first, weight, len(right)).astype(np.float64)
        diagonal += np.bincount(self._second, weight, len(right))
        solution = np.zeros_like(right)
        residual = right - right.mean()
        scaled = residual / diagonal
        direction = scaled.copy()
        rho = float(residual @ scaled)
        enough = rho * tolerance**2
        for _ in range(10 * len(right)):
            if rho <= enough or rho == 0:
                break
            product = diagonal * direction - adjacency @ direction
            self.products += 1
            length = rho / float(direction @ product)
            solution += length * direction
            residual -= length * product
            scaled = residual / diagonal
            following = float(residual @ scaled)
            direction = scaled + (following / rho) * direction
            rho = following
        solution -= solution.mean()
        return solution


def _climb(pairs: PairCounts, theta: Floats, step: Floats, terms: Floats) -> tuple[Floats, Floats, Floats]:
    slack = 1e-14 * float(np.abs(terms).sum())
    share = 1.0
    for _ in range(MOST_HALVINGS):
        ahead = theta + share * step
        ahead_terms, ahead_odds = pairs.log_likelihood(ahead)
        if (ahead_terms - terms).sum() >= -slack:
            break
        share /= 2
    return ahead, ahead_terms, ahead_odds


def _pairs(counts: csr_array) -> PairCounts:
    compared = counts + counts.T
    upper = compared.tocoo()
    keep = upper.row < upper.col
    first, second = upper.row[keep].astype(np.intp), upper.col[keep].astype(np.intp)
    won = np.asarray(counts[first, second]).reshape(-1, 1)
    lost = np.asarray(counts[second, first]).reshape(-1, 1)
    return PairCounts(counts.shape[0], first, second, won, lost)


def _check(counts: csr_array) -> None:
    if counts.ndim != 2 or counts.shape[0] != counts.shape[1] or counts.shape[0] < 2:
        raise ResultsError(Finding(f"the counts have the shape {counts.shape}", remedy="give (n, n) with n at least 2"))
    if not (np.isfinite(counts.data).all() and (counts.data >= 0).all()):
        raise ResultsError(Finding("the counts hold a negative or infinite number or NaN", remedy="count again"))
    if counts.diagonal().any():
        raise ResultsError(Finding("the diagonal of the counts is not zero", remedy="compare different items"))
