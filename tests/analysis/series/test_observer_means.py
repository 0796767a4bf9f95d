"""Intervals over observers, against slow ways to the same and against the truth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import t as student

from analysis.bootstrap import tails
from analysis.report.summary import wilson_interval
from analysis.series.observer_means import bounded_means, means, shares
from tests.choice import nightly


def _wilson_by_search(share: float, answers: float, quantile: float) -> tuple[float, float]:
    """Return the shares from which the one seen is ``quantile`` standard errors off: Wilson's interval."""

    def off(truth: float) -> float:
        return (share - truth) ** 2 - quantile**2 * truth * (1 - truth) / answers

    return brentq(off, 0, share, xtol=1e-12), brentq(off, share, 1, xtol=1e-12)


def test_means_are_those_of_all_answers() -> None:
    total, count = np.array([[4.0, 0.0], [9.0, 3.0], [1.0, 0.0]]), np.array([[2.0, 0.0], [3.0, 1.0], [1.0, 0.0]])
    one, other = means(total, count)
    assert one.value == pytest.approx(14 / 6)
    assert (one.answers, one.observers) == (6, 3)
    assert one.low is not None
    assert one.high is not None
    assert one.low < 14 / 6 < one.high
    assert (other.value, other.low, other.high, other.observers) == (3.0, None, None, 1)


def test_an_interval_is_that_of_observers_drawn_one_by_one() -> None:
    random = np.random.default_rng(3)
    values = random.normal(5, 2, 12)
    (found,) = means(values[:, None], np.ones((12, 1)), replicates=20_000)
    draws = np.sort([values[random.integers(0, 12, 12)].mean() for _ in range(20_000)])
    tail = tails.widened(0.025, 12)
    assert found.low == pytest.approx(draws[int(tail * 20_000)], abs=0.06)
    assert found.high == pytest.approx(draws[int((1 - tail) * 20_000)], abs=0.06)


def test_a_share_of_independent_answers_has_wilson_s_interval() -> None:
    (found,) = shares(np.array([[1.0]] * 4 + [[0.0]] * 11), np.ones((15, 1)))
    assert (found.low, found.high) == pytest.approx(wilson_interval(4 / 15, 15))


def test_answers_that_only_repeat_an_observer_s_first_add_nothing() -> None:
    once = shares(np.array([[1.0]] * 4 + [[0.0]] * 11), np.ones((15, 1)))[0]
    (five,) = shares(np.array([[5.0]] * 4 + [[0.0]] * 11), np.full((15, 1), 5.0))
    assert once.low is not None
    assert once.high is not None
    # The design effect is estimated: 5, with 14 in place of 15 observers. Student's quantile makes up for that.
    assert (five.low, five.high) == pytest.approx(_wilson_by_search(4 / 15, 14, student.ppf(0.975, 14)), abs=1e-9)
    (none,) = shares(np.zeros((15, 1)), np.full((15, 1), 5.0))
    assert (none.low, none.high) == pytest.approx(wilson_interval(0.0, 15))


def test_answers_are_worth_what_their_scatter_among_observers_says() -> None:
    chosen, of = np.array([0.0, 1.0, 2.0, 5.0, 4.0, 0.0]), np.full(6, 5.0)
    (found,) = shares(chosen[:, None], of[:, None])
    # Of equal numbers of answers: the variance of the observers' own shares over that of a share of 30.
    effect = (chosen / 5).var(ddof=1) / 6 / (0.4 * 0.6 / 30)
    assert effect > 1
    assert (found.low, found.high) == pytest.approx(
        _wilson_by_search(0.4, 30 / effect, student.ppf(0.975, 5)), abs=1e-9
    )


def test_a_bounded_mean_s_interval_is_a_share_s_where_answers_are_0_or_the_most() -> None:
    given = np.array([[8.0]] * 4 + [[0.0]] * 11)
    (found,) = bounded_means(given, given**2, np.ones((15, 1)), 8.0)
    expected = _wilson_by_search(4 / 15, 14, student.ppf(0.975, 14))  # the sample's variance has 14 for 15
    assert found.value == pytest.approx(8 * 4 / 15)
    assert found.low is not None
    assert found.high is not None
    assert (found.low / 8, found.high / 8) == pytest.approx(expected, abs=1e-9)


def test_a_bounded_mean_far_from_its_bounds_has_student_s_interval() -> None:
    values = np.random.default_rng(3).normal(50, 1, 200)
    (found,) = bounded_means(values[:, None], values[:, None] ** 2, np.ones((200, 1)), 100.0)
    half = student.ppf(0.975, 199) * values.std(ddof=1) / np.sqrt(200)
    assert (found.low, found.high) == pytest.approx((values.mean() - half, values.mean() + half), abs=0.01 * half)


def test_answers_all_alike_have_no_interval() -> None:
    for answer in (0.0, 3.0, 8.0):
        column = np.full((5, 1), answer)
        (found,) = bounded_means(column, column**2, np.ones((5, 1)), 8.0)
        assert (found.value, found.low, found.high) == (answer, None, None)


def test_nothing_comes_of_nothing() -> None:
    assert shares(np.zeros((3, 1)), np.zeros((3, 1)))[0].value is None
    assert means(np.zeros((3, 1)), np.zeros((3, 1)))[0].value is None


@pytest.mark.parametrize("cluster", [True, *nightly(False)])
def test_intervals_hold_the_truth(cluster: bool) -> None:
    """15 observers, five answers each, with observers of their own leaning: 400 studies, at least 92 %."""
    random = np.random.default_rng(11)
    held_mean = held_share = 0
    for _ in range(400):
        lean = random.beta(1.5, 3.5, 15) if cluster else np.full(15, 0.3)
        chosen = random.binomial(5, lean)[:, None].astype(float)
        (share,) = shares(chosen, np.full((15, 1), 5.0))
        held_share += share.low is not None and share.high is not None and share.low <= 0.3 <= share.high
        (mean,) = means(chosen, np.full((15, 1), 5.0), replicates=400)
        held_mean += mean.low is not None and mean.high is not None and mean.low <= 0.3 <= mean.high
    # 92 % of 400 less two standard errors.
    assert held_share >= 357
    assert held_mean >= 357
