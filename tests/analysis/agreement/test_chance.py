"""The permutation test counts all orders, keeps its level for noise, and finds a measure that agrees."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations, product

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.agreement import chance, chance_of_agreement, correlation
from analysis.agreement.chance import least_p

Floats = NDArray[np.float64]


def rank_agreement(scores: Floats, values: Floats) -> Callable[[NDArray[np.intp]], Floats]:
    return lambda orders: correlation(scores[orders], values, "spearman")


def test_all_orders_of_two_groups_are_counted() -> None:
    random = np.random.default_rng(2)
    groups = [(random.normal(size=size), random.normal(size=size)) for size in (3, 4)]
    measured = sum(float(correlation(scores, values, "spearman")) for scores, values in groups)
    sums = [
        sum(
            float(correlation(scores[list(order)], values, "spearman"))
            for (scores, values), order in zip(groups, orders, strict=True)
        )
        for orders in product(permutations(range(3)), permutations(range(4)))
    ]
    expected = np.mean(np.array(sums) >= measured - 1e-9)
    assert chance_of_agreement([3, 4], [rank_agreement(*group) for group in groups]) == pytest.approx(expected)


def test_drawn_orders_give_what_all_orders_give(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(8)
    scores = random.normal(size=6)
    test = rank_agreement(scores, scores + random.normal(0, 1.0, 6))
    exact = chance_of_agreement([6], [test])
    monkeypatch.setattr(chance, "MOST_EXACT", 0)
    # Four standard errors of a share of 9999 draws.
    assert chance_of_agreement([6], [test]) == pytest.approx(exact, abs=4 * np.sqrt(exact * (1 - exact) / 9999))


@pytest.mark.nightly
def test_noise_is_seldom_said_to_agree_and_a_perfect_measure_always() -> None:
    random = np.random.default_rng(3)
    scores = np.array([0.0, 1.0, 1.5, 3.0, 4.0])
    noise = [chance_of_agreement([5], [rank_agreement(scores, random.normal(size=5))]) for _ in range(400)]
    # At most 5 %: above 7.6 % of 400 by luck in 1 of 100 such tests.
    assert np.mean(np.array(noise) <= 0.05) <= 0.076
    assert chance_of_agreement([5], [rank_agreement(scores, scores)]) == pytest.approx(1 / 120)


def test_a_measure_that_is_reversed_does_not_agree() -> None:
    scores = np.arange(6.0)
    assert chance_of_agreement([6], [rank_agreement(scores, -scores)]) == 1


def test_the_least_p() -> None:
    assert least_p([3]) == pytest.approx(1 / 6)
    assert least_p([3, 4]) == pytest.approx(1 / 144)
    # Of draws and the measured order.
    assert least_p([20]) == pytest.approx(1e-4)
    assert least_p([300]) == pytest.approx(1e-3)
