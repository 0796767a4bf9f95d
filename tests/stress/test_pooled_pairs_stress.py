"""Pairs chosen by the answers of all observers: the error that is promised, and coverage of the report's intervals."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.scaling import learnt_posterior
from runner.blocks.incomplete_pairs import designs
from runner.reports.pooled_studies import pooled_study

pytestmark = pytest.mark.stress
Floats = NDArray[np.float64]
STIMULI, OBSERVERS, TRIALS_PER_STIMULUS, SPREAD_NATS = 60, 15, 10, 2.0
STUDIES = 24  # the ratio of the two errors has a standard error of 0.03


def truth(study: int, count: int) -> Floats:
    theta = np.random.default_rng([study, count]).normal(0, SPREAD_NATS, count)
    return np.asarray(theta - theta.mean())


def balanced_wins(theta: Floats, trials: int, study: int) -> Floats:
    """Return the answers to a balanced incomplete design of as many trials by as many observers."""
    pairs = list(combinations(range(len(theta)), 2))
    rng = np.random.default_rng([study, 1])
    wins = np.zeros((len(theta), len(theta)))
    for part in designs(len(theta), pairs, trials, str(study), OBSERVERS):
        for i, j in (pairs[index] for index in part):
            wins[(i, j) if rng.random() < 1 / (1 + np.exp(theta[j] - theta[i])) else (j, i)] += 1
    return wins


def rms_error(wins: Floats, theta: Floats) -> float:
    return float(np.sqrt(((learnt_posterior(wins).theta - theta) ** 2).mean()))


@pytest.mark.parametrize("at_once", [1, 5])
def test_the_error_is_at_most_eight_tenths_of_a_balanced_designs(at_once: int) -> None:
    """60 stimuli, sd 2, 15 observers of 10 trials per stimulus, one after the other and five at a time."""
    trials = STIMULI * TRIALS_PER_STIMULUS // 2
    errors = np.zeros((STUDIES, 2))
    for study in range(STUDIES):
        theta = truth(study, STIMULI)
        wins = pooled_study(np.tile(theta, (OBSERVERS, 1)), trials, seed=str(study), at_once=at_once).sum(axis=0)
        assert wins.sum() == OBSERVERS * trials
        errors[study] = rms_error(wins, theta), rms_error(balanced_wins(theta, trials, study), theta)
    pooled, balanced = np.sqrt((errors**2).mean(axis=0))
    ratios = errors[:, 0] / errors[:, 1]
    spread = ratios.std(ddof=1) / np.sqrt(STUDIES)
    print(f"{at_once} at once: {pooled:.3f} against {balanced:.3f} nats, {pooled / balanced:.3f} × (± {spread:.3f})")
    assert pooled <= 0.8 * balanced


def endless(wins: Floats, theta: Floats, between: float) -> Floats:
    """Return the scores that endless observers of that kind would give, asked about the same pairs as often."""
    node, weight = np.polynomial.hermite_e.hermegauss(31)
    own = (theta[:, None] - theta)[..., None] + np.sqrt(2) * between * node
    share = (weight / weight.sum() / (1 + np.exp(-own))).sum(axis=-1)
    # So many that the prior says nothing.
    return learnt_posterior(200 * (wins + wins.T) * share).theta


@pytest.mark.parametrize(("between", "least", "most", "least_endless"), [(0.0, 0.9, 0.98, 0.9), (0.7, 0.4, 0.85, 0.85)])
def test_intervals_cover_where_observers_are_alike_and_are_too_narrow_where_they_differ(
    between: float, least: float, most: float, least_endless: float
) -> None:
    """A limit that docs/pooled_pairs.md and the report state: 20 stimuli, 15 observers, intervals of differences."""
    first, second = np.triu_indices(20, 1)
    covered, of_endless, by_bootstrap = [], [], []
    for study in range(20):
        rng = np.random.default_rng([study, 7])
        theta = rng.normal(0, SPREAD_NATS, 20)
        own = theta + rng.normal(0, between, (OBSERVERS, 20))
        wins = pooled_study(own, 100, seed=f"c{study}")
        mean, variance = (part[first, second] for part in learnt_posterior(wins.sum(axis=0)).contrasts())
        off = np.abs(mean - theta[first] + theta[second])
        covered.append((off < 1.96 * np.sqrt(variance)).mean())
        usual = endless(wins.sum(axis=0), theta, between)
        of_endless.append((np.abs(mean - usual[first] + usual[second]) < 1.96 * np.sqrt(variance)).mean())
        drawn = [learnt_posterior(wins[rng.integers(OBSERVERS, size=OBSERVERS)].sum(axis=0)).theta for _ in range(60)]
        by_bootstrap.append((off < 2.145 * np.std([d[first] - d[second] for d in drawn], axis=0, ddof=1)).mean())
    told = {"mean strengths": covered, "endless observers": of_endless, "mean strengths, bootstrap": by_bootstrap}
    print(f"{between} nats between observers:", {name: round(float(np.mean(each)), 3) for name, each in told.items()})
    assert least < np.mean(covered) < most
    assert np.mean(of_endless) > least_endless
