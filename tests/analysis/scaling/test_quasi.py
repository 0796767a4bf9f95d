"""Quasi-variances against R's qvcalc, and what must hold."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import minimize

from analysis.errors import ResultsError
from analysis.scaling import fit
from analysis.scaling.quasi import quasi_variances

CITATIONS = np.array([[0, 730, 498, 221], [33, 0, 68, 17], [320, 813, 0, 142], [284, 276, 325, 0]], dtype=float)


PRINTED = np.array([0.00177417668, 0.00850747201, 0.00183576933, 0.00342411548])


def as_r_iterates(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """The iteration of R's glm for the same least squares, stopped where glm stops: deviance settled to 1e-8."""
    n = len(covariance)
    first, second = np.triu_indices(n, 1)
    variance = np.diag(covariance)[first] + np.diag(covariance)[second] - 2 * covariance[first, second]
    design = np.zeros((len(first), n))
    design[range(len(first)), first] = design[range(len(first)), second] = 1
    total, last = variance, np.inf
    while True:
        working = total * (1 + np.log(variance) - np.log(total))
        q = np.linalg.lstsq(design / total[:, None], working / total, rcond=None)[0]
        total = design @ q
        deviance = float(((np.log(variance) - np.log(total)) ** 2).sum())
        if abs(deviance - last) / (0.1 + deviance) < 1e-8:
            return np.asarray(q)
        last = deviance


def test_citations_have_the_quasi_variances_of_r() -> None:
    """R stops at 1e-8 in the deviance, some 4e-7 before the minimum: its digits are those of its own iteration."""
    covariance = fit(CITATIONS).covariance
    assert as_r_iterates(covariance) == pytest.approx(PRINTED, rel=5e-9)
    found = quasi_variances(covariance)
    assert found.converged
    assert found.variances == pytest.approx(PRINTED, rel=4e-7)


def test_the_worst_errors_are_those_of_some_pair() -> None:
    covariance = fit(CITATIONS).covariance
    found = quasi_variances(covariance)
    errors = []
    for i in range(4):
        for j in range(i):
            exact = covariance[i, i] + covariance[j, j] - 2 * covariance[i, j]
            errors.append(np.sqrt((found.variances[i] + found.variances[j]) / exact) - 1)
    assert (found.worst_below, found.worst_above) == pytest.approx((min(errors), max(errors)), rel=1e-12)
    assert -0.05 < found.worst_below < 0 < found.worst_above < 0.05


@given(st.lists(st.floats(1e-3, 1e3), min_size=3, max_size=8), st.floats(-10, 10))
def test_independent_estimates_keep_their_variances(variances: list[float], shared: float) -> None:
    found = quasi_variances(np.diag(variances) + shared)
    assert found.converged
    assert found.variances == pytest.approx(variances, rel=1e-6, abs=1e-9 * max(variances))


@settings(max_examples=15)
@given(st.integers(0, 10_000), st.integers(3, 7))
def test_they_are_the_least_squares_of_the_logarithms(seed: int, n: int) -> None:
    random = np.random.default_rng(seed)
    root = random.normal(size=(n, n + 2))
    covariance = root @ root.T
    found = quasi_variances(covariance)
    first, second = np.triu_indices(n, 1)
    target = np.log(np.diag(covariance)[first] + np.diag(covariance)[second] - 2 * covariance[first, second])

    def loss(q: np.ndarray) -> float:
        total = q[first] + q[second]
        return float(((np.log(total) - target) ** 2).sum()) if (total > 0).all() else 1e9

    best = minimize(loss, found.variances, method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-14})
    assert loss(found.variances) <= best.fun + 1e-9
    order = random.permutation(n)
    turned = quasi_variances(covariance[np.ix_(order, order)])
    assert turned.variances == pytest.approx(found.variances[order], rel=1e-6, abs=1e-8)


def test_two_items_and_estimates_without_error_are_refused() -> None:
    with pytest.raises(ResultsError, match="there are 2 items"):
        quasi_variances(np.eye(2))
    with pytest.raises(ResultsError, match="no finite, positive variance"):
        quasi_variances(np.zeros((3, 3)))
    with pytest.raises(ResultsError, match="no finite, positive variance"):
        quasi_variances(np.full((3, 3), np.nan))
