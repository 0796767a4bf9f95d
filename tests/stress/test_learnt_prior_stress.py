"""Strengths under a learnt prior pushed to the edges: coverage at every size, huge and tiny counts, many items."""

from __future__ import annotations

import random
import time

import numpy as np
import pytest

from analysis.scaling import learnt_posterior
from documents.arrays import Floats
from runner.blocks.pair_choice import PairChooser
from tests.stress.how_many import how_many
from tests.stress.test_pooled_pairs_stress import endless, reported

pytestmark = pytest.mark.stress
STOPS = (5, 10, 30)


def _studies(count: int, spread: float, studies: int, *, chosen: bool) -> Floats:
    """Return coverage of all differences and learnt σ after 5, 10 and 30 answers an item, shape (studies, 3, 2)."""
    rows = np.zeros((studies, len(STOPS), 2))
    first, second = np.triu_indices(count, 1)
    for study in range(studies):
        rng = np.random.default_rng([count, round(10 * spread), study])
        theta = rng.normal(0, spread, count)
        chooser, done = PairChooser(count, count // 2, random.Random(study)), 0
        while done < count * STOPS[-1] // 2:
            pairs = chooser.next_batch(count) if chosen else rng.permutation(count).reshape(-1, 2).tolist()
            for i, j in pairs:
                chooser.learn(i, j, first_share=float(rng.random() < 1 / (1 + np.exp(theta[j] - theta[i]))))
                done += 1
                if 2 * done in [count * stop for stop in STOPS]:
                    found = learnt_posterior(chooser.wins)
                    mean, variance = (part[first, second] for part in found.contrasts())
                    off = np.abs(mean - theta[first] + theta[second])
                    at = study, [count * stop for stop in STOPS].index(2 * done)
                    rows[at] = (off < 1.96 * np.sqrt(variance)).mean(), found.prior_sd
    return rows


@pytest.mark.parametrize("chosen", [False, True])
@pytest.mark.parametrize(("count", "studies"), [(10, how_many(60, 100)), (20, how_many(30, 60)), (60, how_many(8, 24))])
@pytest.mark.parametrize("spread", [0.5, 1.0, 2.0, 3.0])
def test_intervals_of_differences_contain_the_truth(count: int, studies: int, spread: float, chosen: bool) -> None:
    """93 to 97 % within two standard errors; more where so few answers leave σ unknown and it is small."""
    rows = _studies(count, spread, studies, chosen=chosen)
    coverage, error = rows[:, :, 0].mean(axis=0), rows[:, :, 0].std(axis=0, ddof=1) / np.sqrt(studies)
    print(f"{count} items, sd {spread}, chosen {chosen}: coverage {coverage.round(3)} ± {error.round(3)}", end=" ")
    print(f"median σ {np.median(rows[:, :, 1], axis=0).round(2)}, least {rows[:, :, 1].min(axis=0).round(2)}")
    assert (coverage + 2 * error > 0.93).all()
    few = (spread == 0.5) & (np.array(STOPS) < 30)
    assert (coverage - 2 * error < np.where(few, 1.0, 0.97)).all()
    assert rows[:, :, 1].min() > spread / 10


@pytest.mark.parametrize("times", [1e-3, 1.0, 1e3, 1e6, 1e9])
def test_counts_of_any_size_leave_everything_finite(times: float) -> None:
    rng = np.random.default_rng(3)
    for wins in (np.triu(np.ones((12, 12)), 1), rng.integers(0, 4, (12, 12)) * (1 - np.eye(12))):
        found = learnt_posterior(times * wins)
        assert found.converged
        assert np.isfinite(found.theta).all()
        assert np.isfinite(found.covariance).all()
        assert np.linalg.eigvalsh(found.covariance)[1:].min() > 0
        limits = found.log10_score_limits()
        assert (limits[:, 0] < limits[:, 1]).all()


def test_three_hundred_items_take_seconds() -> None:
    rng = np.random.default_rng(4)
    theta = rng.normal(0, 2, 300)
    wins = np.zeros((300, 300))
    for _ in range(3000):
        i, j = rng.choice(300, 2, replace=False)
        wins[(i, j) if rng.random() < 1 / (1 + np.exp(theta[j] - theta[i])) else (j, i)] += 1
    start_s = time.process_time()
    found = learnt_posterior(wins)
    print(f"{time.process_time() - start_s:.1f} s, σ {found.prior_sd:.2f}")
    assert found.prior_sd == pytest.approx(theta.std(), rel=0.15)
    assert time.process_time() - start_s < 30


@pytest.mark.parametrize(("observers", "between"), [(10, 0.0), (5, 0.7), (10, 0.7), (5, 0.0)][: how_many(3, 4)])
def test_observers_who_differ_are_in_the_report_and_not_in_the_posterior(observers: int, between: float) -> None:
    """As docs/blocks.md states: 20 items, ten answers an item and observer, pairs chosen for each alone."""
    first, second = np.triu_indices(20, 1)
    of_model, of_report = [], []
    for study in range(25):
        rng = np.random.default_rng([observers, study])
        theta = rng.normal(0, 2, 20)
        wins = np.zeros((observers, 20, 20))
        for observer in range(observers):
            own = theta + rng.normal(0, between, 20)
            chooser, done = PairChooser(20, 10, random.Random(100 * study + observer)), 0
            while done < 100:
                pairs = chooser.next_batch(100 - done)
                for i, j in pairs:
                    won = rng.random() < 1 / (1 + np.exp(own[j] - own[i]))
                    chooser.learn(i, j, first_share=float(won))
                done += len(pairs)
            wins[observer] = chooser.wins
        pooled = wins.sum(axis=0)
        usual = endless(pooled, theta, between)
        found, half = reported(wins)
        model = 1.96 * np.sqrt(learnt_posterior(pooled).contrasts()[1])
        off = np.abs((found - usual)[first] - (found - usual)[second])
        of_model.append((off < model[first, second]).mean())
        of_report.append((off < half[first, second]).mean())
    means = float(np.mean(of_model)), float(np.mean(of_report))
    print(f"{observers} observers, {between} nats between them: model {means[0]:.3f}, report {means[1]:.3f}")
    assert 0.9 < means[1] < 0.985
    assert means[0] > 0.92 if between == 0 else means[0] < means[1] - 0.02
