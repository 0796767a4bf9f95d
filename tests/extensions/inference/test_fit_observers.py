"""Observers as a distribution: the fit, its moments and its elimination beside slow twins, and the command."""

from __future__ import annotations

import csv
import json
import subprocess
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.comparisons.comparisons import from_arrays
from analysis.covariance import pseudo_inverse
from analysis.errors import ResultsError
from analysis.scaling import LAWS, LOGISTIC, Counts, Model, fit_model
from cyclopean.testing import prove_method
from documents import threads
from documents.arrays import Floats
from extensions.inference import fit_observers, spread
from extensions.inference.elimination import Blocks
from extensions.inference.observers_fit import _answers
from extensions.inference.propagation import _logistic_moments, _moments, _rough_links, _solved, alike, propagate
from tests.choice import nightly
from tests.kept import known

# Simulated answers of observers who differ, by a pair or all pairs.

Maker = Callable[..., Comparisons]


@pytest.fixture
def make() -> Maker:
    """Every observer answers every pair ``repeats`` times, in each group; items have the same names in all."""

    def make_answers(
        theta: NDArray[np.float64],
        observers: int,
        sd: float,
        *,
        model: Model = "bradley-terry",
        repeats: int = 1,
        groups: int = 1,
        seed: int = 1,
    ) -> Comparisons:
        random = np.random.default_rng(seed)
        n = len(theta)
        own = theta + random.normal(0, sd, (groups, observers, n))
        i, j = np.triu_indices(n, 1)
        p = LAWS[model].probabilities(own[..., i] - own[..., j], 0.0)[0]
        won = random.binomial(repeats, p)
        group, observer, pair = (part.ravel() for part in np.indices(won.shape))
        count = np.concatenate([won.ravel(), repeats - won.ravel()]).astype(float)
        columns = (np.r_[i[pair], j[pair]], np.r_[j[pair], i[pair]], np.r_[observer, observer], np.r_[group, group])
        kept = count > 0
        winner, loser, who, where = (column[kept] for column in columns)
        return from_arrays(
            tuple(f"item {place}" for place in range(n)),
            tuple(f"observer {place}" for place in range(observers)),
            winner=winner,
            loser=loser,
            observer=who,
            count=count[kept],
            winner_was_first=np.full(len(winner), -1, np.int8),
            tie=np.zeros(len(winner), np.bool_),
            group=where,
            groups=tuple(f"group {place}" for place in range(groups)) if groups > 1 else (),
        )

    return make_answers


# Observers as a distribution: the fit, its moments and its elimination beside slow twins, and the command.

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
    flat = LAWS[model].flattening(tau)
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
    estimate = fit_observers(comparisons, model).spread
    places = (estimate.low, estimate.estimate, known(estimate.high))
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


# Moments by the quick formula against those by the law; the rough information against the exact one.


def test_quick_logistic_moments_are_those_of_the_law() -> None:
    random = np.random.default_rng(1)
    pairs = 3000
    won, lost = random.integers(0, 4, (2, pairs)).astype(float)
    won += (won + lost == 0) * 0.5
    counts = Counts(2, np.zeros(pairs, np.intp), np.ones(pairs, np.intp), won[None], lost[None], 0 * won[None])
    mean, deviation = random.normal(0, 1, pairs), random.uniform(1e-3, 0.8, pairs)
    v = random.uniform(0, 0.25, pairs) * (won + lost) * (deviation < 0.7)
    site = (mean, deviation, random.normal(0, 0.3, pairs), v)
    quick = known(_logistic_moments(counts, site))
    for one, other in zip(quick, _moments(counts, LOGISTIC, site), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)
    assert _logistic_moments(counts, (60 * mean, *site[1:])) is None
    assert _logistic_moments(counts, (mean, 20 * deviation, *site[2:])) is None
    many = Counts(2, counts.first, counts.second, 1000 * counts.won, counts.lost, counts.tied)
    assert _logistic_moments(many, site) is None


@pytest.mark.parametrize(("items", "neighbours", "near"), [(12, 12, 0.02), (30, 2, 0.02), (3, 3, 1e-9), (2, 2, 1e-9)])
def test_rough_information_has_the_exact_row_sums(make: Maker, items: int, neighbours: int, near: float) -> None:
    """With every pair compared it is near the exact one; far pairs of a chain get more weight than they have."""
    comparisons = make(np.linspace(-1, 1, items), 20, 0.8, repeats=2)
    close = abs(comparisons.winner - comparisons.loser) <= neighbours
    columns = {name: getattr(comparisons, name)[close] for name in ("winner", "loser", "observer", "count")}
    columns |= {"winner_was_first": np.full(close.sum(), -1, np.int8), "tie": np.zeros(close.sum(), np.bool_)}
    answers, _ = _answers(from_arrays(comparisons.items, comparisons.observers, **columns))
    blocks, counts = answers.blocks, answers.counts
    sites = propagate(answers, LOGISTIC, 0.8, alike(answers, LOGISTIC, np.linspace(-1, 1, items)), 1e-6)
    delta = counts.differences(sites.theta[None])[0]
    solution = _solved(blocks, 0.64, sites.slope - sites.precision * delta, sites.precision)
    rough = _rough_links(counts, blocks, 0.64, solution)
    np.testing.assert_allclose(rough.sum(axis=1), sites.links.sum(axis=1), rtol=1e-6)
    variances, exact = (np.diag(pseudo_inverse(links[None])[0]) for links in (rough, sites.links))
    assert (variances < (1 + near) * exact).all()
    if neighbours >= items:
        np.testing.assert_allclose(variances, exact, rtol=near)


