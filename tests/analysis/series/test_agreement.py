"""Agreement against the literature's worked examples and slow, obvious ways."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from scipy.stats import friedmanchisquare, rankdata

from analysis.series.agreement import (
    fleiss_kappa,
    intraclass,
    kendall_w,
    kendall_w_p,
    krippendorff_alpha,
    ranks,
    with_jackknife,
)

NAN = float("nan")
# Krippendorff (2011), "Computing Krippendorff's alpha-reliability", example C: four observers, twelve units.
EXAMPLE_C = np.array(
    [
        [1, 2, 3, 3, 2, 1, 4, 1, 2, NAN, NAN, NAN],
        [1, 2, 3, 3, 2, 2, 4, 1, 2, 5, NAN, 3],
        [NAN, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, NAN],
        [1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, NAN],
    ]
)
# Shrout and Fleiss (1979), Table 2: six targets, four judges.
SHROUT = np.array([[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]], float).T


@given(arrays(np.float64, (2, 3, 6), elements=st.sampled_from([0.0, 0.1, 1.0, 2.0, float("inf"), -float("inf"), NAN])))
def test_ranks_are_those_of_scipy(values: NDArray[np.float64]) -> None:
    for held in (values, values[..., :1], values[0, 0], values[:, :0]):
        np.testing.assert_array_equal(ranks(held), rankdata(held, axis=-1))


def test_krippendorff_s_own_example() -> None:
    assert krippendorff_alpha(EXAMPLE_C, nominal=True) == pytest.approx(0.743, abs=5e-4)
    assert krippendorff_alpha(EXAMPLE_C, nominal=False) == pytest.approx(0.849, abs=5e-4)


def _slow_alpha(values: np.ndarray, nominal: bool) -> float:
    """Pair every two values said of one thing, and every two values at all."""
    units = [[v for v in column if np.isfinite(v)] for column in values.T]
    units = [unit for unit in units if len(unit) > 1]
    everything = [v for unit in units for v in unit]

    def distance(a: float, b: float) -> float:
        return float(a != b) if nominal else (a - b) ** 2

    seen = sum(sum(distance(a, b) for a, b in combinations(unit, 2)) * 2 / (len(unit) - 1) for unit in units)
    n = len(everything)
    expected = sum(distance(a, b) for a, b in combinations(everything, 2)) * 2 / (n * (n - 1))
    return 1 - seen / n / expected


@pytest.mark.parametrize("nominal", [True, False])
def test_alpha_is_that_of_all_pairs(nominal: bool) -> None:
    random = np.random.default_rng(5)
    for _ in range(20):
        values = random.integers(0, 5, (4, 7)).astype(float)
        values[random.random(values.shape) < 0.2] = NAN
        assert krippendorff_alpha(values, nominal=nominal) == pytest.approx(_slow_alpha(values, nominal))


def test_fleiss_worked_example() -> None:
    # Fourteen raters, ten subjects, five categories: kappa 0.210.
    counts = np.array(
        [
            [0, 0, 0, 0, 14],
            [0, 2, 6, 4, 2],
            [0, 0, 3, 5, 6],
            [0, 3, 9, 2, 0],
            [2, 2, 8, 1, 1],
            [7, 7, 0, 0, 0],
            [3, 2, 6, 3, 0],
            [2, 5, 3, 2, 2],
            [6, 5, 2, 1, 0],
            [0, 2, 2, 3, 7],
        ],
        float,
    )
    assert fleiss_kappa(counts) == pytest.approx(0.210, abs=5e-4)


def test_kappa_needs_as_many_answers_everywhere() -> None:
    assert fleiss_kappa(np.array([[1.0, 1.0], [1.0, 2.0]])) is None
    assert fleiss_kappa(np.array([[2.0, 0.0], [2.0, 0.0]])) is None


@settings(max_examples=50, deadline=None)
@given(arrays(np.float64, (5, 4), elements=st.integers(1, 6).map(float)))
def test_w_is_friedman_s_statistic_with_ties(ratings: np.ndarray) -> None:
    w = kendall_w(ratings)
    if w is None:
        assert (ratings == ratings[:, :1]).all()
        return
    statistic, p = friedmanchisquare(*ratings.T)
    assert w == pytest.approx(statistic / (5 * 3), abs=1e-12)
    assert kendall_w_p(w, 5, 4) == pytest.approx(p, abs=1e-12)


def test_shrout_and_fleiss_table() -> None:
    found = {one.name: one for one in intraclass(SHROUT)}
    # Their Table 4; the limits are those that R's psych prints for the same table.
    expected = {"ICC(2,1)": 0.29, "ICC(3,1)": 0.71, "ICC(2,k)": 0.62, "ICC(3,k)": 0.91}
    limits = {
        "ICC(2,1)": (0.019, 0.76),
        "ICC(3,1)": (0.342, 0.95),
        "ICC(2,k)": (0.071, 0.93),
        "ICC(3,k)": (0.676, 0.99),
    }
    for name, value in expected.items():
        assert found[name].value == pytest.approx(value, abs=0.005)
        assert found[name].low == pytest.approx(limits[name][0], abs=0.0006)
        assert found[name].high == pytest.approx(limits[name][1], abs=0.005)
        assert found[name].p == pytest.approx(0.00013, abs=5e-6)


def test_a_limit_that_is_no_number_is_not_defined() -> None:
    found = {one.name: one for one in intraclass(np.array([[3.0, 6.0, 7.0], [5.0, 3.0, 2.0]]))}
    assert found["ICC(2,1)"].value == pytest.approx(-1.0)
    assert found["ICC(2,1)"].low is None
    assert found["ICC(2,k)"].low is None


def test_things_that_do_not_differ_have_no_reliability() -> None:
    assert all(one.value is None for one in intraclass(np.full((4, 5), 3.0)))
    assert all(one.value is None for one in intraclass(np.ones((1, 5))))
    same = intraclass(np.tile(np.arange(5.0), (4, 1)))
    assert [one.value for one in same] == [1.0, 1.0, 1.0, 1.0]
    # Observers differ by a constant: consistent, but not alike.
    agreement, consistency, *_ = intraclass(np.arange(5.0) + np.array([[0.0], [4.0], [8.0]]))
    assert consistency.value == 1.0
    assert agreement.value is not None
    assert agreement.value < 0.2


def _kappa(places: NDArray[np.float64]) -> float | None:
    return fleiss_kappa((places.T[:, :, None] == np.arange(places.max() + 1)).sum(axis=1).astype(np.float64))


@pytest.mark.parametrize("answers", [[0, 0, 1, 1], [0, 0, 0, 1, 1, 1], [0, 1, 2, 3]])
def test_one_series_gives_no_interval_without_width_or_its_estimate(answers: list[int]) -> None:
    rows = np.array(answers, np.float64)[:, None]
    for coefficient in (_kappa, lambda rows: krippendorff_alpha(rows, nominal=True)):
        found = with_jackknife("agreement", coefficient, rows)
        assert found.value is not None
        assert (found.low, found.high) == (None, None)
        assert "No interval" in found.reason


def test_observers_who_differ_over_several_series_still_have_an_interval() -> None:
    rows = np.random.default_rng(3).integers(0, 3, (8, 6)).astype(np.float64)
    rows[:5] = rows[0]
    found = with_jackknife("Fleiss' κ", _kappa, rows)
    assert found.value is not None
    assert found.low is not None
    assert found.high is not None
    assert found.low < found.value < found.high
    assert "No interval" not in found.reason


def test_jackknife_limits_hold_for_a_mean() -> None:
    rows = np.random.default_rng(2).normal(0.2, 0.05, (9, 1))
    found = with_jackknife("mean", lambda rows: float(rows.mean()), rows)
    half = 2.306004 * rows.std(ddof=1) / 3
    assert found.low == pytest.approx(rows.mean() - half, abs=1e-6)
    assert found.high == pytest.approx(rows.mean() + half, abs=1e-6)
    assert with_jackknife("mean", lambda rows: float(rows.mean()), rows[:3]).low is None
