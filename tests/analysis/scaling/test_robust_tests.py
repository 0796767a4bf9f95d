"""Tests with the observer as the unit: their definition, their level where observers differ, and their power."""

from __future__ import annotations

import json
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations, product
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.factors import factor_effects
from analysis.scaling import LAWS, Model, ObserverTest, fit_model, robust_tests, score_groups
from analysis.scaling.lack_of_fit import lack_of_fit, one_scale
from analysis.scaling.robust_tests import (
    DRAWS,
    DRAWS_OF_MANY,
    MOST_FOR_ALL_DRAWS,
    WEBB,
    draws_for,
    from_products,
    score_test,
)
from analysis.series.just_noticeable import observer_test as step_test
from documents.arrays import Floats
from runner.cli.main import group as command
from tests.choice import nightly

Drawer = Callable[..., Comparisons]
# Of 80 studies at the level 0.05, more are false once in 3000 runs.
STUDIES, MOST_FALSE = 80, 11


def simulated(
    random: np.random.Generator,
    observers: int,
    items: int,
    *,
    taste: float = 0.0,
    side: float = 0.0,
    order: float = 0.0,
    intransitive: Floats | None = None,
    repeats: int = 1,
    ties: float = 0.0,
) -> Comparisons:
    """Answers to all pairs in both orders; observers differ by normal tastes and side biases of these sd in nats."""
    answers = []
    for observer in range(observers):
        theta, bias = taste * random.standard_normal(items), order + side * random.standard_normal()
        for first in range(items):
            for second in range(items):
                if first == second:
                    continue
                d = theta[first] - theta[second] + bias
                if intransitive is not None:
                    d += intransitive[first, second]
                for _ in range(repeats):
                    won = random.random() < 1 / (1 + np.exp(-d))
                    pair = (first, second) if won else (second, first)
                    tie = bool(random.random() < ties)
                    answers.append(Answer(f"i{pair[0]}", f"i{pair[1]}", 1.0, f"o{observer}", f"i{first}", tie))
    return from_answers(answers, [f"i{item}" for item in range(items)])


def test_p_is_the_share_of_weights_that_give_as_much() -> None:
    x = np.random.default_rng(3).standard_normal((5, 2)) + 1.6
    tested = from_products(x @ x.T, 2)
    assert tested is not None
    assert tested.statistic == pytest.approx((x.sum(axis=0) ** 2).sum())
    drawn = ((np.array(list(product(WEBB.ravel(), repeat=5))) @ x) ** 2).sum(axis=1)
    exact = (drawn >= tested.statistic).mean()
    assert 0.01 < exact < 0.2
    assert tested.p == pytest.approx(exact, abs=4 * np.sqrt(exact / 10_000))


def test_p_does_not_depend_on_the_order_of_observers_nor_on_units() -> None:
    x = np.random.default_rng(4).standard_normal((8, 3)) + 0.4
    tested, turned = from_products(x @ x.T, 3), from_products(x[::-1] @ x[::-1].T, 3)
    stretched = from_products(49 * (x @ x.T), 3)
    assert tested is not None
    assert turned is not None
    assert stretched is not None
    assert tested.p == turned.p == stretched.p


def test_fewer_than_five_observers_have_no_test() -> None:
    assert from_products(np.eye(4), 2) is None
    assert from_products(np.eye(5), 2) is not None


def test_the_score_statistic_is_that_of_the_restrictions_alone() -> None:
    random = np.random.default_rng(5)
    root = random.standard_normal((4, 4))
    inverse: Floats = np.linalg.inv(root @ root.T + np.eye(4)).astype(np.float64)
    restrictions = random.standard_normal((2, 4))
    slopes = random.standard_normal((9, 4))
    # As at a restricted maximum: the slopes' sum is zero where no restriction keeps the parameters.
    free = np.linalg.svd(restrictions)[2][2:]
    slopes -= (slopes.sum(axis=0) @ free.T @ free) / 9
    tested = score_test(slopes, inverse, restrictions)
    assert tested is not None
    total = slopes.sum(axis=0)
    assert tested.df == 2
    assert tested.statistic == pytest.approx(total @ inverse @ total)
    twice = score_test(slopes, inverse, np.vstack([restrictions, restrictions.sum(axis=0)]))
    assert twice is not None
    assert (twice.df, twice.p) == (2, tested.p)


@pytest.mark.parametrize(("observers", "restrictions"), [(5, 20), (15, 1), (15, 20)])
def test_the_level_is_kept_where_observers_differ_along_few_directions(observers: int, restrictions: int) -> None:
    random = np.random.default_rng(observers + restrictions)
    false = plain = 0
    for _ in range(STUDIES):
        x = random.standard_normal((observers, restrictions)) / np.sqrt(observers)
        x[:, 0] += 3 * random.standard_normal(observers) / np.sqrt(observers)
        tested = from_products(x @ x.T, restrictions)
        assert tested is not None
        false += tested.p <= 0.05
        plain += tested.statistic > {1: 3.841, 20: 31.41}[restrictions]
    assert plain >= 12
    assert false <= MOST_FALSE