# Elimination for all observers at once against one dense inverse.
@pytest.mark.parametrize(
    ("observers", "items", "pairs"),
    [(5, 6, 200), (4, 30, 30), (3, 10, 9), (3, 3, 9), (6, 12, 20), (2, 60, 75), (1, 2, 1)],
)
def test_means_variances_and_links_are_those_of_the_inverse(observers: int, items: int, pairs: int) -> None:
    random = np.random.default_rng(items)
    drawn = random.integers(items, size=(pairs * observers, 2))
    drawn = np.sort(drawn[drawn[:, 0] != drawn[:, 1]], axis=1)
    who = random.integers(observers, size=len(drawn))
    key = np.unique((who * items + drawn[:, 0]) * items + drawn[:, 1]) if items > 2 else np.array([1])
    who, low, high = key // items**2, key // items % items, key % items
    who = np.unique(who, return_inverse=True)[1]
    nodes, place = np.unique(np.r_[who * items + low, who * items + high], return_inverse=True)
    first, second = place[: len(key)], place[len(key) :]
    blocks = Blocks(first, second, nodes // items, nodes % items, items)

    w, right = random.exponential(2, len(key)), random.normal(size=len(nodes))
    matrix = np.eye(len(nodes))
    for (a, b), weight in zip(zip(first, second, strict=True), w, strict=True):
        matrix[[a, b, a, b], [a, b, b, a]] += weight * np.array([1, 1, -1, -1])
    inverse = np.linalg.inv(matrix)
    links = np.zeros((items, items))
    for block in range(int(nodes[-1]) // items + 1):
        own = np.flatnonzero(blocks.block == block)
        links[np.ix_(blocks.item[own], blocks.item[own])] += inverse[np.ix_(own, own)]
    np.fill_diagonal(links, 0)

    solution = blocks.solve(w, right)
    np.testing.assert_allclose(solution.mean, inverse @ right, atol=1e-13)
    np.testing.assert_allclose(solution.variance, np.diag(inverse), atol=1e-13)
    apart = inverse[first, first] + inverse[second, second] - 2 * inverse[first, second]
    np.testing.assert_allclose(solution.pair_variance, apart, atol=1e-13)
    np.testing.assert_allclose(blocks.links(w), links, atol=1e-13)
    assert blocks.log_determinant(w) == pytest.approx(np.linalg.slogdet(matrix)[1], abs=1e-10)


def test_a_tree_needs_no_dense_equations_and_a_complete_design_nothing_else() -> None:
    chain = np.arange(9)
    assert not Blocks(chain, chain + 1, np.zeros(10, np.intp), np.arange(10), 10).dense
    low, high = np.triu_indices(6, 1)
    complete = Blocks(low, high, np.zeros(6, np.intp), np.arange(6), 6)
    assert not complete.rounds
    assert complete.dense[0].node.shape == (1, 6)


# `cyclopean scores --observers random` as a program.

Call = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def table(tmp_path: Path) -> Path:
    random = np.random.default_rng(5)
    strengths = np.linspace(0.8, -0.8, 5)
    lines = ["winner,loser,observer"]
    for observer in range(12):
        own = strengths + random.normal(0, 0.8, 5)
        for a in range(5):
            for b in range(a):
                won = random.random() < 1 / (1 + np.exp(own[b] - own[a]))
                lines.append(f"{'abcde'[a if won else b]},{'abcde'[b if won else a]},o{observer}")
    file = tmp_path / "table.csv"
    file.write_text("\n".join(lines), encoding="utf-8")
    return file


def test_what_it_prints_and_writes(cyclopean: Call, table: Path, tmp_path: Path) -> None:
    written = tmp_path / "observers.csv"
    done = cyclopean("scores", str(table), "--observers", "random", "--observer-scores", str(written))
    assert "0.941 nats for each item (95 % 0.23 to 1.76)" in done.stdout
    assert "a new observer" in done.stdout
    with written.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["group", "observer", "item", "theta", "sd"]
    assert len(rows) == 60
    values = json.loads(cyclopean("scores", str(table), "--observers", "random", "--json").stdout)
    assert values["spread"]["sd"] == pytest.approx(0.941, abs=5e-4)
    (group,) = values["groups"]
    assert [item["name"] for item in group["items"]] == list("abcde")
    assert len(group["pairs"]) == 10
    assert {entry["observer"] for entry in group["observers"]} == {row["observer"] for row in rows}


def test_options_that_do_not_go_together(cyclopean: Call, table: Path) -> None:
    done = cyclopean("scores", str(table), "--observers", "random", "--method", "firth", expect=2)
    assert "method does not go" in done.stderr
    done = cyclopean("scores", str(table), "--observer-scores", "x.csv", expect=2)
    assert "observer_scores goes with" in done.stderr


def test_its_way_to_score_keeps_what_is_promised_of_every_one() -> None:
    assert len(prove_method("observers.random")) == 5
