"""Each observer under the others' scores, and which place each chose."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binomtest, chi2, linregress, norm, spearmanr

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.kinds import Trial
from analysis.observers import FastAnswers
from analysis.observers import table as module
from analysis.observers.responses import response_times, self_agreements, side_biases
from analysis.observers.table import FitToRest, fits_to_rest
from analysis.observers.tails import lower_tail
from analysis.records import SessionLog
from analysis.scaling import fit
from tests.answers import changed, new_answer
from tests.kept import known

# Each observer under the others' scores: against a slow twin, calibrated, and finding who answers otherwise.

Study = Callable[..., Comparisons]


def slow_twin(comparisons: Comparisons, person: int) -> tuple[float, float, float, float]:
    """Return mean log likelihood, its expectation, z and p of one observer, pair by pair as the formulas stand."""
    own = comparisons.wins_by_observer()[person]
    rest = fit(comparisons.wins - own, method="firth")
    n = len(own)
    total = mean = variance = third = 0.0
    pull = np.zeros(n)
    for i in range(n):
        for j in range(i + 1, n):
            d = float(rest.theta[i] - rest.theta[j])
            p = 1 / (1 + math.exp(-d))
            count = own[i, j] + own[j, i]
            spread = rest.covariance[i, i] + rest.covariance[j, j] - 2 * rest.covariance[i, j]
            total += own[i, j] * math.log(p) + own[j, i] * math.log(1 - p)
            mean += count * (p * math.log(p) + (1 - p) * math.log(1 - p))
            mean -= count * p * (1 - p) * spread * (1 - (2 * p - 1) * d / 2)
            variance += count * p * (1 - p) * d**2
            third += count * p * (1 - p) * (1 - 2 * p) * d**3
            pull[i] += count * p * (1 - p) * d
            pull[j] -= count * p * (1 - p) * d
    variance += float(pull @ rest.covariance @ pull)
    z = (total - mean) / math.sqrt(variance)
    skew = third / variance**1.5
    df = 8 / skew**2
    # Pearson's type III law: mirrored where the skewness is negative, as it is here.
    p_value = float(chi2.sf(df - z * math.sqrt(2 * df), df)) if skew < 0 else float(norm.cdf(z))
    return total / own.sum(), mean / own.sum(), z, p_value


@pytest.mark.parametrize("times", [1, 3])
def test_it_is_that_of_the_slow_twin(study: Study, times: int) -> None:
    random = np.random.default_rng(2)
    comparisons = study(np.tile(random.normal(0, 1, 5), (6, 1)), random, times)
    for person, line in enumerate(fits_to_rest(comparisons)):
        assert line is not None
        expected = slow_twin(comparisons, person)
        assert (line.mean_log_likelihood, line.expected, line.z, line.p) == pytest.approx(expected, rel=1e-8)


def test_influence_is_what_leaving_out_changes(study: Study) -> None:
    random = np.random.default_rng(3)
    comparisons = study(np.tile(random.normal(0, 1, 5), (5, 1)), random, 2)
    together = fit(comparisons.wins, method="firth").theta
    for own, line in zip(comparisons.wins_by_observer(), fits_to_rest(comparisons), strict=True):
        change = together - fit(comparisons.wins - own, method="firth").theta
        most = int(np.abs(change).argmax())
        assert known(line).influence == pytest.approx(change[most], rel=1e-8)
        assert known(line).most_moved == comparisons.items[most]


def test_blocks_change_nothing(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(4)
    comparisons = study(np.tile(random.normal(0, 1, 4), (7, 1)), random)
    whole = fits_to_rest(comparisons)
    monkeypatch.setattr(module, "_MOST_NUMBERS", 32)
    for one, other in zip(whole, fits_to_rest(comparisons), strict=True):
        assert known(other).z == pytest.approx(known(one).z, rel=1e-9)


def by_name(comparisons: Comparisons) -> dict[str, FitToRest | None]:
    return dict(zip(comparisons.observers, fits_to_rest(comparisons), strict=True))


def test_who_answers_the_other_way_round_is_found_and_not_the_others(study: Study) -> None:
    random = np.random.default_rng(5)
    theta = np.tile(np.linspace(-1, 1, 8), (12, 1))
    theta[4] *= -1
    lines = fits_to_rest(study(theta, random))
    assert [person for person, line in enumerate(lines) if line and line.outlier] == [4]
    found = known(lines[4])
    assert found.z < -4
    assert found.mean_log_likelihood < math.log(0.5) < found.expected
    assert found.to_json()["outlier"] is True


def test_a_lone_observer_and_one_whose_rest_is_not_linked_have_no_fit() -> None:
    alone = from_answers([Answer("a", "b", 3), Answer("b", "a", 2)])
    assert fits_to_rest(alone) == (None,)
    bridge = [
        Answer("a", "b", 2, "01"),
        Answer("c", "d", 2, "01"),
        Answer("b", "c", 1, "02"),
        Answer("a", "b", 1, "02"),
    ]
    lines = by_name(from_answers(bridge))
    assert lines == {"01": None, "02": None}
    ties_only = from_answers([*two_items(), Answer("a", "b", 1, "03", tie=True)])
    assert by_name(ties_only)["03"] is None


def test_too_many_items_are_not_fitted_for_every_observer() -> None:
    path = [Answer(f"{item}", f"{item + 1}", 1, f"0{item % 2}") for item in range(module.MOST_ITEMS)]
    assert fits_to_rest(from_answers(path)) == (None, None)


def two_items() -> list[Answer]:
    return [Answer("a", "b", 4, "01"), Answer("b", "a", 1, "01"), Answer("a", "b", 3, "02"), Answer("b", "a", 2, "02")]


def test_two_items_and_separated_rests_are_finite() -> None:
    assert all(by_name(from_answers(two_items())).values())
    won_always = [Answer("a", "b", 3, f"0{person}") for person in range(5)]
    for line in fits_to_rest(from_answers(won_always)):
        assert line is not None
        assert np.isfinite([line.z, line.p, line.influence]).all()
    balanced = [
        Answer("a", "b", 1, "01"),
        Answer("b", "a", 1, "01"),
        Answer("a", "b", 1, "02"),
        Answer("b", "a", 1, "02"),
    ]
    # The others hold both to be alike: nothing is foretold, so nothing can be held against it.
    assert fits_to_rest(from_answers(balanced)) == (None, None)


@pytest.mark.parametrize("count", [1e-3, 1e9])
def test_counts_from_tiny_to_huge(count: float) -> None:
    answers = [replace(answer, count=answer.count * count) for answer in two_items()]
    for line in fits_to_rest(from_answers(answers)):
        assert line is not None
        assert np.isfinite([line.z, line.p, line.influence, line.mean_log_likelihood]).all()


def test_the_law_of_three_moments() -> None:
    x = np.linspace(-3, 3, 25)
    one = np.ones_like(x)
    assert lower_tail(x, one, 0 * one) == pytest.approx(norm.cdf(x))
    assert lower_tail(x, one, 1e-5 * one) == pytest.approx(norm.cdf(x), abs=1e-5)
    # χ² with 5 degrees of freedom has variance 10 and third moment 40; its mirror image has −40.
    assert lower_tail(x, 10 * one, 40 * one) == pytest.approx(chi2.cdf(x + 5, 5), rel=1e-9)
    assert lower_tail(x, 10 * one, -40 * one) == pytest.approx(chi2.sf(5 - x, 5), rel=1e-9)


# Which place each observer chose, and how often they said the same again.
def test_ties_say_nothing_of_sides() -> None:
    (side,) = side_biases(from_answers([Answer("a", "b", 1, first="a"), Answer("a", "b", 5, first="a", tie=True)]))
    assert known(side).answers == 1


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
    return replace(session, records=tuple(changed(trial, response_time_s=time) for trial, time in pairs))


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
        trends.append((known(found.trend).spearman, known(found.trend).p))
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
