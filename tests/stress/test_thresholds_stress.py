"""Thresholds at the edges: coverage and bias by simulation, long staircases, thousands of trials."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.thresholds import FUNCTIONS, Psychometric, QuestPlus, Staircase, fit_threshold, simulate

pytestmark = pytest.mark.stress
X = np.linspace(-2, 0, 21)


def answering(right: NDArray[np.float64], rng: np.random.Generator) -> Callable[[int], bool]:
    """Return who answers right with the probability of each level, shape (levels,)."""
    return lambda level: bool(rng.random() < right[level])


def _quest(shape: Psychometric, guess: float | None) -> QuestPlus:
    return QuestPlus(
        X,
        thresholds=np.linspace(-2, 0, 41),
        slopes=np.geomspace(1.5, 20, 8).tolist(),
        guesses=(0.0, 0.03, 0.1) if guess is None else (guess,),
        lapses=(0.0, 0.02, 0.04),
        function=shape,
    )


@pytest.mark.parametrize(("name", "slope", "guess"), [("weibull", 3.5, 0.5), ("logistic", 8.0, 0.5)])
def test_intervals_cover_and_thresholds_are_unbiased(name: str, slope: float, guess: float | None) -> None:
    """Of 600 simulated observers with 100 trials by QUEST+; three standard errors of a share are allowed."""
    shape, rng, studies = FUNCTIONS[name], np.random.default_rng(5), 600
    covered, errors, chosen = 0, [], []
    for _ in range(studies):
        true = rng.uniform(-1.4, -0.6)
        right = shape.probability(X, true, slope, 0.03 if guess is None else guess, 0.02)
        quest = _quest(shape, guess)
        told = simulate(quest, 100, answering(right, rng))
        fit = fit_threshold(
            [float(10 ** X[n]) for n, _ in told], [answer for _, answer in told], guess=guess, function=name
        )
        chosen.append(quest.mean[0] - true)
        if fit.threshold is None or fit.threshold_interval is None:
            continue
        errors.append(np.log10(fit.threshold) - true)
        low, high = np.log10(fit.threshold_interval)
        covered += bool(low <= true <= high)
    assert len(errors) > 0.98 * studies
    slack = 3 * np.sqrt(0.95 * 0.05 / studies)
    assert 0.93 - slack < covered / len(errors) < 0.97 + slack
    # The prior of lapses draws the median below: -0.02 was measured, half of the error's standard deviation or less.
    assert abs(np.mean(errors)) < np.std(errors)
    if name == "weibull":  # slopes of the grid are about the true one
        assert abs(np.mean(chosen)) < 0.02


@pytest.mark.parametrize(("up", "down"), [(1, 1), (3, 1), (7, 3), (1, 2)])
def test_long_staircases_come_to_their_share(up: int, down: int) -> None:
    rng, p = np.random.default_rng(2), np.linspace(0.0, 1.0, 101)
    told = simulate(Staircase(101, 50, up, down), 100_000, lambda level: bool(rng.random() < p[level]))
    assert np.mean([right for _, right in told]) == pytest.approx(up / (up + down), abs=0.005)


def test_ten_thousand_trials_narrow_the_interval() -> None:
    rng = np.random.default_rng(4)
    levels = 10 ** rng.choice(X, 10_000)
    right = rng.random(10_000) < FUNCTIONS["weibull"].probability(np.log10(levels), -1.0, 3.0, 0.5, 0.01)
    fit = fit_threshold(levels.tolist(), right.tolist())
    assert fit.threshold == pytest.approx(0.1, rel=0.06)
    assert fit.threshold_interval is not None
    assert fit.threshold_interval[1] / fit.threshold_interval[0] < 1.15
