"""Solvers and models of pairs at their edges: far strengths, ties, order, weak links, many items, JOD, groups."""

from __future__ import annotations

import subprocess
import sys
from itertools import product

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.sparse import csr_array
from scipy.special import log_ndtr, ndtr

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.scaling import MODELS, Model, compared_groups, fit, fit_model, probabilities, score, score_groups
from analysis.scaling.fitting import fit_batch, fit_sparse
from analysis.scaling.laws import Davidson, RaoKupper
from analysis.scaling.separation import strong_groups
from documents.arrays import Floats
from extensions.inference import fit_jod
from tests.stress.answered import answered
from tests.stress.how_many import how_many
from tests.stress.memory import peak_kb

pytestmark = pytest.mark.stress


# The solvers at their edges: far strengths, tiny and huge counts, weak links, many items, many replicates.

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


# Models of ties, order and Thurstone, tables of millions of lines, and classes of many items, at their edges.

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
def test_models_counts_of_every_size_at_once(model: Model) -> None:
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


# JOD as pwcmp has them, over many sparse, unanimous and lopsided tables: the objective's slope is 0 at every fit.
def objective(q: Floats, wins: Floats) -> float:
    """Return what pwcmp minimises, both orders of each pair."""
    rows, columns = np.nonzero(wins + wins.T)
    won, lost = wins[rows, columns], wins[columns, rows]
    shifted = np.where(won == 0, 1.0, np.where(lost == 0, won - 1, won))
    d = (q[rows] - q[columns]) / 1.4826
    likelihood = np.exp(shifted * log_ndtr(d)[:, None] + (won + lost - shifted) * log_ndtr(-d)[:, None])
    prior = ((likelihood + 1e-8) / (likelihood.sum(axis=0) + 1e-8)).sum(axis=1)
    logs = won * log_ndtr(d) + lost * log_ndtr(-d) + np.log(prior + 0.1)
    return float(0.01 * np.mean(q) ** 2 - logs.sum())


@pytest.mark.parametrize("n", [2, 3, 6, 12])
@pytest.mark.parametrize("answers", [1, 2, 5, 20, 200])
def test_no_table_is_answered_worse_than_by_scipy(n: int, answers: int) -> None:
    random = np.random.default_rng(100 * n + answers)
    first, second = np.triu_indices(n, 1)
    checked = 0
    for sd in (0.3, 1.0, 4.0):
        for share in (0.4, 1.0):
            jod = random.normal(0, sd, n)
            total = answers * (random.random(len(first)) < share)
            won = random.binomial(total, ndtr((jod[first] - jod[second]) / 1.4826))
            wins = np.zeros((n, n))
            wins[first, second], wins[second, first] = won, total - won
            if len(compared_groups(wins)) > 1:
                continue
            fit = fit_jod(wins[None], "gaussian")
            if not fit.converged[0]:  # only where items are separated: the plain likelihood has no maximum either
                assert len(strong_groups(wins)) > 1
                assert np.isnan(fit.jod).all()
                continue
            (ours,) = fit.jod
            found = minimize(objective, ours, args=(wins,), method="BFGS", jac="3-point", options={"gtol": 1e-7}).x
            assert np.abs(found - found.mean() - ours).max() < 1e-4  # what SciPy can still find is rounding
            assert objective(ours, wins) <= objective(found, wins) + 1e-8
            checked += 1
    assert checked or answers < 3


# Scores within groups: the test of agreement at its level.


def study(random: np.random.Generator, observers: int, within_sd: float, share: float, groups: int) -> Comparisons:
    """Observers whose strengths differ within each group, each of whom compares a ``share`` of the pairs."""
    one, other = np.triu_indices(5, 1)
    theta = random.normal(0, within_sd, (observers, groups, 5))
    wins = random.random((observers, groups, len(one))) < 1 / (1 + np.exp(theta[..., other] - theta[..., one]))
    observer, group, pair = np.nonzero(random.random(wins.shape) < share)
    won = wins[observer, group, pair]
    winner, loser = np.where(won, one[pair], other[pair]), np.where(won, other[pair], one[pair])
    scenes = tuple(f"scene {number}" for number in range(groups))
    return answered(tuple("abcde"), winner, loser, observers, observer=observer, group=group, groups=scenes)


@pytest.mark.parametrize(("observers", "groups", "share"), [(5, 4, 1.0), (8, 12, 1.0), (30, 2, 0.5)])
@pytest.mark.parametrize("within_sd", [1.5, 0.0][: how_many(1, 2)])
def test_the_test_of_agreement_keeps_its_level(observers: int, groups: int, share: float, within_sd: float) -> None:
    """Of 400 studies without a difference, more than 32 false alarms at 0.05 happen once in 150."""
    random = np.random.default_rng([observers, groups, int(10 * within_sd)])
    false = 0
    for _ in range(400):
        agreement = score_groups(study(random, observers, within_sd, share, groups), covariance="model").agreement
        false += agreement is not None and agreement.p is not None and agreement.p <= 0.05
    print(f"{observers} observers, {groups} groups, sd {within_sd:g}: {false / 400:.3f}")
    assert false <= 32
