"""Strengths under a Gaussian prior: the mode against a plain maximiser, finite for any answers, σ learnt."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import minimize

from analysis.scaling.fitting import fit
from analysis.scaling.learnt_prior import learnt_posterior, posterior

Floats = NDArray[np.float64]


def _wins(count: int, seed: int, most: int = 5) -> Floats:
    wins = np.random.default_rng(seed).integers(0, most, (count, count)).astype(float)
    np.fill_diagonal(wins, 0)
    return wins


@pytest.mark.parametrize("prior_sd", [0.3, 1.0, 4.0])
def test_the_mode_is_what_a_plain_maximiser_finds(prior_sd: float) -> None:
    wins = _wins(6, 1)

    def loss(theta: Floats) -> float:
        difference = theta[:, None] - theta[None, :]
        return float((wins * np.logaddexp(0, -difference)).sum() + (theta**2).sum() / (2 * prior_sd**2))

    found = posterior(wins, prior_sd)
    assert found.converged
    slow = minimize(loss, np.zeros(6), method="BFGS", options={"gtol": 1e-9}).x
    assert np.abs(found.theta - slow).max() < 1e-6
    step = 1e-4
    units = np.eye(6) * step
    around = [[loss(found.theta + a + b) - loss(found.theta + a - b) for b in units] for a in units]
    below = [[loss(found.theta - a + b) - loss(found.theta - a - b) for b in units] for a in units]
    hessian = (np.array(around) - np.array(below)) / (4 * step**2)
    # The information of the mean strength, 1/σ² a strength, is left out.
    assert np.abs(found.covariance @ hessian - (np.eye(6) - 1 / 6)).max() < 1e-4


def test_a_wide_prior_says_nothing() -> None:
    wins = _wins(8, 2, most=20)
    found = posterior(wins, 1e3).theta
    assert np.abs(found - found.mean() - fit(wins).theta).max() < 1e-6


def test_without_answers_the_prior_is_what_is_left() -> None:
    found = posterior(np.zeros((4, 4)), 1.5)
    assert not found.theta.any()
    assert np.allclose(found.covariance, 1.5**2 * (np.eye(4) - 1 / 4))
    mean, variance = found.contrasts()
    assert not mean.any()
    assert np.allclose(variance, 2 * 1.5**2 * (1 - np.eye(4)))


@settings(max_examples=40, deadline=None)
@given(st.integers(2, 12), st.integers(0, 2**32), st.sampled_from([0.0, 0.1, 1.0]), st.sampled_from([1.0, 1e6]))
def test_any_answers_give_finite_strengths(count: int, seed: int, share: float, times: float) -> None:
    """None at all, few, or all of them one-sided: the lower number always wins."""
    rng = np.random.default_rng(seed)
    wins = np.triu(np.where(rng.random((count, count)) < share, times, 0.0), 1).astype(np.float64)
    found = learnt_posterior(wins)
    assert np.isfinite(found.theta).all()
    assert np.linalg.eigvalsh(found.covariance)[1:].min() > 0
    assert np.abs(found.covariance.sum(axis=0)).max() <= 1e-9 * np.abs(found.covariance).max()
    assert 0 < found.prior_sd <= 10
    if share == 1:
        assert (np.diff(found.theta) < 0).all()


@pytest.mark.parametrize("spread", [0.5, 1.0, 3.0])
def test_the_spread_of_the_strengths_is_learnt(spread: float) -> None:
    rng = np.random.default_rng(5)
    theta = rng.normal(0, spread, 60)
    p = 1 / (1 + np.exp(theta[None, :] - theta[:, None]))
    upper = np.triu(rng.binomial(20, p), 1)
    wins = (upper + np.tril(20 - upper.T, -1)).astype(np.float64)
    found = learnt_posterior(wins)
    assert found.converged
    assert found.prior_sd == pytest.approx(theta.std(), rel=0.15)


def test_beginning_elsewhere_ends_in_the_same_place() -> None:
    wins = _wins(7, 3)
    before = learnt_posterior(_wins(7, 4, most=30))
    assert np.abs(learnt_posterior(wins, before).theta - learnt_posterior(wins).theta).max() < 1e-3
