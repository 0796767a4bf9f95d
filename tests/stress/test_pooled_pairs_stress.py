"""Pairs chosen by the answers of all observers: the error that is promised, and coverage of the report's intervals."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy.special import stdtrit

from analysis.comparisons import Answer, from_answers
from analysis.covariance import contrast_variances
from analysis.report import estimate_scores
from analysis.scaling import learnt_posterior
from documents.arrays import Floats
from runner.blocks.incomplete_pairs import designs
from runner.reports.pooled_studies import pooled_study
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress
STIMULI, OBSERVERS, TRIALS_PER_STIMULUS, SPREAD_NATS = 60, 15, 10, 2.0
STUDIES = how_many(8, 24)


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


def test_the_error_is_no_more_than_eight_tenths_of_a_balanced_designs() -> None:
    """60 stimuli, sd 2, 15 observers of 10 trials per stimulus, five at a time.

    So few studies tell the ratio to some 0.05: it may lie above by two standard errors. `benchmarks/active_pairs.py`
    holds it to the promise, by what the collected information lets expect.
    """
    trials = STIMULI * TRIALS_PER_STIMULUS // 2
    errors = np.zeros((STUDIES, 2))
    for study in range(STUDIES):
        theta = truth(study, STIMULI)
        wins = pooled_study(np.tile(theta, (OBSERVERS, 1)), trials, seed=str(study), at_once=5).sum(axis=0)
        assert wins.sum() == OBSERVERS * trials
        errors[study] = rms_error(wins, theta), rms_error(balanced_wins(theta, trials, study), theta)
    pooled, balanced = np.sqrt((errors**2).mean(axis=0))
    ratios = errors[:, 0] / errors[:, 1]
    spread = ratios.std(ddof=1) / np.sqrt(STUDIES)
    print(f"{pooled:.3f} against {balanced:.3f} nats, {pooled / balanced:.3f} × (± {spread:.3f})")
    assert pooled / balanced <= 0.8 + 2 * spread


def endless(wins: Floats, theta: Floats, between: float) -> Floats:
    """Return the scores that endless observers of that kind would give, asked about the same pairs as often."""
    node, weight = np.polynomial.hermite_e.hermegauss(31)
    own = (theta[:, None] - theta)[..., None] + np.sqrt(2) * between * node
    share = (weight / weight.sum() / (1 + np.exp(-own))).sum(axis=-1)
    # So many that the prior says nothing.
    return learnt_posterior(200 * (wins + wins.T) * share).theta


def reported(wins: Floats) -> tuple[Floats, Floats]:
    """Return the report's scores (n,) in nats and half the width of its 95 % intervals of differences, (n, n)."""
    names = [f"{number:02d}" for number in range(wins.shape[1])]
    answers = [
        Answer(names[i], names[j], float(own[i, j]), observer=f"{who:02d}")
        for who, own in enumerate(wins)
        for i, j in np.argwhere(own)
    ]
    comparisons = from_answers(answers)
    fit = estimate_scores(comparisons, alpha=0.05, adjust="holm", chosen=True, draw=False).scores.fit
    assert fit.covariance_kind == "scaled"
    assert fit.pair_freedom is not None
    half = np.zeros(wins.shape[1:])
    half[np.triu_indices(len(names), 1)] = stdtrit(fit.pair_freedom, 0.975)
    half = (half + half.T) * np.sqrt(contrast_variances(fit.covariance))
    order = [comparisons.items.index(name) for name in names]
    return fit.theta[order], half[np.ix_(order, order)]


@pytest.mark.parametrize(
    ("observers", "between"), [(15, 0.0), (15, 0.7), (5, 0.7), (15, 0.4), (5, 0.0)][: how_many(3, 5)]
)
def test_the_report_covers_what_endless_observers_would_answer(observers: int, between: float) -> None:
    """As docs/pooled_pairs.md states: 20 stimuli, ten trials per stimulus and observer, intervals of differences."""
    first, second = np.triu_indices(20, 1)
    covered: dict[str, list[float]] = {"endless observers": [], "mean strengths": [], "endless, model": []}
    for study in range(20):
        rng = np.random.default_rng([study, 7])
        theta = rng.normal(0, SPREAD_NATS, 20)
        own = theta + rng.normal(0, between, (observers, 20))
        wins = pooled_study(own, 100, seed=f"c{study}")
        usual = endless(wins.sum(axis=0), theta, between)
        found, half = reported(wins)
        model = 1.96 * np.sqrt(learnt_posterior(wins.sum(axis=0)).contrasts()[1])
        for name, truth_, width in (
            ("endless observers", usual, half),
            ("mean strengths", theta, half),
            ("endless, model", usual, model),
        ):
            off = np.abs((found - truth_)[first] - (found - truth_)[second])
            covered[name].append(float((off < width[first, second]).mean()))
    means = {name: float(np.mean(each)) for name, each in covered.items()}
    print(f"{observers} observers, {between} nats apart:", {name: round(mean, 3) for name, mean in means.items()})
    assert 0.91 < means["endless observers"] < 0.985
    # The planted fault: the model's intervals, where observers differ.
    assert means["endless, model"] < 0.91 or between < 0.7
    assert means["mean strengths"] < 0.87 or between < 0.7
