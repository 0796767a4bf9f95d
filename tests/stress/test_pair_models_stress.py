"""Models of ties, order and Thurstone, tables of millions of lines, and classes of many items, at their edges."""

from __future__ import annotations

import subprocess
import sys
from itertools import product

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.scaling import MODELS, Model, fit_model, score
from analysis.scaling.laws import Davidson, RaoKupper
from tests.stress.answered import answered
from tests.stress.memory import peak_kb

pytestmark = pytest.mark.stress

ROWS = 10_000_000
READ = """
import sys
from tests.stress.memory import peak_kb
from analysis.comparisons import read_any
table = read_any(sys.stdin.buffer, "standard input").comparisons
print(len(table.items), len(table.observers), table.wins.sum(), peak_kb())
"""


def test_ten_million_lines_are_read_in_less_than_a_gigabyte() -> None:
    """With two thousand items and a hundred thousand observers nearly every line is a kind of its own."""
    items, observers = 2000, 100_000
    reader = subprocess.Popen(
        [sys.executable, "-c", READ], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd="."
    )
    assert reader.stdin is not None
    assert reader.stdout is not None
    random = np.random.default_rng(1)
    reader.stdin.write("winner,loser,count,observer,first\n")
    for _ in range(100):
        first = random.integers(items, size=ROWS // 100)
        second = (first + random.integers(1, items, size=len(first))) % items
        person = random.integers(observers, size=len(first))
        lines = zip(first.tolist(), second.tolist(), person.tolist(), strict=True)
        reader.stdin.write("".join(f"picture {a},picture {b},1,{c},picture {a}\n" for a, b, c in lines))
    reader.stdin.close()
    with reader.stdout as stream:
        told = stream.read().split()
    assert reader.wait() == 0
    assert [int(told[0]), int(told[1]), float(told[2])] == [items, observers, ROWS]
    assert int(told[3]) / 1024 < 1000  # megabytes


@pytest.mark.parametrize("model", MODELS)
def test_counts_of_every_size_at_once(model: Model) -> None:
    """Counts drawn from 1e-3 to 1e9: what each item is expected to win, ties halved, is what it won."""
    for seed in range(60):
        random = np.random.default_rng(seed)
        n = int(random.integers(2, 9))
        answers = []
        for one, other in product(range(n), repeat=2):
            if one != other:
                count, tied = 10 ** random.uniform(-3, 9, 2)
                answers.append(Answer(f"{one}", f"{other}", float(count)))
                answers.append(Answer(f"{one}", f"{other}", float(tied), tie=True))
        comparisons = from_answers(answers, [f"{item}" for item in range(n)])
        fitted = fit_model(comparisons, model)
        assert fitted.converged, seed
        assert np.isfinite(fitted.theta).all()
        assert (fitted.se > 0).all()
        if model == "davidson":
            assert_balanced(comparisons, fitted.theta, fitted.parameters[0].estimate)


def assert_balanced(comparisons: Comparisons, theta: np.ndarray, k: float) -> None:
    """Davidson's likelihood equations: wins and half the ties as expected; ties as expected in all."""
    n = len(theta)
    wins, ties = comparisons.wins, comparisons.tie_counts
    total = wins + wins.T + ties
    first, _, neither = Davidson().probabilities((theta[:, None] - theta[None, :]).ravel(), k)
    expected_wins = total * first.reshape(n, n)
    expected_ties = total * neither.reshape(n, n)
    points, expected = (wins + ties / 2).sum(axis=1), (expected_wins + expected_ties / 2)
    np.fill_diagonal(expected, 0)
    assert np.abs(points - expected.sum(axis=1)).max() <= 1e-11 * total.sum()
    np.fill_diagonal(expected_ties, 0)
    assert abs(ties.sum() - expected_ties.sum()) <= 1e-11 * total.sum()


@pytest.mark.parametrize("spread", [1.0, 10.0, 30.0, 100.0])
@pytest.mark.parametrize("model", ["davidson", "rao-kupper"])
def test_strengths_far_apart_are_found_or_refused(model: Model, spread: float) -> None:
    theta = np.array([0.0, 0.3, 0.7, 1.0]) * spread
    law = Davidson() if model == "davidson" else RaoKupper()
    answers = []
    for one, other in product(range(4), repeat=2):
        if one < other:
            chances = law.probabilities(np.array([theta[one] - theta[other]]), 0.4)
            first, second, neither = (100 * float(p[0]) for p in chances)
            answers += [Answer(f"{one}", f"{other}", first), Answer(f"{other}", f"{one}", second)]
            answers.append(Answer(f"{one}", f"{other}", neither, tie=True))
    fitted = fit_model(from_answers(answers, "0123"), model)
    if fitted.separation is None and fitted.converged:
        assert fitted.theta == pytest.approx(theta - theta.mean(), abs=1e-6 * max(1.0, spread))
    else:
        assert spread > 30


def test_errors_of_the_tie_parameter_and_order_effect_cover_the_truth() -> None:
    """200 studies of 30 observers: 95 % intervals hold ν and δ in 88 to 99.5 % of them (three standard errors)."""
    theta, k, order = np.array([0.8, 0.2, -0.3, -0.7]), -0.5, 0.3
    first, second = np.array([(i, j) for i, j in product(range(4), repeat=2) if i != j]).T
    chances = np.stack(Davidson().probabilities(theta[first] - theta[second] + order, k), axis=1)
    random = np.random.default_rng(5)
    held = np.zeros(2)
    for _ in range(200):
        counts = random.multinomial(30, chances).astype(float)
        cells = np.repeat(np.arange(len(first)), 3)
        outcome = np.tile(np.arange(3), len(first))
        count = counts.ravel()
        kept = count > 0
        winner = np.where(outcome == 1, second[cells], first[cells])[kept]
        loser = np.where(outcome == 1, first[cells], second[cells])[kept]
        first_won, tie = (outcome != 1)[kept].astype(np.int8), (outcome == 2)[kept]
        comparisons = answered(tuple("abcd"), winner, loser, count=count[kept], winner_was_first=first_won, tie=tie)
        for place, (parameter, truth) in enumerate(
            zip(fit_model(comparisons, "davidson", order_effect=True).parameters, (k, order), strict=True)
        ):
            held[place] += parameter.low <= truth <= parameter.high
    assert (held >= 176).all()
    assert (held <= 199).all()


@pytest.mark.parametrize(("n", "with_classes"), [(600, True), (2000, False)])
def test_thousands_of_items_fit_into_memory(n: int, with_classes: bool) -> None:
    random = np.random.default_rng(1)
    theta = random.normal(0, 0.7, n)
    ring = np.arange(n)
    first = np.r_[ring, random.integers(n, size=10 * n)]
    second = np.r_[(ring + 1) % n, (first[n:] + random.integers(1, n, size=10 * n)) % n]
    won = random.binomial(20, 1 / (1 + np.exp(theta[second] - theta[first]))).astype(float)
    count = np.r_[won + 0.5, 20.5 - won]
    comparisons = answered(n, np.r_[first, second], np.r_[second, first], count=count)
    fitted = fit_model(comparisons, method="map")
    assert fitted.converged
    assert np.corrcoef(fitted.theta, theta)[0, 1] > 0.9
    if with_classes:
        assert all(item.label for item in score(comparisons, method="map").items)
    assert peak_kb() / 1024**2 < 3  # gigabytes
