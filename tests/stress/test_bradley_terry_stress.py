"""The solvers at their edges: far strengths, tiny and huge counts, weak links, many items, many replicates."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.sparse import csr_array

from analysis.scaling import fit, probabilities
from analysis.scaling.fitting import fit_batch, fit_sparse
from documents.arrays import Floats

pytestmark = pytest.mark.stress

RANDOM = np.random.default_rng(30)
STRENGTHS = {
    "two items": np.array([0.0, 30.0]),
    "even steps": np.linspace(0, 30, 10),
    "two groups": np.r_[np.zeros(5), np.full(5, 30.0)] + RANDOM.normal(0, 0.5, 10),
    "one far away": np.r_[np.zeros(9), 30.0],
    "a hundred": RANDOM.normal(0, 6, 100),
}


def expected_counts(theta: Floats, count: float) -> Floats:
    wins = count * probabilities(theta)
    np.fill_diagonal(wins, 0)
    return wins


@pytest.mark.parametrize("name", STRENGTHS)
@pytest.mark.parametrize("count", [1e-3, 1.0, 30.0, 1e9])
def test_strengths_thirty_nats_apart_come_back(name: str, count: float) -> None:
    theta = STRENGTHS[name] - STRENGTHS[name].mean()
    fitted = fit(expected_counts(theta, count))
    assert fitted.converged
    assert np.abs(fitted.theta - theta).max() < 1e-10
    assert np.isfinite(fitted.se).all()
    assert fitted.deviance >= 0
    assert fitted.score.sum() == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(("strong", "weak"), list(product([1e3, 1e9], [1e-3, 1.0])))
def test_two_groups_held_by_one_weak_link(strong: float, weak: float) -> None:
    """All within a group are compared often; one pair between the groups is compared rarely."""
    theta = np.array([-1.0, 0.0, 0.5, 2.0, 2.5, 4.0])
    p = probabilities(theta)
    count = np.zeros((6, 6))
    count[:3, :3] = count[3:, 3:] = strong
    count[1, 4] = count[4, 1] = weak
    wins = count * p
    np.fill_diagonal(wins, 0)
    fitted = fit(wins)
    centred = theta - theta.mean()
    assert fitted.converged
    assert np.abs(fitted.theta - centred).max() < 1e-10
    # The gap's error comes from the one pair between the groups, but for what the groups add.
    gap = np.sqrt(fitted.covariance[1, 1] + fitted.covariance[4, 4] - 2 * fitted.covariance[1, 4])
    assert gap == pytest.approx(1 / np.sqrt(weak * p[1, 4] * p[4, 1]), rel=1e-6)


def test_counts_of_every_size_at_once() -> None:
    """Counts are drawn from 1e-3 to 1e9; at the maximum what each item won is what the model expects."""
    for seed in range(200):
        random = np.random.default_rng(seed)
        n = int(random.integers(2, 12))
        wins = 10 ** random.uniform(-3, 9, (n, n))
        np.fill_diagonal(wins, 0)
        fitted = fit(wins)
        assert fitted.converged, seed
        expected = (wins + wins.T) * probabilities(fitted.theta)
        np.fill_diagonal(expected, 0)
        won = wins.sum(axis=1)
        assert np.abs(expected.sum(axis=1) - won).max() <= 1e-13 * wins.sum(), seed


@pytest.mark.parametrize("count", [1e-3, 1.0, 30.0, 1e6])
def test_the_penalised_fit_is_finite_for_a_perfect_order(count: float) -> None:
    """Every better item always wins: nothing could be more separated."""
    for n in (2, 3, 10, 30):
        fitted = fit(count * np.triu(np.ones((n, n)), 1), method="firth")
        assert fitted.converged
        assert np.isfinite(fitted.theta).all()
        assert (np.diff(fitted.theta) < 0).all()
        assert np.abs(fitted.theta + fitted.theta[::-1]).max() < 1e-8


def test_the_penalised_fit_of_two_items_has_its_closed_form() -> None:
    """Firth's prior adds half a win on each side when there is one pair."""
    for won, lost in product([0.0, 1.0, 7.0, 1e6], repeat=2):
        if won + lost:
            fitted = fit(np.array([[0, won], [lost, 0]]), method="firth")
            assert abs(fitted.theta[0] - fitted.theta[1] - np.log((won + 0.5) / (lost + 0.5))) < 1e-9


def test_a_large_batch_is_solved_as_one_by_one() -> None:
    theta = RANDOM.normal(0, 3, 8)
    wins = RANDOM.poisson(expected_counts(theta, 6), (3000, 8, 8)).astype(float)
    batch = fit_batch(wins)
    assert batch.separated.any()
    assert not batch.separated.all()
    assert (batch.converged == ~batch.separated).all()
    for number in range(0, 3000, 7):
        single = fit(wins[number])
        assert bool(single.separated) == bool(batch.separated[number])
        if not single.separated:
            assert np.abs(batch.theta[number] - single.theta).max() < 1e-10


@pytest.mark.parametrize(("n", "chords"), [(300, 0), (300, 300), (3000, 30_000)])
def test_sparse_counts_fulfil_the_likelihood_equations(n: int, chords: int) -> None:
    """Even a bare ring, whose information is as badly conditioned as a connected graph's can be."""
    ring = np.arange(n)
    first, step = RANDOM.integers(n, size=chords), RANDOM.integers(1, n, size=chords)
    rows, columns = np.r_[ring, first], np.r_[(ring + 1) % n, (first + step) % n]
    won, lost = RANDOM.integers(1, 20, len(rows)).astype(float), RANDOM.integers(1, 20, len(rows)).astype(float)
    wins = csr_array((np.r_[won, lost], (np.r_[rows, columns], np.r_[columns, rows])), shape=(n, n))
    fitted = fit_sparse(wins)
    assert fitted.converged.all()
    theta = fitted.theta[0]
    p = 1 / (1 + np.exp(theta[columns] - theta[rows]))
    flow = won * (1 - p) - lost * p
    gradient = np.bincount(rows, flow, n) - np.bincount(columns, flow, n)
    assert np.abs(gradient).max() < 1e-9
