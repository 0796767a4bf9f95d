"""Chances of pairs, beside the same by sampling the estimates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import norm
from scipy.stats import t as student

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.inference import pair_probabilities
from analysis.inference.chances import Chance
from analysis.scaling import LAWS, Model, score
from tests.analysis.slow_profiles import of_pair

Maker = Callable[..., Comparisons]


def ends_of(chance: Chance) -> tuple[float, float]:
    return chance.low, chance.high


THETA = np.array([0.8, 0.3, -0.1, -1.0])


def test_two_items_by_hand() -> None:
    pair = pair_probabilities(score(from_answers([Answer("a", "b", 30), Answer("b", "a", 10)]))).pairs[0]
    d, se = np.log(3), np.sqrt(1 / 30 + 1 / 10)
    assert pair.first_preferred.value == pytest.approx(0.75, abs=1e-12)
    low, high = of_pair(np.array([[0.0, 30.0], [10.0, 0.0]]), 0, 1).interval(norm.ppf(0.975))
    assert (pair.low, pair.high) == pytest.approx((low, high), abs=1e-7)
    assert pair.se == pytest.approx(se)
    assert (pair.low, pair.high) == pytest.approx((d - 1.96 * se, d + 1.96 * se), abs=0.1)
    ends = 1 / (1 + np.exp(-np.array([low, high])))
    assert ends_of(pair.first_preferred) == pytest.approx(tuple(ends), abs=1e-8)
    assert ends_of(pair.second_preferred) == pytest.approx(tuple(1 - ends[::-1]), abs=1e-8)
    assert pair.tie is None


def test_the_sandwich_has_students_law(make: Maker) -> None:
    answers = make(THETA, 6, gaps=0.1)
    scores, model = score(answers, covariance="sandwich"), score(answers, covariance="model").fit.covariance
    result = pair_probabilities(scores, level=0.9)
    names, covariance = scores.comparisons.items, scores.fit.covariance
    assert len(result.pairs) == 6
    for pair in result.pairs:
        i, j = names.index(pair.first), names.index(pair.second)
        assert scores.fit.theta[i] >= scores.fit.theta[j] - 1e-12
        own, plain = (of[i, i] + of[j, j] - 2 * of[i, j] for of in (covariance, model))
        assert pair.df is not None
        reach = student.ppf(0.95, pair.df) * np.sqrt(own / plain)
        low, high = of_pair(answers.wins, i, j).interval(reach)
        d = scores.fit.theta[i] - scores.fit.theta[j]
        assert (pair.low, pair.high) == pytest.approx((min(low, d), max(high, d)), abs=1e-6)
        assert pair.first_preferred.low == pytest.approx(1 / (1 + np.exp(-min(low, d))), abs=1e-6)


def test_thurstone_goes_through_the_normal_law(make: Maker) -> None:
    scores = score(make(THETA, 12), "thurstone")
    for pair in pair_probabilities(scores).pairs:
        assert pair.first_preferred.value == pytest.approx(norm.cdf(pair.difference), abs=1e-12)
        ends = norm.cdf(pair.low), norm.cdf(pair.high)
        assert ends_of(pair.first_preferred) == pytest.approx(ends, abs=1e-12)


@pytest.mark.parametrize("model", ["davidson", "rao-kupper"])
def test_ties_beside_sampled_estimates(make: Maker, model: Model) -> None:
    scores = score(make(THETA, 60, model=model, k=0.4, repeats=10), model)
    fit, law = scores.fit, LAWS[model]
    n = fit.counts.n
    random = np.random.default_rng(3)
    centre = np.r_[fit.theta, fit.parameters[0].estimate]
    drawn = random.multivariate_normal(centre, fit.joint_covariance, 40_000)
    for pair in pair_probabilities(scores).pairs:
        i, j = (scores.comparisons.items.index(name) for name in (pair.first, pair.second))
        sampled = law.probabilities(drawn[:, i] - drawn[:, j], drawn[:, n])
        exact = law.probabilities(np.array([pair.difference]), centre[n])
        assert pair.tie is not None
        shown = [pair.first_preferred, pair.second_preferred, pair.tie]
        assert sum(chance.value for chance in shown) == pytest.approx(1, abs=1e-12)
        for chance, values, true in zip(shown, sampled, exact, strict=True):
            assert chance.value == pytest.approx(true[0], abs=1e-12)
            # Normal estimates on a scale that is not quite straight: a twentieth of the interval's length.
            slack = 0.05 * (chance.high - chance.low)
            assert ends_of(chance) == pytest.approx(tuple(np.quantile(values, [0.025, 0.975])), abs=slack)


def test_observers_who_all_agree_leave_the_chance_open() -> None:
    votes = [Answer("a", "b", 3, f"{o}") for o in range(4)] + [Answer("b", "a", 1, f"{o}") for o in range(4)]
    result = pair_probabilities(score(from_answers(votes), covariance="sandwich"))
    assert ends_of(result.pairs[0].first_preferred) == (0.0, 1.0)
    assert result.to_json()["pairs"][0]["high"] is None


def test_separated_items_have_no_chances() -> None:
    scores = score(from_answers([Answer("a", "b", 3)]))
    with pytest.raises(ResultsError, match="separated"):
        pair_probabilities(scores)
    with pytest.raises(ResultsError, match="alpha is"):
        pair_probabilities(score(from_answers([Answer("a", "b", 3), Answer("b", "a")])), level=1.5)
