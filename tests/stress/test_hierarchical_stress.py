"""Observers as a distribution: against a sampler, over many studies, and on awkward tables."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from analysis.comparisons import Answer, from_answers
from analysis.hierarchical import fit_observers
from analysis.hierarchical.fitting import _answers
from analysis.hierarchical.spread import Profile, _explore, _interpolated, _weights, flattening
from analysis.scaling import LOGISTIC, fit_model
from benchmarks.hierarchical import comparisons_of, simulated, spreads
from documents.arrays import Floats

pytestmark = pytest.mark.stress


def hamiltonian(
    target: Callable[[Floats], tuple[Floats, Floats]], start: Floats, step: float, steps: int, draws: int
) -> Floats:
    """Sample by Hamiltonian Monte Carlo [Neal2011], chains side by side; the first third is left out.

    ``target`` gives log density (chains,) and gradient (chains, d); ``start`` has the shape (chains, d).
    """
    random = np.random.default_rng(1)
    state, (height, slope) = start.copy(), target(start)
    kept = []
    for draw in range(draws):
        momentum = random.normal(size=state.shape)
        length = step * random.uniform(0.7, 1.3)
        new, new_slope, speed = state, slope, momentum
        for _ in range(steps):
            speed = speed + length / 2 * new_slope
            new = new + length * speed
            new_height, new_slope = target(new)
            speed = speed + length / 2 * new_slope
        gained = new_height - height - ((speed**2).sum(axis=1) - (momentum**2).sum(axis=1)) / 2
        taken = np.log(random.random(len(state))) < gained
        state = np.where(taken[:, None], new, state)
        height, slope = np.where(taken, new_height, height), np.where(taken[:, None], new_slope, slope)
        if draw >= draws // 3:
            kept.append(state)
    return np.concatenate(kept)


def test_spread_strengths_and_effects_are_those_of_a_sampler() -> None:
    """The posterior with τ and a(τ) θ flat before: its moments are those of the nodes of the profile."""
    items, people, chains = 6, 12, 64
    won = simulated(people, 0.9, np.random.default_rng(12), items)
    comparisons = comparisons_of(won, items)
    i, j = np.triu_indices(items, 1)
    grid = np.linspace(0, 8, 400)
    log_flat = np.log([flattening(LOGISTIC, tau) for tau in grid])
    slope_of_flat = np.gradient(log_flat, grid)

    def target(state: Floats) -> tuple[Floats, Floats]:
        theta, z, log_tau = state[:, :items], state[:, items:-1].reshape(-1, people, items), state[:, -1]
        tau = np.exp(np.minimum(log_tau, 3))
        own = theta[:, None] + tau[:, None, None] * z
        d = own[..., i] - own[..., j]
        height = (won * d - np.logaddexp(0, d)).sum(axis=(1, 2)) - (z**2).sum(axis=(1, 2)) / 2
        # θ sums to zero nearly; log τ gives its Jacobian.
        height += -(theta.sum(axis=1) ** 2) / 2 + (items - 1) * np.interp(tau, grid, log_flat) + log_tau
        rest = won - 1 / (1 + np.exp(-d))
        by_own = np.zeros_like(own)
        for pair, (a, b) in enumerate(zip(i, j, strict=True)):
            by_own[..., a] += rest[..., pair]
            by_own[..., b] -= rest[..., pair]
        by_theta = by_own.sum(axis=1) - theta.sum(axis=1, keepdims=True)
        by_z = tau[:, None, None] * by_own - z
        by_tau = (by_own * z).sum(axis=(1, 2)) * tau + (items - 1) * np.interp(tau, grid, slope_of_flat) * tau + 1
        return height, np.concatenate([by_theta, by_z.reshape(len(state), -1), by_tau[:, None]], axis=1)

    start = np.random.default_rng(2).normal(0, 0.1, (chains, items + people * items + 1))
    drawn = hamiltonian(target, start, 0.11, 14, 1200)
    taus = np.exp(drawn[:, -1])

    answers, _ = _answers(comparisons)
    profile = Profile([answers], LOGISTIC, [fit_model(comparisons).theta])
    _explore(profile)
    tau, height = _interpolated(profile.nodes)
    mass = np.exp(height - height.max())
    mass /= mass.sum()
    mean, sd = mass @ tau, np.sqrt(mass @ tau**2 - (mass @ tau) ** 2)
    assert taus.mean() == pytest.approx(mean, abs=0.06 * sd + 0.01)
    assert taus.std() == pytest.approx(sd, rel=0.07)

    weights = _weights(tau, height, profile.nodes)
    thetas = np.stack([node.theta[0] for node in profile.nodes])
    covariances = np.stack([node.covariance[0] for node in profile.nodes])
    expected = weights @ thetas
    spread = np.tensordot(weights, covariances, 1) + (thetas - expected).T * weights @ (thetas - expected)
    sampled = drawn[:, :items] - drawn[:, :items].mean(axis=1, keepdims=True)
    assert np.abs(sampled.mean(axis=0) - expected).max() < 0.08 * np.sqrt(np.diag(spread)).min()
    np.testing.assert_allclose(sampled.std(axis=0), np.sqrt(np.diag(spread)), rtol=0.06)

    fit = fit_observers(comparisons)
    own = (
        drawn[:, :items, None] + taus[:, None, None] * drawn[:, items:-1].reshape(-1, people, items).transpose(0, 2, 1)
    ).transpose(0, 2, 1)
    own -= own.mean(axis=2, keepdims=True)
    scores = fit.observer_scores()
    # At the one τ of the fit: somewhat nearer to the population, and surer, than on average over τ.
    assert np.abs(scores.mean - own.mean(axis=0)).max() < 0.35 * own.std(axis=0).min()
    assert np.median(scores.sd / own.std(axis=0)) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("sd", [0.0, 0.7, 1.5])
@pytest.mark.parametrize("observers", [5, 10, 30])
def test_spread_and_coverage_over_studies(observers: int, sd: float) -> None:
    """The median of τ is within a tenth of the truth; intervals and the test are at their level within what 100 say."""
    (row, *_) = spreads(sd, observers, 100)
    numbers = dict(zip(("mean", "median", "tau", "differences", "differ"), _numbers(str(row["note"])), strict=False))
    if sd:
        assert numbers["median"] == pytest.approx(sd, rel=0.12)
        assert numbers["tau"] >= 87
    else:
        assert numbers["differ"] <= 11
    assert 91 <= numbers["differences"] <= 98.5


def _numbers(note: str) -> list[float]:
    import re

    found = re.findall(
        r"mean ([\d.]+), median ([\d.]+).*truth in ([\d.]+) %.*strengths in ([\d.]+) %.*0.05\) in ([\d.]+)", note
    )
    return [float(number) for number in found[0]]


def test_counts_of_every_size_and_observers_of_few_pairs() -> None:
    """A thousand answers to one pair by one observer beside single answers of others; each fit settles."""
    for seed in range(20):
        random = np.random.default_rng(seed)
        own = np.linspace(-1, 1, 7) + random.normal(0, 0.8, (15, 7))
        answers = []
        for observer in range(15):
            for _ in range(int(random.integers(3, 20))):
                a, b = random.choice(7, 2, replace=False).tolist()
                count = 10 ** random.uniform(0, 3)
                p = 1 / (1 + np.exp(own[observer, b] - own[observer, a]))
                answers += [
                    Answer(f"{a}", f"{b}", count * p, f"{observer}"),
                    Answer(f"{b}", f"{a}", count * (1 - p), f"{observer}"),
                ]
        fit = fit_observers(from_answers(answers))
        assert fit.converged, seed
        assert fit.spread.low < 1.6, seed
        assert fit.spread.high is None or fit.spread.high > 0.4, seed
        assert np.isfinite(fit.observer_scores().sd).all()
