"""Observers as a distribution, against direct optimisation of the likelihood integrated by Gauss and Hermite."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import minimize

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.hierarchical import fit_observers, observer_spread, spread
from analysis.hierarchical.fitting import _answers
from analysis.hierarchical.propagation import alike, propagate
from analysis.scaling import LAWS, Model, fit_model
from documents import threads
from documents.arrays import Floats
from tests.choice import nightly

Maker = Callable[..., Comparisons]

PAIRS = np.triu_indices(3, 1)
TINY = np.finfo(np.float64).tiny


# Effects sum to zero: they are in a plane, of which these are two directions at right angles.
PLANE = np.array([[1, -1, 0], [1, 1, -2]]) / np.sqrt([[2], [6]])


def integrated(comparisons: Comparisons, model: Model, theta: Floats, tau: float, points: int = 60) -> float:
    """Return the log marginal likelihood of three items: a sum over a grid of effects, for each observer."""
    z, weight = np.polynomial.hermite_e.hermegauss(points)
    own = theta + tau * np.stack(np.meshgrid(z, z), axis=-1).reshape(-1, 2) @ PLANE
    weights = np.outer(weight, weight).ravel() / weight.sum() ** 2
    p, q, _ = LAWS[model].probabilities(own[:, PAIRS[0]] - own[:, PAIRS[1]], 0.0)
    won = comparisons.wins_by_observer()
    ahead, behind = won[:, PAIRS[0], PAIRS[1]], won[:, PAIRS[1], PAIRS[0]]
    log_p = ahead @ np.log(np.maximum(p, TINY)).T + behind @ np.log(np.maximum(q, TINY)).T
    most = log_p.max(axis=1)
    return float((most + np.log(np.exp(log_p - most[:, None]) @ weights)).sum())


def direct(comparisons: Comparisons, model: Model, tau: float) -> tuple[Floats, float]:
    """Return the strengths of highest integrated likelihood at τ, and ℓ with the information there by differences."""

    def cost(free: Floats) -> float:
        return -integrated(comparisons, model, np.append(free, -free.sum()), tau)

    best = minimize(cost, np.zeros(2), method="BFGS", options={"gtol": 1e-6}).x
    step = 1e-3 * np.eye(2)
    curvature = np.array(
        [[sum(s * t * cost(best + s * a + t * b) for s in (1, -1) for t in (1, -1)) / 4e-6 for b in step] for a in step]
    )
    flat = spread.flattening(LAWS[model], tau)
    return np.append(best, -best.sum()), -cost(best) - float(np.linalg.slogdet(curvature)[1]) / 2 + 2 * np.log(flat)


@pytest.mark.parametrize("model", ["bradley-terry", *nightly("thurstone")])
def test_strengths_likelihood_and_its_slope_are_those_of_the_integral(make: Maker, model: Model) -> None:
    comparisons = make(np.array([0.6, 0.1, -0.7]), 8, 0.8, model=model, repeats=6)
    law = LAWS[model]
    answers, _ = _answers(comparisons)
    start = alike(answers, law, fit_model(comparisons, model).theta)
    for tau in (0.2, 0.8):
        sites = propagate(answers, law, tau, start, 1e-9)
        theta, _ = direct(comparisons, model, tau)
        assert sites.converged
        np.testing.assert_allclose(sites.theta, theta, atol=2e-3)
        exact = integrated(comparisons, model, sites.theta, tau)
        assert sites.log_z == pytest.approx(exact, abs=0.02)
        slope = (
            integrated(comparisons, model, theta, tau + 0.01) - integrated(comparisons, model, theta, tau - 0.01)
        ) / 0.02
        assert sites.log_z_slope == pytest.approx(slope, abs=0.05)


@pytest.mark.parametrize("model", ["thurstone", *nightly("bradley-terry")])
def test_the_spread_is_at_the_maximum_of_the_adjusted_integral(make: Maker, model: Model) -> None:
    comparisons = make(np.array([0.6, 0.1, -0.7]), 12, 1.0, model=model, repeats=12)
    estimate = observer_spread(comparisons, model)
    assert estimate.high is not None
    places = (estimate.low, estimate.estimate, estimate.high)
    low, top, high = (direct(comparisons, model, tau)[1] for tau in places)
    assert [top - low, top - high] == pytest.approx([1.92, 1.92], abs=0.06)
    before, after = (direct(comparisons, model, estimate.estimate + step)[1] for step in (-0.1, 0.1))
    vertex = 0.05 * (before - after) / (before - 2 * top + after)
    assert abs(vertex) < 0.02


def test_observers_alike_give_the_plain_fit(make: Maker) -> None:
    comparisons = make(np.linspace(-1, 1, 6), 10, 0.0, repeats=4, seed=6)
    fit, plain = fit_observers(comparisons), fit_model(comparisons, covariance="model")
    assert (fit.spread.estimate, fit.spread.low, fit.spread.p, fit.df) == (0, 0, 1, 45)
    np.testing.assert_allclose(fit.groups[0].theta, plain.theta)
    assert (fit.groups[0].se >= plain.se - 1e-12).all()  # what τ could be is added
    assert fit.observer_scores().sd.max() <= fit.groups[0].se.max() + 1e-12
    assert fit.predict("item 5", "item 0").share is None


def test_population_spread_and_each_observer_are_found_again(make: Maker) -> None:
    theta = np.linspace(-1.2, 1.2, 8)
    comparisons = make(theta, 60, 0.9, repeats=2, seed=4)
    fit = fit_observers(comparisons)
    of = fit.groups[0]
    assert fit.converged
    assert fit.spread.low < 0.9 < (fit.spread.high or 0)
    assert fit.spread.p < 1e-10
    assert (np.abs(of.theta - theta) < 3.5 * of.se).all()
    # The plain fit's are of the average answer, and nearer to each other.
    assert np.ptp(of.plain_theta) < 0.93 * np.ptp(of.theta)
    random = np.random.default_rng(4)
    own = theta + random.normal(0, 0.9, (1, 60, 8))[0]
    scores = fit.observer_scores()
    errors = (scores.mean - (own - own.mean(axis=1, keepdims=True))) / scores.sd
    assert np.sqrt((errors**2).mean()) == pytest.approx(1, abs=0.1)


def test_a_new_observer_is_what_the_average_over_observers_says(make: Maker) -> None:
    fit = fit_observers(make(np.linspace(-1, 1, 5), 30, 1.0, seed=3))
    new = fit.predict("item 4", "item 0")
    effects = np.random.default_rng(1).normal(0, np.sqrt(2) * fit.spread.estimate, 400_000)
    chances = 1 / (1 + np.exp(-new.difference - effects))
    assert new.chance == pytest.approx(chances.mean(), abs=2e-3)
    assert new.share == pytest.approx((chances > 0.5).mean(), abs=3e-3)
    low, high = np.quantile(chances, [0.025, 0.975])
    assert new.lowest < low < new.chance_low < new.chance < new.chance_high < high < new.highest
    assert new.low < new.difference < new.high
    turned = fit.predict("item 0", "item 4")
    assert turned.chance == pytest.approx(1 - new.chance)
    assert turned.chance_low == pytest.approx(1 - new.chance_high)
    pairs = fit.predictions()
    assert len(pairs) == 10
    assert all(pair.difference >= 0 for pair in pairs)


def test_groups_have_scales_of_their_own_and_one_spread(make: Maker) -> None:
    comparisons = make(np.linspace(-1, 1, 5), 12, 0.8, groups=3, seed=6)
    fit = fit_observers(comparisons)
    assert [of.name for of in fit.groups] == ["group 0", "group 1", "group 2"]
    single = [fit_observers(make(np.linspace(-1, 1, 5), 12, 0.8, groups=3, seed=6)).groups[0].theta]
    np.testing.assert_array_equal(fit.groups[0].theta, single[0])
    assert fit.spread.low < 0.8 < (fit.spread.high or 0)
    with pytest.raises(ResultsError, match="name the group"):
        fit.predict("item 0", "item 1")
    assert fit.predict("item 0", "item 1", "group 2").first == "item 0"
    values = fit.to_json()
    assert [len(group["observers"]) for group in values["groups"]] == [12, 12, 12]


@pytest.mark.nightly
def test_many_answers_are_fitted_by_newton_as_by_the_grid(make: Maker, monkeypatch: pytest.MonkeyPatch) -> None:
    comparisons = make(np.linspace(-1, 1, 8), 300, 0.8, groups=2, seed=8)
    slow = fit_observers(comparisons)
    monkeypatch.setattr(spread, "MANY_PAIRS", 5_000)
    monkeypatch.setattr(spread, "FEW_PAIRS", 3_000)
    fast = fit_observers(comparisons)
    assert fast.sweeps < 0.6 * slow.sweeps
    error = (slow.spread.estimate - slow.spread.low) / 1.96
    assert fast.spread.estimate == pytest.approx(slow.spread.estimate, abs=0.05 * error)
    assert [fast.spread.low, fast.spread.high] == pytest.approx([slow.spread.low, slow.spread.high], abs=0.2 * error)
    np.testing.assert_allclose(fast.groups[1].theta, slow.groups[1].theta, atol=0.01 * float(slow.groups[1].se.min()))
    np.testing.assert_allclose(fast.groups[1].se, slow.groups[1].se, rtol=0.01)


def test_the_number_of_workers_changes_no_number(make: Maker, monkeypatch: pytest.MonkeyPatch) -> None:
    comparisons = make(np.linspace(-1, 1, 8), 100, 0.8, groups=3, seed=8)
    monkeypatch.setattr(spread, "MANY_PAIRS", 5_000)
    monkeypatch.setattr(spread, "FEW_PAIRS", 3_000)
    values = []
    for workers in (1, 3):
        monkeypatch.setattr(threads, "cores", lambda workers=workers: workers)
        fit = fit_observers(comparisons)
        values.append((fit.spread, fit.log_likelihood, [[of.theta.tolist(), of.se.tolist()] for of in fit.groups]))
    assert values[0] == values[1]


def test_what_cannot_be_fitted_is_refused_with_a_remedy() -> None:
    def chain(observer: str) -> list[Answer]:
        return [Answer(a, b, count, observer) for a, b in pairwise("abcd") for a, b, count in ((a, b, 2), (b, a, 1))]

    with pytest.raises(ResultsError, match=r"no observer is named.*column 'observer'"):
        fit_observers(from_answers(chain("")))
    with pytest.raises(ResultsError, match="all answers are of one observer, 'anna'"):
        fit_observers(from_answers(chain("anna")))
    with pytest.raises(ResultsError, match="some answers name no observer"):
        fit_observers(from_answers(chain("anna") + chain("")))
    with pytest.raises(ResultsError, match="'davidson' has no distribution"):
        fit_observers(from_answers(chain("anna") + chain("ben")), "davidson")
    with pytest.raises(ResultsError, match="never compared"):
        fit_observers(
            from_answers([*chain("anna"), *chain("ben"), Answer("x", "y", 2, "anna"), Answer("y", "x", 2, "ben")])
        )
    with pytest.raises(ResultsError, match=r"'best': never lost.*--method map"):
        fit_observers(from_answers([*chain("anna"), *chain("ben"), Answer("best", "a", 3, "anna")]))
    apart = [Answer(*(pair if o % 2 else pair[::-1]), 30, str(o)) for o in range(10) for pair in pairwise("abcd")]
    with pytest.raises(ResultsError, match=r"no upper limit.*without '--observers random'"):
        fit_observers(from_answers(apart))
