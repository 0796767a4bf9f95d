"""Elimination against LAPACK and against exact fractions."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.covariance import laplacian
from analysis.scaling import Counts
from documents.arrays import Floats
from documents.blas_threads import set_blas_threads


def graphs(n: int, batch: int, low: float, high: float) -> st.SearchStrategy[Floats]:
    """Symmetric weights, their exponents spread evenly."""

    def build(seed: int) -> Floats:
        random = np.random.default_rng(seed)
        weights = np.exp(random.uniform(np.log(low), np.log(high), (batch, n, n)))
        upper = np.triu(np.ones((n, n)), 1) * weights
        return upper + upper.transpose(0, 2, 1)

    return st.integers(0, 2**32).map(build)


@given(graphs(6, 3, 0.1, 10))
def test_both_ways_of_solving_agree(weights: Floats) -> None:
    right = np.random.default_rng(1).normal(size=(3, 6, 2))
    right -= right.mean(axis=1, keepdims=True)
    slow, fast = laplacian.by_elimination(weights, right), laplacian.by_lapack(weights, right)
    assert slow == pytest.approx(fast, abs=1e-12)
    assert slow.sum(axis=1) == pytest.approx(0, abs=1e-13)


@given(graphs(5, 1, 0.1, 10))
def test_the_pseudo_inverse_is_that_of_numpy(weights: Floats) -> None:
    plain = weights[0]
    matrix = np.diag(plain.sum(axis=1)) - plain
    assert laplacian.pseudo_inverse(weights)[0] == pytest.approx(np.linalg.pinv(matrix), abs=1e-12)


@settings(max_examples=30, deadline=None)
@given(graphs(5, 1, 1e-12, 1e12))
def test_elimination_is_exact_to_rounding_however_far_the_weights_span(weights: Floats) -> None:
    right = np.array([1.0, 0, 0, 0, -1.0])
    found = laplacian.by_elimination(weights, right[None, :, None])[0, :, 0]
    exact = _exact(weights[0], right)
    span = float(exact.max() - exact.min())
    assert found - found[0] == pytest.approx(exact, rel=1e-13, abs=1e-13 * span)


def test_the_pseudo_inverse_of_a_large_graph_is_that_of_a_small_one() -> None:
    random = np.random.default_rng(3)
    upper = np.triu(random.random((240, 240)) < 0.02, 1) * random.uniform(0.1, 10, (240, 240))
    weights = upper + upper.T
    weights[np.arange(239), np.arange(1, 240)] = weights[np.arange(1, 240), np.arange(239)] = 1
    slow = laplacian.by_lapack(weights[None], (np.eye(240) - 1 / 240)[None])[0]
    kept = weights.copy()
    large = laplacian.pseudo_inverse(weights[None])[0]
    assert (weights == kept).all()
    assert np.abs(large - slow).max() < 1e-12
    assert (large == large.T).all()
    assert laplacian.pair_variances(large) == pytest.approx(
        laplacian.contrast_variances(large)[np.triu_indices(240, 1)], rel=1e-15
    )


def _exact(weights: Floats, right: Floats) -> Floats:
    """Solve with fractions, item 0 held at zero."""
    n = len(weights)
    weight = [[Fraction(float(value)) for value in row] for row in weights]
    rows = [
        [sum(weight[i], Fraction()) if i == j else -weight[i][j] for j in range(1, n)] + [Fraction(float(right[i]))]
        for i in range(1, n)
    ]
    for k in range(n - 1):
        for other in range(n - 1):
            if other != k:
                factor = rows[other][k] / rows[k][k]
                rows[other] = [a - factor * b for a, b in zip(rows[other], rows[k], strict=True)]
    return np.array([0.0] + [float(rows[k][-1] / rows[k][k]) for k in range(n - 1)])


def test_strong_flows_cancel_and_the_weak_one_survives() -> None:
    first, second = np.array([0, 0, 1, 2]), np.array([1, 2, 2, 3])
    flow = np.array([1e16 / 3, -1e16 / 3, 1e16 / 3, 1.0])[None]
    nothing = np.zeros_like(flow)
    counts = Counts(4, first, second, nothing, nothing, nothing)
    assert counts.net_flows(flow).tolist() == [[0, 0, 1, -1]]
    both = np.repeat(nothing, 2, axis=0)
    twice = Counts(4, first, second, both, both, both)
    assert twice.net_flows(np.repeat(flow, 2, axis=0)).tolist() == [[0, 0, 1, -1]] * 2


@pytest.mark.parametrize("n", [5, 16, 17, 33, 50, 80])
@pytest.mark.usefixtures("blas_threads_kept")
def test_the_covariance_of_small_graphs_does_not_depend_on_threads(n: int) -> None:
    """Power's promise: the same numbers to the last bit from any process, with any number of threads."""
    weights = np.random.default_rng(1).random((40, n, n))
    weights += weights.transpose(0, 2, 1)
    weights[:, np.arange(n), np.arange(n)] = 0
    found = set()
    for threads in (1, 2, 3, 4):
        set_blas_threads(threads)
        found.add(b"".join(laplacian.pseudo_inverse(one[None]).tobytes() for one in weights))
    assert len(found) == 1


@pytest.mark.parametrize("batch", [1, laplacian.LARGE_BATCH])
def test_a_precision_is_on_the_diagonal_either_way(batch: int) -> None:
    random = np.random.default_rng(2)
    weights = random.uniform(0.5, 2, (batch, 4, 4))
    weights = np.triu(weights, 1) + np.triu(weights, 1).transpose(0, 2, 1)
    right = random.normal(size=(batch, 4, 1))
    right -= right.mean(axis=1, keepdims=True)
    matrix = weights.sum(axis=2)[:, :, None] * np.eye(4) - weights + 0.7 * np.eye(4)
    assert laplacian.solve(weights, right, 0.7) == pytest.approx(np.linalg.solve(matrix, right), abs=1e-12)
