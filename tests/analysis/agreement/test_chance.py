"""The permutation test counts all orders, keeps its level for noise, and finds a measure that agrees."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations, product

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.agreement import chance, chance_of_agreement, correlation
from analysis.agreement.chance import least_p
from documents.arrays import Floats


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


def test_the_least_p() -> None:
    assert least_p([3]) == pytest.approx(1 / 6)
    assert least_p([3, 4]) == pytest.approx(1 / 144)
    # Of draws and the measured order.
    assert least_p([20]) == pytest.approx(1e-4)
    assert least_p([300]) == pytest.approx(1e-3)
