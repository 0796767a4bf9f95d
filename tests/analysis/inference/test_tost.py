"""Equivalence by two one-sided tests, beside the interval that they amount to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import t as student

from analysis.choices import Adjust
from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.inference import equivalence, pair_probabilities, parse_margin
from analysis.scaling import score
from analysis.scaling.laws import NATS_PER_JND, STANDARD_DEVIATIONS_PER_JOD
from tests.analysis.slow_profiles import of_pair

Maker = Callable[..., Comparisons]


def test_margins() -> None:
    assert parse_margin("1jnd") == NATS_PER_JND == pytest.approx(parse_margin("75:25"))
    assert parse_margin(" 1 JOD", "thurstone") == STANDARD_DEVIATIONS_PER_JOD
    assert parse_margin("0.75", "thurstone") == pytest.approx(STANDARD_DEVIATIONS_PER_JOD)
    assert parse_margin("55:45") == pytest.approx(parse_margin("55 %")) == pytest.approx(np.log(55 / 45))
    assert parse_margin("0.2 nat") == parse_margin("0.2sd", "thurstone") == 0.2


@pytest.mark.parametrize(
    "text", ["", "jnd", "45:55", "0.5", "1", "0jnd", "-1jnd", "1e999nats", "nan", "1..2nats", "1m"]
)
def test_a_margin_that_is_none(text: str) -> None:
    with pytest.raises(ResultsError, match="the margin is") as caught:
        parse_margin(text)
    assert "0.5jnd" in str(caught.value)


def test_the_unit_belongs_to_the_law() -> None:
    with pytest.raises(ResultsError, match="are in sd"):
        parse_margin("0.2nats", "thurstone")
    with pytest.raises(ResultsError, match="are in nats"):
        parse_margin("0.2sd")


def test_uncorrected_it_is_the_interval_of_twice_the_level(make: Maker) -> None:
    scores = score(make(np.array([0.5, 0.2, 0.1, -0.5]), 25, repeats=6), covariance="sandwich")
    intervals = pair_probabilities(scores, level=0.9)
    seen = set()
    for margin in (0.2, 0.5, 1.3):
        for pair, interval in zip(equivalence(scores, margin, adjust="none").pairs, intervals.pairs, strict=True):
            within = -margin < interval.low and interval.high < margin
            assert (pair.verdict == "equivalent") == within
            seen.add((pair.verdict, pair.is_different))
    assert {("equivalent", False), ("equivalent", True), ("distinguished", True), ("not distinguished", False)} <= seen


def test_holm_by_hand(make: Maker) -> None:
    answers = make(np.array([0.1, 0.0, -0.1]), 40)
    scores, model = score(answers, covariance="sandwich"), score(answers, covariance="model").fit.covariance
    result = equivalence(scores, "1jnd")
    fit, names = scores.fit, scores.comparisons.items
    plain = []
    for pair in result.pairs:
        i, j = names.index(pair.first), names.index(pair.second)
        own, by_model = (of[i, i] + of[j, j] - 2 * of[i, j] for of in (fit.covariance, model))
        twin, spread = of_pair(answers.wins, i, j), np.sqrt(own / by_model)
        above, below = twin.root(-NATS_PER_JND) / spread, -twin.root(NATS_PER_JND) / spread
        plain.append(max(student.sf(above, 39), student.sf(below, 39)))
    order = np.argsort(plain)
    steps, largest = {}, 0.0
    for place, index in enumerate(order):
        largest = max(largest, plain[index] * (3 - place))
        steps[index] = largest
    for index, pair in enumerate(result.pairs):
        assert pair.p_equivalent == pytest.approx(min(1, steps[index]), rel=1e-6)
    assert result.count("equivalent") + result.count("distinguished") + result.count("not distinguished") == 3
    assert "of 3 pairs are equivalent" in result.sentence


def test_no_spread_is_no_evidence() -> None:
    votes = [Answer("a", "b", 3, f"{o}") for o in range(4)] + [Answer("b", "a", 1, f"{o}") for o in range(4)]
    pair = equivalence(score(from_answers(votes), covariance="sandwich"), "3jnd").pairs[0]
    assert (pair.verdict, pair.p_equivalent) == ("not distinguished", 1.0)
    assert pair.p_different == pytest.approx(2 / 2**4)  # four who agree, by exchanging the two items


def test_refusals(make: Maker) -> None:
    scores = score(make(np.zeros(3)), adjust="maxz")
    assert equivalence(scores, "1jnd").adjust == "holm"
    with pytest.raises(ResultsError, match="no correction 'maxz'"):
        equivalence(scores, "1jnd", adjust="maxz")
    wrong: Adjust = "none"
    with pytest.raises(ResultsError, match="the margin is -1"):
        equivalence(scores, -1.0, adjust=wrong)
    with pytest.raises(ResultsError, match="alpha"):
        equivalence(scores, 1.0, alpha=2)