@pytest.mark.parametrize("model", ["bradley-terry", "thurstone", "davidson", "rao-kupper"])
@pytest.mark.parametrize("order_effect", [False, True])
def test_the_statistic_of_departure_is_pearsons(model: Model, order_effect: bool) -> None:
    ties = 0.2 if model in ("davidson", "rao-kupper") else 0.0
    comparisons = simulated(np.random.default_rng(6), 7, 4, taste=0.7, ties=ties)
    fitted = fit_model(comparisons, model, order_effect=order_effect)
    tested, goodness = lack_of_fit(comparisons, fitted), fitted.goodness
    assert tested is not None
    assert goodness is not None
    assert tested.statistic == pytest.approx(goodness.pearson, rel=1e-8)
    assert (tested.df, tested.observers) == (goodness.df, 7)


@pytest.mark.nightly
def test_observers_who_differ_show_no_order_effect_and_one_of_all_is_found() -> None:
    random = np.random.default_rng(7)
    false = plain = found = 0
    for _ in range(STUDIES):
        test = fit_model(
            simulated(random, 10, 4, side=0.7, repeats=2), order_effect=True, covariance="model"
        ).order_test
        assert test is not None
        assert test.by_observers is not None
        assert test.conclusion.p == test.by_observers.p
        false, plain = false + (test.conclusion.verdict == "distinguished"), plain + (test.p <= 0.05)
        planted = fit_model(
            simulated(random, 10, 4, side=0.7, order=0.8), order_effect=True, covariance="model"
        ).order_test
        assert planted is not None
        found += planted.conclusion.verdict == "distinguished"
    assert plain >= 16
    assert false <= MOST_FALSE
    assert found >= 56


def test_few_answers_to_each_pair_are_no_departure_from_a_scale_and_circles_are() -> None:
    random = np.random.default_rng(8)
    circle = np.zeros((6, 6))
    circle[[0, 1, 2], [1, 2, 0]], circle[[1, 2, 0], [0, 1, 2]] = 2.2, -2.2
    false = found = 0
    for _ in range(STUDIES):
        even = simulated(random, 6, 6, taste=0.7)
        test = lack_of_fit(even, fit_model(even, covariance="model"))
        round_ = simulated(random, 6, 6, intransitive=circle)
        planted = lack_of_fit(round_, fit_model(round_, covariance="model"))
        assert test is not None
        assert planted is not None
        false, found = false + (test.p <= 0.05), found + (planted.p <= 0.05)
    assert false <= MOST_FALSE
    assert found >= 64


def ranked(orders: list[str], group: str = "") -> list[Answer]:
    """Answers to all pairs by observers who each follow one order of the items, best first."""
    return [
        Answer(pair[0], pair[1], 1.0, f"o{place}", group=group)
        for place, order in enumerate(orders)
        for pair in combinations(order, 2)
    ]


def p_of_one_scale(tmp_path: Path, answers: list[Answer]) -> tuple[float, float | None]:
    """The p values that `scores --method firth --json` gives: plain, and by observers."""
    rows = ["observer,winner,loser", *(f"{one.observer},{one.winner},{one.loser}" for one in answers)]
    (tmp_path / "answers.csv").write_text("\n".join(rows), encoding="utf-8")
    shown = CliRunner().invoke(command, ["scores", str(tmp_path / "answers.csv"), "--method", "firth", "--json"])
    fits = json.loads(shown.stdout)["goodness_of_fit"]
    return fits["p_pearson"], fits["by_observers"] and fits["by_observers"]["p"]


def test_many_observers_have_fewer_draws() -> None:
    assert (draws_for(MOST_FOR_ALL_DRAWS), draws_for(MOST_FOR_ALL_DRAWS + 1)) == (DRAWS, DRAWS_OF_MANY)


def test_an_order_effect_is_tested_by_its_own_slopes_alone(draw: Drawer) -> None:
    """Of four items, each stronger than the next: their strengths are no part of it."""
    none = fit_model(draw(LAWS["bradley-terry"], np.array([1.5, 0.5, -0.5, -1.5]), observers=30), order_effect=True)
    assert none.order_test is not None
    assert none.order_test.by_observers is not None
    assert (none.order_test.by_observers.df, none.order_test.by_observers.p > 0.01) == (1, True)


def test_without_observers_answers_are_the_unit_and_a_prior_has_no_test(pudding: Comparisons) -> None:
    told = one_scale(pudding, fit_model(pudding))
    assert told is not None
    assert (told.by_observers, told.df) == (False, fit_model(pudding).df)
    assert one_scale(pudding, fit_model(pudding, method="map")) is None


