"""Corrections against worked values and the studentised range."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from analysis.classes.multiplicity import adjusted_p, benjamini_hochberg, clustered_single_step, holm, single_step
from analysis.covariance import Clustered, Spread, shrink
from analysis.errors import ResultsError
from documents.arrays import Floats
from tests.choice import nightly

P_VALUES = st.lists(st.floats(0, 1), min_size=1, max_size=20).map(np.array)


def test_holm_by_hand() -> None:
    assert holm(np.array([0.01, 0.04, 0.03, 0.005])) == pytest.approx([0.03, 0.06, 0.06, 0.02])


@given(P_VALUES)
def test_benjamini_hochberg_is_that_of_scipy(p: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    assert benjamini_hochberg(p) == pytest.approx(stats.false_discovery_control(p), abs=1e-15)


@given(P_VALUES)
def test_holm_rejects_what_its_steps_reject(p: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    """Holm's procedure as he states it: the smallest p against α/m, the next against α/(m − 1), until one fails."""
    alpha = 0.05
    rejected = set()
    for step, index in enumerate(np.argsort(p, kind="stable")):
        if p[index] * (len(p) - step) > alpha:
            break
        rejected.add(int(index))
    assert {int(index) for index in np.flatnonzero(holm(p) <= alpha)} == rejected


@pytest.mark.parametrize("n", [2, 3, 6, 10])
def test_the_largest_z_of_equal_items_follows_the_studentised_range(n: int) -> None:
    covariance = np.eye(n) - 1 / n
    z = np.array([2.0, 2.5, 3.0, 3.5])
    pairs = n * (n - 1) // 2
    found = single_step(np.resize(z, max(pairs, 4))[:pairs], covariance)
    expected = stats.studentized_range.sf(np.resize(z, max(pairs, 4))[:pairs] * np.sqrt(2), n, np.inf)
    five_standard_errors = 5 * np.sqrt(expected * (1 - expected) / 200_000)
    assert (np.abs(found - expected) <= five_standard_errors).all()


def test_the_largest_z_is_the_same_every_time() -> None:
    z, covariance = np.array([1.0, 2.0, 3.0]), np.diag([1.0, 2.0, 3.0])
    assert single_step(z, covariance).tolist() == single_step(z, covariance).tolist()


def test_unadjusted_p_values_are_those_of_the_normal_law() -> None:
    p = adjusted_p(np.array([1.96, 40.0, 0.0]), np.eye(3), "none")
    assert p[0] == pytest.approx(2 * stats.norm.sf(1.96), rel=1e-14)
    assert p[1] == pytest.approx(2 * stats.norm.sf(40), rel=1e-12)
    assert p[2] == 1


def test_an_unknown_adjustment_is_refused() -> None:
    with pytest.raises(ResultsError, match="tukey"):
        adjusted_p(np.zeros(1), np.eye(2), "tukey")  # type: ignore[arg-type]  # wrong on purpose


@pytest.mark.parametrize("correct", [holm, benjamini_hochberg])
def test_many_rows_are_corrected_as_each_alone(correct: Callable[[Floats], Floats]) -> None:
    p = np.random.default_rng(8).random((5, 4, 7)) ** 3
    assert (correct(p)[2, 3] == correct(p[2, 3])).all()
    assert (correct(p) == np.array([[correct(row) for row in rows] for rows in p])).all()


def test_with_degrees_of_freedom_the_law_is_students() -> None:
    p = adjusted_p(np.array([2.5]), np.eye(2), "none", df=7)
    assert p[0] == pytest.approx(2 * stats.t.sf(2.5, 7), rel=1e-12)


def spread_of(kind: Clustered, n: int, observers: int) -> Spread:
    """Return a covariance of equal items whose observers vary evenly about them: exactly that of the model."""
    model = np.eye(n) - 1 / n
    pulled = np.random.default_rng(3).standard_normal((observers, n))
    pulled -= pulled.mean(axis=0)
    pulled -= pulled.mean(axis=1, keepdims=True)
    return shrink(model[None], pulled[None] / np.sqrt(observers - 1), kind, freedom=observers - 1)


@pytest.mark.parametrize(("n", "observers"), [(2, 6), (6, 15)])
def test_the_largest_t_scaled_follows_the_studentised_range(n: int, observers: int) -> None:
    """Of all contrasts one common variance is estimated, with (observers − 1)(n − 1) degrees of freedom."""
    z = np.array([2.0, 2.5, 3.0, 3.5])
    found = clustered_single_step(z, spread_of("scaled", n, observers), 40_000)
    expected = stats.studentized_range.sf(z * np.sqrt(2), n, (observers - 1) * (n - 1))
    assert (np.abs(found - expected) <= 5 * np.sqrt(expected * (1 - expected) / 40_000)).all()


@pytest.mark.parametrize("kind", ["sandwich", *nightly("shrinkage")])
def test_the_largest_t_is_that_of_studies_simulated_one_by_one(kind: Clustered) -> None:
    """Observers' own contributions are drawn, their mean tested against their spread, study by study."""
    n, observers, studies = 4, 7, 3000
    whole, random = spread_of(kind, n, observers), np.random.default_rng(4)
    values, vectors = np.linalg.eigh(whole.best[0] * observers)
    root = vectors * np.sqrt(np.maximum(values, 0))
    largest = np.empty(studies)
    for study in range(studies):
        own = random.standard_normal((observers, n)) @ root.T
        mean = own.mean(axis=0)
        around = (own - mean) / np.sqrt(observers * (observers - 1))
        covariance = shrink(whole.model, around[None], kind, freedom=observers - 1).covariance[0]
        largest[study] = max(
            abs(mean[i] - mean[j]) / np.sqrt(covariance[i, i] + covariance[j, j] - 2 * covariance[i, j])
            for i in range(n)
            for j in range(i)
        )
    t = np.quantile(largest, [0.5, 0.9, 0.95])
    found = clustered_single_step(t, whole, 20_000)
    for p, expected in zip(found, (0.5, 0.1, 0.05), strict=True):
        assert p == pytest.approx(expected, abs=5 * np.sqrt(expected * (1 - expected) / studies))
