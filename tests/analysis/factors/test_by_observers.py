"""Tests of factors, interactions and lack of fit where observers differ: their level, and what they find."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.factors import FactorEffects, factor_effects
from analysis.report import factors_section
from analysis.report.factors import explained_words
from analysis.scaling import ObserverTest
from documents.pages import Paragraph

Factors = Mapping[str, Mapping[str, str | float]]


def study(
    random: np.random.Generator, grid: Factors, theta: NDArray[np.float64], taste: float, observers: int = 10
) -> Comparisons:
    """One answer of each observer to each pair; observers' own strengths scatter by ``taste`` nats."""
    names = list(grid)
    first, second = np.triu_indices(len(names), 1)
    answers = []
    for observer in range(observers):
        own = theta + taste * random.standard_normal(len(names))
        won = random.random(len(first)) < 1 / (1 + np.exp(own[second] - own[first]))
        pairs = zip(np.where(won, first, second).tolist(), np.where(won, second, first).tolist(), strict=True)
        answers += [Answer(names[winner], names[loser], observer=f"{observer}") for winner, loser in pairs]
    return from_answers(answers, names)


def test_interactions_and_lack_of_fit_of_all_observers_are_found(grid: Factors) -> None:
    random = np.random.default_rng(2)
    together = np.array([one["paint"] == "red" and one["view"] == "stereo" for one in grid.values()]) * 1.8
    odd = np.eye(12)[3] * 2.0
    found = np.zeros(2, int)
    for _ in range(5):
        interaction = (
            factor_effects(study(random, grid, together, 0.7), grid, use=("paint", "view")).interactions[0].by_observers
        )
        explained = factor_effects(study(random, grid, odd, 0.7), grid, use=("paint", "view")).explained
        assert interaction is not None
        assert explained is not None
        assert explained.lack_of_fit_by_observers is not None
        found += [interaction.p <= 0.05, explained.lack_of_fit_by_observers.p <= 0.05]
    assert (found >= 4).all(), found


def test_statistics_of_independent_answers_are_near_the_likelihood_ratios(grid: Factors) -> None:
    found = factor_effects(study(np.random.default_rng(3), grid, np.linspace(-0.5, 0.5, 12), 0.0, observers=60), grid)
    assert found.explained is not None
    explained = found.explained
    pairs: list[tuple[float | None, int | None, ObserverTest | None]] = [
        (explained.lack_of_fit, explained.lack_of_fit_df, explained.lack_of_fit_by_observers)
    ]
    pairs += [(test.statistic, test.df, test.by_observers) for test in found.tests]
    pairs += [(test.statistic, test.df, test.by_observers) for test in found.interactions]
    for statistic, df, own in pairs:
        assert own is not None
        assert statistic is not None
        assert own.df == df
        assert abs(own.statistic - statistic) < 0.03 * statistic + 0.01


def test_no_observers_no_test_by_observers(grid: Factors) -> None:
    answers = study(np.random.default_rng(4), grid, np.zeros(12), 0.0, observers=4)
    found = factor_effects(answers, grid)
    assert found.tests[0].by_observers is None
    assert found.tests[0].observer_p == found.tests[0].robust_p
    assert found.interactions[0].observer_p_holm is None


def test_one_verdict_by_observers_and_averages_and_lack_of_fit_are_said(grid: Factors) -> None:
    red_stereo = np.array([one["paint"] == "red" and one["view"] == "stereo" for one in grid.values()]) * 1.8
    found = factor_effects(study(np.random.default_rng(2), grid, red_stereo, 0.3), grid, use=("paint", "view"))
    (crossed,) = found.to_json()["interactions"]
    assert crossed["verdict"] == "distinguished"
    assert ["'paint'" in line and "'view'" in line for line in found.cautions] == [True, True]
    assert "factors do not name" in explained_words(found)
    assert found.cautions[0] in shown(found)

    random = np.random.default_rng(5)
    alike = factor_effects(study(random, grid, np.zeros(12), 0.0), grid, use=("paint", "view"))
    assert alike.cautions == ()
    assert alike.to_json()["explained"]["lack_of_fit_verdict"] == "not distinguished"
    assert "factors do not name" not in explained_words(alike)

    apart = [factor_effects(study(random, grid, np.zeros(12), 1.0), grid, use=("paint", "view")) for _ in range(12)]
    disputed = [one.tests[0] for one in apart if one.tests[0].p <= 0.05 < (one.tests[0].conclusion.p or 0)]
    assert disputed
    assert {test.to_json()["verdict"] for test in disputed} == {"not distinguished"}


def shown(found: FactorEffects) -> str:
    blocks = factors_section(found).blocks
    return " ".join(block.text for block in blocks if isinstance(block, Paragraph))
