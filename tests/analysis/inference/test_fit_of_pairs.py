"""Residuals of pairs, beside score tests of a parameter for each pair and refitted simulations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.inference import pair_residuals
from analysis.inference.answer_residuals import answer_residuals
from analysis.scaling import Model, score
from tests.analysis.conftest import answers_of

Maker = Callable[..., Comparisons]
THETA = np.array([0.9, 0.3, 0.0, -0.4, -0.8])


def score_statistic(comparisons: Comparisons, theta: NDArray[np.float64], first: int, second: int) -> float:
    """Rao's statistic of a parameter that belongs to one pair alone, by dense matrices."""
    n = len(theta)
    information, slope = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
    wins = comparisons.wins
    for i in range(n):
        for j in range(i + 1, n):
            x = np.zeros(n + 1)
            x[i], x[j], x[n] = 1, -1, float({i, j} == {first, second})
            p = 1 / (1 + np.exp(theta[j] - theta[i]))
            total = wins[i, j] + wins[j, i]
            information += total * p * (1 - p) * np.outer(x, x)
            slope += (wins[i, j] - total * p) * x
    left = information[n, n] - information[n, :n] @ np.linalg.pinv(information[:n, :n]) @ information[:n, n]
    return float(slope[n] ** 2 / left)


def test_model_z_is_the_root_of_the_score_test(make: Maker) -> None:
    comparisons = make(THETA, 9, gaps=0.3)
    scores = score(comparisons)
    result = pair_residuals(scores)
    assert len(result.pairs) == 10
    for pair in result.pairs:
        i, j = (comparisons.items.index(name) for name in (pair.first, pair.second))
        assert pair.model_z is not None
        assert pair.model_z**2 == pytest.approx(score_statistic(comparisons, scores.fit.theta, i, j), rel=1e-8)
        wins = comparisons.wins
        assert pair.observed == pytest.approx(wins[i, j] / (wins[i, j] + wins[j, i]))
        assert pair.expected == pytest.approx(1 / (1 + np.exp(scores.fit.theta[j] - scores.fit.theta[i])))
        assert pair.observed >= pair.expected


@pytest.mark.parametrize(
    ("model", "order"), [("bradley-terry", True), ("thurstone", False), ("davidson", True), ("rao-kupper", False)]
)
def test_drawn_residuals_beside_refitted_ones(make: Maker, model: Model, order: bool) -> None:
    k = 0.4 if model in ("davidson", "rao-kupper") else 0.0
    comparisons = make(THETA[:4], 30, model=model, k=k, repeats=4)
    scores = score(comparisons, model, order_effect=order)
    own = answer_residuals(scores)
    assert own.by_observer.sum(axis=0) == pytest.approx(own.residual, abs=1e-8)
    drawn = own.drawn(4000, np.random.default_rng(1))
    variance = own.total * own.variance
    slopes = own.total[:, None] * own.mean_slopes
    expected = np.diag(variance) - slopes @ own.inverse @ slopes.T
    # The law's own information is the expected one, and A the observed one: near each other with 720 answers.
    assert np.cov(drawn.T) == pytest.approx(expected, abs=0.1 * variance.max())
    # Leverage is out: no residual moves the strengths.
    sums = np.stack([drawn[:, own.counts.first == 0].sum(axis=1) - drawn[:, own.counts.second == 0].sum(axis=1)])
    if model in ("bradley-terry", "davidson"):
        assert np.abs(sums).max() < 1e-9 * variance.sum()


def test_a_pair_that_goes_its_own_way_is_named(make: Maker) -> None:
    comparisons = make(np.zeros(5), 20, repeats=2)
    assert not pair_residuals(score(comparisons)).flagged
    answers = [one for one in answers_of(comparisons) if {one.winner, one.loser} != {"b", "d"}]
    answers += [Answer("b", "d", 2 - (o == 3), f"{o:02d}") for o in range(20)] + [Answer("d", "b", 1, "03")]
    result = pair_residuals(score(from_answers(answers)))
    assert (result.flagged[0].first, result.flagged[0].second) == ("b", "d")
    assert all({pair.first, pair.second} & {"b", "d"} for pair in result.flagged)  # they bear what the pair pulls
    assert "b over d" in result.sentence
    assert result.to_json()["flagged"] == len(result.flagged) < 5


def test_observers_who_disagree_widen_the_errors() -> None:
    """Each observer always gives the same answer to a pair: twenty answers are worth one."""
    random = np.random.default_rng(5)
    answers = []
    for observer in range(12):
        for first, second in ("ab", "ac", "ad", "bc", "bd", "cd"):
            winner, loser = (first, second) if random.random() < 0.5 else (second, first)
            answers.append(Answer(winner, loser, 20, f"{observer}"))
    result = pair_residuals(score(from_answers(answers)))
    assert 10 < result.overdispersion < 40
    assert not result.flagged
    assert any(pair.model_z is not None and pair.model_z > 4 for pair in result.pairs)
    assert all(
        pair.z is not None and pair.observers_z is not None and pair.z <= pair.observers_z + 1e-9
        for pair in result.pairs
    )


def test_a_pair_that_fits_itself_has_no_residual() -> None:
    votes = {"ab": 5, "ba": 3, "bc": 4, "cb": 4, "ac": 3, "ca": 2, "cd": 6, "dc": 2}
    result = pair_residuals(score(from_answers([Answer(pair[0], pair[1], count) for pair, count in votes.items()])))
    bridge = next(pair for pair in result.pairs if "d" in (pair.first, pair.second))
    assert (bridge.z, bridge.p, bridge.flagged) == (None, None, False)
    assert bridge.leverage == pytest.approx(1)
    assert result.overdispersion == 1


def test_refusals(make: Maker) -> None:
    with pytest.raises(ResultsError, match="no correction"):
        pair_residuals(score(make(THETA)), adjust="maxz")  # type: ignore[arg-type]  # wrong on purpose
    with pytest.raises(ResultsError, match="separated"):
        pair_residuals(score(from_answers([Answer("a", "b", 3)])))
