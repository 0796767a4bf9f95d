"""Which place each observer chose, and how often they said the same again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binomtest, linregress, spearmanr

from analysis.comparisons import Answer, from_answers
from analysis.kinds import Trial
from analysis.observers import FastAnswers
from analysis.observers.responses import response_times, self_agreements, side_biases
from analysis.records import SessionLog
from tests.answers import changed, new_answer
from tests.kept import known


def test_ties_say_nothing_of_sides() -> None:
    (side,) = side_biases(from_answers([Answer("a", "b", 1, first="a"), Answer("a", "b", 5, first="a", tie=True)]))
    assert side is not None
    assert side.answers == 1


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(["ab", "ba", "bc", "ca"]), st.booleans(), st.integers(0, 1)), max_size=20))
def test_every_two_answers_to_a_pair_are_held_against_each_other(given_answers: list[tuple[str, bool, int]]) -> None:
    answers = [Answer(pair[0], pair[1], 1.0, str(person), tie=tie) for pair, tie, person in given_answers]
    if not answers:
        return
    comparisons = from_answers(answers)
    for name, found in zip(comparisons.observers, self_agreements(comparisons), strict=True):
        own = [answer for answer in answers if answer.observer == name]
        outcomes = [(frozenset((one.winner, one.loser)), "tie" if one.tie else one.winner) for one in own]
        twos = [(one, other) for one, other in combinations(outcomes, 2) if one[0] == other[0]]
        if not twos:
            assert found is None
            continue
        assert found is not None
        assert found.twos == len(twos)
        assert found.alike == sum(one == other for one, other in twos)
        assert found.repeated == sum(count > 1 for count in Counter(pair for pair, _ in outcomes).values())
        assert 0 <= found.share <= 1


@pytest.mark.parametrize(("first", "of"), [(0, 1), (1, 1), (0, 9), (9, 9), (3, 9), (5, 10), (45, 90), (31, 90)])
def test_sides_are_those_of_scipy(first: int, of: int) -> None:
    """Limits and p of all observers at once are those that SciPy computes one by one."""
    answers = [Answer("a", "b", first, first="a"), Answer("b", "a", of - first, first="a")]
    (side,) = side_biases(from_answers(answers))
    assert side is not None
    test = binomtest(first, of)
    limits = test.proportion_ci(method="wilson")
    assert (side.low, side.high) == pytest.approx((limits.low, limits.high), rel=1e-12, abs=1e-15)
    assert side.p == pytest.approx(test.pvalue, rel=1e-12)


def test_weights_are_no_repetitions() -> None:
    assert self_agreements(from_answers([Answer("a", "b", 1.5), Answer("b", "a", 0.7)])) == (None,)
    assert self_agreements(from_answers([Answer("a", "b", 1)])) == (None,)


Maker = Callable[..., SessionLog]
THETA = {"a": -2.0, "b": -0.5, "c": 0.0, "d": 2.5}
PAIRS = [(a, b) for a in THETA for b in THETA if a != b]


def timed(session: SessionLog, seconds: list[float]) -> SessionLog:
    pairs = zip(session.answers, seconds, strict=True)
    return replace(session, answers=tuple(changed(trial, response_time_s=time) for trial, time in pairs))


def test_times_that_follow_the_difference_give_its_slope(make_session: Maker) -> None:
    random = np.random.default_rng(1)
    gap = np.array([abs(THETA[a] - THETA[b]) for a, b in PAIRS])
    seconds = np.exp(3 - 0.4 * gap + random.normal(0, 0.05, len(gap)))
    found = known(response_times([timed(make_session(names="abcd", answers=PAIRS), seconds.tolist())], THETA))
    assert found.median_s == pytest.approx(np.median(seconds))
    assert found.trend is not None
    assert found.trend.slope == pytest.approx(-0.4, abs=0.05)
    assert 0.005 < found.trend.slope_se < 0.05
    line, ranks = linregress(gap, np.log(seconds)), spearmanr(gap, seconds)
    assert (found.trend.slope, found.trend.slope_se) == pytest.approx((line.slope, line.stderr), rel=1e-9)
    assert (found.trend.spearman, found.trend.p) == pytest.approx((ranks.statistic, ranks.pvalue), rel=1e-9)
    assert found.trend.p < 0.001
    assert found.to_json()["slope_per_nat"] == found.trend.slope


def test_the_rank_correlation_takes_differences_equal_but_for_rounding_as_equal(make_session: Maker) -> None:
    """Of strengths -1, 0 and 1 many differences are 1; a last bit, which the processor decides, must not order them."""
    seconds = np.random.default_rng(3).uniform(1, 3, len(PAIRS)).tolist()
    session = timed(make_session(names="abcd", answers=PAIRS), seconds)
    exact = dict(zip("abcd", (-1.0, 0.0, 0.0, 1.0), strict=True))
    trends = []
    for bits in ((0, 0, 0, 0), (1, -1, 2, -2), (-3, 1, -1, 2)):
        theta = {name: value + 1e-15 * bit for (name, value), bit in zip(exact.items(), bits, strict=True)}
        found = known(response_times([session], theta))
        assert found.trend is not None
        trends.append((found.trend.spearman, found.trend.p))
    assert trends[0] == trends[1] == trends[2]
    gap = [abs(exact[a] - exact[b]) for a, b in PAIRS]
    assert trends[0][0] == pytest.approx(spearmanr(gap, seconds).statistic)


def test_too_fast_answers_are_counted_and_kept(make_session: Maker) -> None:
    session = timed(make_session(names="abcd", answers=PAIRS), [0.1] * 3 + [0.2] + [1.0] * 8)
    found = known(response_times([session], THETA))
    assert (found.answers, found.too_fast) == (12, 3)
    strict = known(response_times([session], THETA, too_fast_s=0.5))
    assert strict.too_fast == 4


@pytest.mark.parametrize("theta", [{}, dict.fromkeys("abcd", 1.0), dict.fromkeys("abcd", float("nan"))])
def test_without_scores_or_differences_there_is_no_trend(make_session: Maker, theta: dict[str, float]) -> None:
    seconds = np.linspace(1, 2, 12).tolist()
    found = known(response_times([timed(make_session(names="abcd", answers=PAIRS), seconds)], theta))
    assert found.trend is None
    assert found.to_json()["spearman"] is None


def test_few_answers_equal_times_and_none(make_session: Maker) -> None:
    few = known(response_times([make_session(names="abcd", answers=PAIRS[:7])], THETA))
    assert few.trend is None
    same = known(response_times([timed(make_session(names="abcd", answers=PAIRS), [1.0] * 12)], THETA))
    assert same.trend is None
    assert response_times([make_session(names="abcd", answers=[])], THETA) is None


def _trials(count: int, seconds: float, ignored: int) -> list[Trial]:
    presses = [["up", 0.05, "early"]]
    return [
        new_answer(
            1,
            number,
            "all_pairs",
            (("up", seconds),),
            seconds,
            "2026-01-02T03:04:05Z",
            {"ignored": presses} if number < ignored else {},
        )
        for number in range(count)
    ]


def test_half_of_ten_trials_with_ignored_presses_or_fast_answers_are_striking() -> None:
    assert FastAnswers.of(_trials(10, 1.0, 5)).striking
    assert not FastAnswers.of(_trials(10, 1.0, 4)).striking
    assert FastAnswers.of(_trials(300, 0.15, 0)).striking
    assert not FastAnswers.of(_trials(9, 0.15, 9)).striking
    assert "5 of 10 trials" in FastAnswers.of(_trials(10, 1.0, 5)).words
