"""Staircases come to rest at their share, and QUEST+ at the threshold."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.thresholds import FUNCTIONS, QuestPlus, Staircase, simulate

LEVELS = np.linspace(-2, 0, 41)


def answering(right: NDArray[np.float64], rng: np.random.Generator) -> Callable[[int], bool]:
    """Return who answers right with the probability of each level, shape (levels,)."""
    return lambda level: bool(rng.random() < right[level])


@pytest.mark.parametrize(("up", "down"), [(1, 1), (3, 1), (5, 2), (1, 3)])
def test_a_staircase_rests_at_its_share(up: int, down: int) -> None:
    """The exact shares of time at each level: the chain's moves are those of the object."""
    right = np.linspace(0.001, 0.999, 61)
    moves = np.zeros((61, 61))
    for level, p in enumerate(right):
        for was_right, chance in ((True, p), (False, 1 - p)):
            staircase = Staircase(61, level, up, down)
            staircase.learn(level, right=was_right)
            moves[level, staircase.next_level()] += chance
    time = np.linalg.matrix_power(moves, 100_000)[30] + np.linalg.matrix_power(moves, 100_001)[30]
    assert time @ right / time.sum() == pytest.approx(Staircase(61, 30, up, down).target, abs=2e-3)


def test_a_staircase_turns_and_stays_at_the_ends() -> None:
    staircase = Staircase(5, 1, up=3, down=1)
    for right in (True, True, True, False, True, False, False):
        staircase.learn(staircase.next_level(), right=right)
    assert staircase.path == [1, 0, 0, 0, 3, 2, 4, 4]
    assert staircase.reversals == [0, 3, 2]


@pytest.mark.parametrize("wrong", [{"start": 5}, {"start": -1}, {"start": 0, "up": 0}, {"start": 0, "down": 0}])
def test_a_staircase_that_cannot_start_is_refused(wrong: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="cannot start"):
        Staircase(5, **wrong)


@pytest.mark.nightly
def test_the_median_of_the_standard_prior_is_not_drawn_by_shallow_functions() -> None:
    """Logistic, 40 observers of 100 trials: with unknown slopes the mean lies lower, with the true one it does not."""
    shape, levels = FUNCTIONS["logistic"], np.linspace(-2, 0, 21)
    medians, means, known = [], [], []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        true = rng.uniform(-1.4, -0.6)
        right = shape.probability(levels, true, 8.0, 0.5, 0.02)
        standard = QuestPlus.standard(levels, function=shape)
        told = simulate(standard, 100, answering(right, rng))
        sharp = QuestPlus(levels, thresholds=np.linspace(-3, 1, 81), slopes=[8.0], function=shape)
        for level, answer in told:
            sharp.learn(level, right=answer)
        medians.append(standard.median[0] - true)
        means.append(standard.mean[0] - true)
        known.append(sharp.mean[0] - true)
    assert abs(np.mean(medians)) < 0.02
    assert np.mean(means) < np.mean(medians) - 0.005
    assert np.mean(known) > np.mean(means) + 0.005


@pytest.mark.parametrize("choices", [QuestPlus.standard(LEVELS, guess=None), Staircase(41, 20, 3, 1)])
def test_what_would_follow_is_what_follows(choices: QuestPlus | Staircase) -> None:
    rng = np.random.default_rng(2)
    for _ in range(30):
        level, right = choices.next_level(), bool(rng.random() < 0.7)
        foreseen = choices.after(level, right=right)
        assert choices.next_level() == level
        choices.learn(level, right=right)
        assert choices.next_level() == foreseen


def test_rounding_of_another_processor_chooses_the_same_levels() -> None:
    """For yes/no, levels on both sides of the middle are even at first: errors of 1e-12 must not decide."""
    shape, levels = FUNCTIONS["normal"], np.linspace(-1.0, 1.0, 20)
    quest = QuestPlus.standard(levels, guess=None, function=shape)
    first, promised = quest.next_level(), quest.information()
    assert promised[first] == pytest.approx(promised[19 - first], abs=1e-12)
    assert first < 19 - first
    exact = quest._log_posterior
    for seed in range(30):
        quest._log_posterior = exact + np.random.default_rng(seed).normal(0.0, 1e-12, len(quest.grid))
        assert quest.next_level() == first


def test_medians_are_between_the_points_of_the_grid() -> None:
    quest = QuestPlus(LEVELS, thresholds=[-2.0, -1.0, 0.0], slopes=[3.0], lapses=[0.0, 0.04])
    assert quest.median == pytest.approx((-1.0, 3.0, 0.5, 0.02))
    for _ in range(40):
        quest.learn(20, right=True)
    assert quest.median[0] < -1.4
