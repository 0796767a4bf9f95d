"""Corrections against worked values and the studentised range."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import stats

from analysis.classes.multiplicity import adjusted_p, benjamini_hochberg, holm, single_step
from analysis.errors import ResultsError

Floats = NDArray[np.float64]
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


@pytest.mark.parametrize(("n", "df"), [(2, 5), (6, 14), (10, 29)])
def test_the_largest_t_of_equal_items_follows_the_studentised_range(n: int, df: int) -> None:
    z = np.array([2.0, 2.5, 3.0, 3.5])
    found = single_step(z, np.eye(n) - 1 / n, df)
    expected = stats.studentized_range.sf(z * np.sqrt(2), n, df)
    assert (np.abs(found - expected) <= 5 * np.sqrt(expected * (1 - expected) / 200_000)).all()
