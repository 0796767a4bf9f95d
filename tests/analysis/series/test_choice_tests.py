"""Permutation tests and their kin, against the literature and slow ways."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest
from scipy.stats import friedmanchisquare

from analysis.records import SessionLog
from analysis.series import gather
from analysis.series.choice_tests import choice_counts, kinds_tests, level_tests, neighbours_tests
from analysis.series.paired_tests import (
    MOST_EXACT,
    cochran,
    mean_difference_p,
    nemenyi_p,
    p_by_flips,
    rating_test,
    stuart_maxwell,
)
from tests.kept import known

Maker = Callable[..., SessionLog]
# Darwin's maize, crossed less self-fertilised, in eighths of an inch; Fisher (1935, Section 21): 863 of 32,768
# combinations of signs reach the sum of 314 to one side.
DARWIN = np.array([49, -67, 8, 16, 6, 23, 28, 41, 14, 29, 56, 24, 75, 60, -48], float)


def test_fisher_s_own_example_to_the_last_digit() -> None:
    assert mean_difference_p(DARWIN) == 2 * 863 / 32768
    assert mean_difference_p(-DARWIN[::-1]) == 2 * 863 / 32768


def test_every_sign_is_gone_through() -> None:
    rows = np.random.default_rng(4).integers(-3, 4, (7, 2)).astype(float)

    def statistic(sums: np.ndarray) -> np.ndarray:
        return np.asarray((sums**2).sum(axis=-1))

    seen = statistic(rows.sum(axis=0))
    slow = [statistic((np.array(signs)[:, None] * rows).sum(axis=0)) >= seen for signs in product((1, -1), repeat=7)]
    assert p_by_flips(rows, statistic) == pytest.approx(np.mean(slow))


def test_drawn_signs_come_close_to_all_signs() -> None:
    """One row more than is gone through exactly, and so small that it decides nothing."""
    rows = np.concatenate([DARWIN, [3.0], [1e-7]])
    assert len(rows) == MOST_EXACT + 1
    assert mean_difference_p(rows) == pytest.approx(mean_difference_p(rows[:-1]), abs=0.003)
    assert mean_difference_p(rows[::-1]) == mean_difference_p(rows)


@pytest.mark.parametrize("size", [1e-3, 1 / 3, 1e9])
def test_differences_that_cancel_out_but_for_rounding_are_none(size: float) -> None:
    assert mean_difference_p(size * np.array([1.0, 2.0, 3.0, -6.0])) == 1.0
    assert mean_difference_p(size * np.array([0.1, 0.2, -0.3, 0.0])) == 1.0


def test_stuart_s_table_of_eyes() -> None:
    # Unaided vision of the right and left eye of 7477 women: Stuart (1955), chi-squared 11.96, 3 degrees of freedom.
    table = np.array([[1520, 266, 124, 66], [234, 1512, 432, 78], [117, 362, 1772, 205], [36, 82, 179, 492]])
    each = np.eye(4)
    differences = np.repeat(
        [each[right] - each[left] for right in range(4) for left in range(4)], table.ravel(), axis=0
    )
    statistic, df = stuart_maxwell(differences)
    assert statistic == pytest.approx(11.957, abs=5e-4)
    assert df == 3


def test_cochran_s_q_is_friedman_s_of_yes_and_no() -> None:
    rows = np.random.default_rng(8).integers(0, 2, (20, 3)).astype(float)
    statistic, p = cochran(rows)
    expected, approximate = friedmanchisquare(*rows.T)
    assert statistic == pytest.approx(expected)
    assert p == pytest.approx(approximate, abs=0.05)
    assert cochran(np.ones((5, 3))) == (None, None)


def test_nemenyi_s_critical_difference() -> None:
    # Demsar (2006), Table 5: q = 2.343 for three, 2.728 for five at 0.05; mean ranks differ by q sqrt(k(k+1)/6S).
    for k, q in ((3, 2.343), (5, 2.728)):
        ranks = np.arange(k, dtype=float)
        rows = np.tile(ranks, (1, 1))
        observers = k * (k + 1) / 6 * (q / (k - 1)) ** 2  # so many make the ends' distance k - 1 just significant
        few, many = (nemenyi_p(np.tile(rows, (count, 1)))[0, -1] for count in (int(observers), int(observers) + 1))
        assert many < 0.05 < few
    assert nemenyi_p(np.ones((6, 3))).tolist() == np.ones((3, 3)).tolist()


def test_ratings_are_tested_within_observers() -> None:
    random = np.random.default_rng(1)
    ratings = random.normal(0, 3, (15, 1)) + np.array([[0.0, 0.0, 1.0]]) + random.normal(0, 0.5, (15, 3))
    found = known(rating_test("similarity", ("a", "b", "c"), ratings))
    statistic, p = friedmanchisquare(*ratings.T)
    assert (found.statistic, found.p) == pytest.approx((statistic, p))
    assert [pair.p_holm < 0.05 for pair in found.pairs] == [False, True, True]
    ab = found.pairs[0]
    assert ab.p == mean_difference_p(ratings[:, 0] - ratings[:, 1])
    difference = ratings[:, 1] - ratings[:, 2]
    assert found.pairs[2].effect == pytest.approx(difference.mean() / difference.std(ddof=1))
    assert rating_test("x", ("a",), ratings[:, :1]) is None
    assert rating_test("x", ("a", "b", "c"), ratings[:1]) is None


def test_where_all_rate_alike_nothing_is_claimed() -> None:
    found = known(rating_test("similarity", ("a", "b"), np.full((5, 2), 7.0)))
    assert (found.statistic, found.p, found.pairs[0].p, found.pairs[0].effect) == (None, None, 1.0, None)


def test_kinds_of_series_that_differ_are_told_apart(make_choices: Maker) -> None:
    def law(rng: object, paint: str, kind: str) -> int:
        return {"base": 1, "brighter": 4, "grey": 4}[kind] + rng.randint(-1, 1)  # type: ignore[attr-defined,no-any-return]  # the test knows its kind

    choices = gather([make_choices(f"{n:02d}", law=law) for n in range(12)])
    by = {(test.one, test.other): test for test in kinds_tests(choices)}
    assert by["base", "brighter"].p_holm < 0.01
    assert by["base", "brighter"].shift == pytest.approx(-3, abs=0.4)
    assert by["brighter", "grey"].p > 0.05
    by_level = {test.level: test for test in level_tests(choices)}
    assert by_level[1.3].p is not None
    assert by_level[1.3].p < 0.01
    assert sum(test.shares[0] for test in by_level.values()) == pytest.approx(1)


def test_observers_with_missing_series_are_compared_on_what_they_have(make_choices: Maker) -> None:
    from dataclasses import replace

    sessions = [make_choices(f"{n:02d}") for n in range(4)]
    trials = [trial for trial in sessions[0].answers if trial.details()["series"] != "GM1-base"]
    counts = choice_counts(gather([replace(sessions[0], answers=tuple(trials)), *sessions[1:]]))
    assert counts.sum(axis=2).tolist() == [[4.0] * 3] + [[5.0] * 3] * 3


def test_neighbours(make_choices: Maker) -> None:
    choices = gather([make_choices(f"{n:02d}", law=lambda *_: 3, kinds=("base",)) for n in range(10)])
    found = {(test.one, test.other): test for test in neighbours_tests(choices)}
    assert found[1.3, 1.6].p == 1.0
    assert found[1.3, 1.6].chosen == (0, 0)
    assert found[2.0, 2.5].p == 2 / 2**10
    assert found[2.0, 2.5].p_holm == 5 * 2 / 2**10