@pytest.mark.parametrize("orders", [["abcde"] * 10, ["abcde"] * 9 + ["bacde"], ["abcde"] * 8 + ["bacde", "abdce"]])
def test_rankings_that_a_penalty_keeps_finite_are_not_rejected(tmp_path: Path, orders: list[str]) -> None:
    plain, own = p_of_one_scale(tmp_path, ranked(orders))
    assert plain > 0.5
    assert own is None or own >= plain


def test_circles_beside_an_item_that_always_wins_are_found(tmp_path: Path) -> None:
    circles = [
        Answer(pair[0], pair[1], 1.0, f"{one}") for one in range(12) for pair in ("ab", "bc", "ca", "zc", "za", "zb")
    ]
    circles += [Answer("c", "b", 1.0, "x"), Answer("b", "a", 1.0, "x")]
    plain, own = p_of_one_scale(tmp_path, circles)
    assert max(plain, own or 0.0) < 0.01


@pytest.mark.parametrize(
    "sets", [("abcd", "abd", "abd"), ("abcdefg", "cdeg"), *nightly((("abcd", "abd"),), (("abcdefg", "acdg"),))]
)
@pytest.mark.parametrize("people", [14, *nightly(15)])
@pytest.mark.parametrize("swapped", [False, True])
def test_groups_whose_observers_agree_are_not_apart(sets: tuple[str, ...], people: int, swapped: bool) -> None:
    answers = []
    for place, items in enumerate(sets):
        last = items[:-2] + items[:-3:-1] if swapped else items
        answers += ranked([items] * (people - 1) + [last], f"g{place}")
    agreement = score_groups(from_answers(answers), method="firth").agreement
    assert agreement is not None
    assert (agreement.conclusion().p or 0) > 0.2
    assert (agreement.p is None) == (agreement.missing is not None)


def observer_tests(comparisons: Comparisons) -> list[ObserverTest | None]:
    """Every test by observers of the room: of one scale, of the order, of factors, and of matches along a series."""
    fits = [fit_model(comparisons, model, order_effect=True) for model in ("bradley-terry", "davidson")]
    grid = {f"i{item}": {"view": "ab"[item // 2], "paint": "cd"[item % 2]} for item in range(4)}
    effects = factor_effects(comparisons, grid)
    random = np.random.default_rng(11)
    chances, observer = np.array([0.1, 0.2, 0.3, 0.25, 0.15]), np.repeat(np.arange(30), 4)
    took = random.multinomial(1, chances, len(observer)) * random.uniform(0.5, 1.5, (len(observer), 1))
    slopes = np.column_stack([np.arange(5) - 2.0, [1.0, -1, -2, -1, 1]])
    matches = step_test(took - chances, observer, len(observer) * chances, slopes)
    orders = [fit.order_test.by_observers for fit in fits if fit.order_test]
    added = [*(test.by_observers for test in effects.tests), *(test.by_observers for test in effects.interactions)]
    return [*(lack_of_fit(comparisons, fit) for fit in fits), *orders, *added, matches]


def test_of_many_observers_no_matrix_of_all_two_is_made_and_the_tests_are_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The slow, obvious twin has the inner products of all two of them. Each answer has a weight, so that no two
    observers tell the same but for rounding, which would swap the weights drawn for them."""
    random = np.random.default_rng(9)
    comparisons = simulated(random, 30, 4, taste=0.7, side=0.3, ties=0.2)
    comparisons = replace(comparisons, count=random.uniform(0.5, 1.5, len(comparisons.count)))
    twins = observer_tests(comparisons)
    assert len(twins) == 8
    monkeypatch.setattr(robust_tests, "MOST_IN_PRODUCTS", 0)
    monkeypatch.setattr(robust_tests, "BLOCK_NUMBERS", 10_000)
    monkeypatch.setattr(robust_tests, "from_products", None)
    for found, twin in zip(observer_tests(comparisons), twins, strict=True):
        assert found is not None
        assert twin is not None
        assert found.statistic == pytest.approx(twin.statistic, rel=1e-12, abs=1e-12)
        assert (found.df, found.p, found.observers) == (twin.df, twin.p, 30)


@pytest.mark.parametrize("observers", [2500, pytest.param(20_000, marks=pytest.mark.stress)])
def test_the_memory_of_a_test_of_one_scale_grows_with_the_observers_alone(observers: int) -> None:
    random = np.random.default_rng(12)
    answers = [
        Answer(f"i{pair[0]}", f"i{pair[1]}", 1.0, f"o{observer}")
        for observer in range(observers)
        for pair in (random.permutation(6)[:2] for _ in range(4))
    ]
    comparisons = from_answers(answers)
    fitted = fit_model(comparisons)
    tracemalloc.start()
    tested = lack_of_fit(comparisons, fitted)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert tested is not None
    assert fitted.goodness is not None
    assert tested.statistic == pytest.approx(fitted.goodness.pearson, rel=1e-8)
    assert peak < 40e6 + 2000 * observers
