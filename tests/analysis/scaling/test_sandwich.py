"""The sandwich covariance against its definition, and where it must agree with the model's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from analysis.comparisons import Comparisons
from analysis.covariance import shrink
from analysis.covariance.shrinkage import pseudo_inverses
from analysis.scaling import Model, Probit, fit_model
from analysis.scaling.laws import Davidson, Logistic
from analysis.scaling.sandwich import FEWEST_FREE, MOST_LEVERAGE, Contributions

Drawer = Callable[..., Comparisons]
THETA = np.array([0.7, 0.0, -0.3, -0.4])


@pytest.mark.parametrize(
    ("law", "model"), [(Logistic(), "bradley-terry"), (Davidson(), "davidson"), (Probit(), "thurstone")]
)
def test_it_is_a_sum_over_observers(draw: Drawer, law: Logistic | Davidson | Probit, model: Model) -> None:
    """Each observer's gradient and information by finite differences of their own likelihood, answer by answer."""
    comparisons = draw(law, THETA, k=-0.3, order=0.2, observers=5)
    fitted = fit_model(comparisons, model, order_effect=True, covariance="model")
    robust = fit_model(comparisons, model, order_effect=True, covariance="sandwich")
    at = np.r_[fitted.theta, [parameter.estimate for parameter in fitted.parameters]]

    def own(values: np.ndarray, observer: int) -> float:
        theta, k, order = values[:4], values[4] if model == "davidson" else 0.0, values[-1]
        total = 0.0
        tied = comparisons.tied
        sources = [(comparisons.winner, comparisons.loser, comparisons.observer, comparisons.winner_was_first, 0)]
        sources += [(tied.item_a, tied.item_b, tied.observer, tied.a_was_first, 2)] if model == "davidson" else []
        for ones, others, people, firsts, outcome in sources:
            for one, other, person, first in zip(ones, others, people, firsts, strict=True):
                if person == observer:
                    d = np.array([theta[one] - theta[other] + (order if first else -order)])
                    total += float(np.log(law.probabilities(d, k)[outcome][0]))
        return total

    values, vectors = np.linalg.eigh(fitted.joint_covariance)
    root = vectors[:, 1:] * np.sqrt(values[1:])
    expected = np.zeros((len(at), len(at)))
    for observer in range(5):
        steps = np.eye(len(at)) * 1e-4

        def slope(values: np.ndarray, observer: int = observer, steps: np.ndarray = steps) -> np.ndarray:
            return np.array([(own(values + step, observer) - own(values - step, observer)) / 2e-4 for step in steps])

        information = -np.array([(slope(at + step) - slope(at - step)) / 2e-4 for step in steps])
        shares, axes = np.linalg.eigh(root.T @ (information + information.T) / 2 @ root)
        moved = root @ (axes / np.sqrt(1 - shares)) @ axes.T @ root.T @ slope(at)
        expected += np.outer(moved, moved)
    assert robust.joint_covariance == pytest.approx(expected, rel=1e-4, abs=1e-6)
    assert robust.theta == pytest.approx(fitted.theta, abs=1e-13)


def test_weights_all_multiplied_change_nothing(draw: Drawer) -> None:
    comparisons = draw(Logistic(), THETA, observers=8)
    heavier = replace(comparisons, count=comparisons.count * 7)
    once, more = (fit_model(source, covariance="sandwich") for source in (comparisons, heavier))
    assert more.se == pytest.approx(once.se, rel=1e-9)
    assert fit_model(heavier, covariance="model").se == pytest.approx(
        fit_model(comparisons, covariance="model").se / np.sqrt(7), rel=1e-9
    )


def test_observers_who_repeat_themselves_widen_it(draw: Drawer) -> None:
    """Answers given four times over are no new evidence: the model halves its errors, the sandwich keeps them."""
    comparisons = draw(Logistic(), THETA, observers=40)
    copied = replace(comparisons, count=comparisons.count * 4)
    ratio = fit_model(copied, covariance="sandwich").se / fit_model(copied, covariance="model").se
    assert (ratio > 1.6).all()


@pytest.mark.parametrize(("people", "rank"), [(3, 5), (6, 6), (40, 3), (2, 1)])
def test_degrees_of_freedom_are_those_of_every_two_observers(people: int, rank: int) -> None:
    """Written out: P_st = k_s 1(s = t) u K_s/(1 − K_s) u − u K_s (1 − K_s)^(−1/2) K_t (1 − K_t)^(−1/2) u."""
    rng = np.random.default_rng(people)
    factors = rng.normal(size=(people, rank, rank))
    leverages = factors @ factors.transpose(0, 2, 1)
    values, vectors = np.linalg.eigh(leverages.sum(axis=0))
    half = vectors / np.sqrt(values) @ vectors.T
    leverages = half @ leverages @ half
    root = rng.normal(size=(rank + 1, rank))
    found = Contributions(np.zeros((people, rank + 1)), None, root, leverages, np.full(people, 1 / people))
    rows = rng.normal(size=(5, rank + 1))
    expected = []
    for u in rows @ root:
        together = np.zeros((people, people))
        moved, own = [], []
        for one in leverages:
            shares, axes = np.linalg.eigh(one)
            shares = np.clip(shares, 0, MOST_LEVERAGE)
            moved.append(axes @ np.diag(shares / np.sqrt(1 - shares)) @ axes.T @ u)
            own.append(u @ axes @ np.diag(shares / (1 - shares)) @ axes.T @ u)
        for s in range(people):
            for t in range(people):
                together[s, t] = (own[s] if s == t else 0) - moved[s] @ moved[t]
        expected.append(max(np.trace(together) ** 2 / (together**2).sum(), FEWEST_FREE))
    np.testing.assert_allclose(found.degrees_of_freedom(lambda: rows, len(rows)), expected, rtol=1e-10)


@pytest.mark.parametrize("alike", [True, False], ids=["one design", "leverages"])
@pytest.mark.parametrize("observers", [3, 40], ids=["fewer than items", "more than items"])
def test_what_is_kept_of_the_observers_products_gives_the_spread_that_all_of_them_give(
    draw: Drawer, observers: int, *, alike: bool
) -> None:
    """The slow, obvious twin has every two observers' d_s H d_t; of many observers none of that size is made."""
    whole = draw(Logistic(), THETA, observers=observers, seed=4)
    count = whole.count if alike else whole.count * np.random.default_rng(4).integers(1, 3, len(whole.count))
    clustered = fit_model(replace(whole, count=count)).clustered
    assert clustered is not None
    each, spread = clustered.contributions, clustered.spread
    pulled = each.pulled[None]
    every_two = pulled @ pseudo_inverses(spread.model) @ pulled.transpose(0, 2, 1)
    twin = shrink(spread.model, pulled, "shrinkage", freedom=each.freedom, products=every_two)
    assert each.products is not None
    assert len(each.products) <= len(THETA)
    assert (each.leverages is None) == alike
    assert spread.covariance == pytest.approx(twin.covariance, rel=1e-9, abs=1e-12)
    assert spread.dimensions == pytest.approx(twin.dimensions, rel=1e-9)
