"""Choosing pairs: gains against their definitions, batches without repeats, balance, and the win over random pairs."""

from __future__ import annotations

import random
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.scaling import Posterior, learnt_posterior, updated_posterior
from analysis.scaling.learnt_prior import posterior
from documents.arrays import Floats
from extensions.adaptive_pairs import Gain, PairChooser, best_matching, entropy_gain, gains, variance_gain


def _entropy(p: Floats) -> Floats:
    p = np.clip(p, 1e-15, 1 - 1e-15)
    return np.asarray(-p * np.log(p) - (1 - p) * np.log1p(-p))


def _dense() -> tuple[Floats, Floats]:
    x = np.linspace(-12, 12, 20_001)
    weights = np.exp(-x * x / 2)
    return x, weights / weights.sum()


@pytest.mark.parametrize("sd", [0.1, 1.0, 2.0, 3.0])
def test_entropy_gain_is_the_mutual_information(sd: float) -> None:
    mean = np.linspace(-6, 6, 13)
    x, weights = _dense()
    p = 1 / (1 + np.exp(-(mean[:, None] + sd * x)))
    dense = _entropy(p @ weights) - _entropy(p) @ weights
    assert np.abs(entropy_gain(mean, np.full(13, sd**2)) - dense).max() < 1e-4


def _some_posterior(count: int, seed: int) -> Posterior:
    wins = np.random.default_rng(seed).integers(0, 3, (count, count)).astype(float)
    np.fill_diagonal(wins, 0)
    return posterior(wins, 1.2)


def test_variance_gain_is_how_far_the_sum_of_variances_falls() -> None:
    found = _some_posterior(7, 1)
    told = variance_gain(found)
    centre = np.eye(7) - 1 / 7
    x, weights = _dense()
    mean, variance = found.contrasts()
    for i in range(7):
        for j in range(i):
            p = 1 / (1 + np.exp(-(mean[i, j] + np.sqrt(variance[i, j]) * x)))
            a = np.eye(7)[i] - np.eye(7)[j]
            # The covariance is that of strengths that sum to zero: n − 1 directions.
            after = np.linalg.pinv(np.linalg.pinv(found.covariance) + ((p * (1 - p)) @ weights) * np.outer(a, a))
            falls = np.trace(centre @ found.covariance @ centre) - np.trace(centre @ after @ centre)
            assert told[i, j] == pytest.approx(falls, rel=1e-3)


@given(st.integers(2, 14), st.integers(1, 9), st.integers(0, 999))
@settings(max_examples=40, deadline=None)
def test_a_matching_holds_each_item_once_and_the_best_pair_first(count: int, most: int, seed: int) -> None:
    gain = np.random.default_rng(seed).random((count, count))
    gain += gain.T
    pairs = best_matching(gain, most, random.Random(seed))
    assert len(pairs) == min(most, count // 2)
    items = [item for pair in pairs for item in pair]
    assert len(items) == len(set(items))
    assert gain[pairs[0]] == np.triu(gain, 1).max()


def _strengths(count: int, spread: float, seed: int) -> Floats:
    theta = np.random.default_rng(seed).normal(0, spread, count)
    return np.asarray(theta - theta.mean())


def _asked(
    count: int, batch: int, trials: int, seed: int, theta: Floats, gain: Gain = "variance"
) -> tuple[PairChooser, list[list[tuple[int, int]]]]:
    chooser, rng = PairChooser(count, batch, random.Random(seed), gain), random.Random(seed + 1)
    batches: list[list[tuple[int, int]]] = []
    done = 0
    while done < trials:
        batches.append(chooser.next_batch(trials - done))
        for first, second in batches[-1]:
            won = rng.random() < 1 / (1 + np.exp(theta[second] - theta[first]))
            chooser.learn(first, second, first_share=float(won))
        done += len(batches[-1])
    return chooser, batches


@pytest.mark.parametrize(("count", "batch"), [(30, 15), (31, 15), (12, 1), (12, 4), (5, 2), (2, 1)])
def test_batches_link_all_repeat_nothing_and_balance_sides(count: int, batch: int) -> None:
    trials = 8 * count
    _, batches = _asked(count, batch, trials, 3, _strengths(count, 1.5, 3))
    pairs = [pair for pairs in batches for pair in pairs]
    assert len(pairs) == trials
    for chosen in batches:
        items = [item for pair in chosen for item in pair]
        assert len(items) == len(set(items))
    reached, links = {pairs[0][0]}, pairs[: count - 1]
    for _ in links:
        reached |= {item for pair in links if set(pair) & reached for item in pair}
    assert reached == set(range(count))
    if count > 5:
        assert not [1 for one, other in pairwise(pairs) if set(one) & set(other)]
    sides = np.zeros(count)
    for first, second in pairs:
        sides[first] += 1
        sides[second] -= 1
    assert np.abs(sides).max() <= 4


def test_answers_and_seed_decide_everything() -> None:
    theta = _strengths(20, 1.5, 1)
    assert _asked(20, 10, 120, 7, theta)[1] == _asked(20, 10, 120, 7, theta)[1]
    assert _asked(20, 10, 120, 7, theta)[1] != _asked(20, 10, 120, 8, theta)[1]
    assert _asked(20, 10, 120, 7, theta)[1][4:] != _asked(20, 10, 120, 7, -theta)[1][4:]


@pytest.mark.parametrize("share", [0.0, 0.5, pytest.param(1.0, marks=pytest.mark.stress)])
@pytest.mark.parametrize("gain", ["variance", "entropy"])
def test_answers_that_are_all_alike_leave_everything_finite(share: float, gain: Gain) -> None:
    chooser = PairChooser(9, 4, random.Random(2), gain)
    for _ in range(12):
        for first, second in chooser.next_batch(4):
            chooser.learn(first, second, first_share=share)
        found = gains(updated_posterior(chooser.wins), gain)
        assert np.isfinite(found).all()
        assert found[np.triu_indices(9, 1)].min() >= 0


def _error(wins: Floats, theta: Floats) -> float:
    found = learnt_posterior(wins).theta
    return float(((found - found.mean() - theta) ** 2).mean())


@pytest.mark.nightly
def test_chosen_pairs_beat_random_ones() -> None:
    """30 items far apart, 400 trials: the squared error is below 85 % of that of random pairs, over 10 sets of items.

    It is about two thirds; pairs chosen at random would come out at 100 %.
    """
    chosen, at_random = [], []
    for seed in range(10):
        theta = _strengths(30, 3.0, seed)
        chosen.append(_error(_asked(30, 15, 400, seed, theta)[0].wins, theta))
        rng = np.random.default_rng(seed + 10_000)
        wins = np.zeros((30, 30))
        for _ in range(400):
            i, j = rng.choice(30, 2, replace=False)
            won = rng.random() < 1 / (1 + np.exp(theta[j] - theta[i]))
            wins[(i, j) if won else (j, i)] += 1
        at_random.append(_error(wins, theta))
    assert np.mean(chosen) < 0.85 * np.mean(at_random)
