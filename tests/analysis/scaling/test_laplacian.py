"""Beneath the fits: laws, counts, starts, elimination, conjugate gradients, goodness of fit, units."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.special import expit
from scipy.stats import chi2, chisquare, norm

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.comparisons.comparisons import from_arrays
from analysis.covariance import laplacian
from analysis.errors import ResultsError
from analysis.scaling import (
    LAWS,
    MODELS,
    Counts,
    Model,
    ModelMethod,
    Probit,
    are_connected,
    count_pairs,
    fit,
    fit_model,
    maximise,
    newton,
    probabilities,
    score,
)
from analysis.scaling import laws as units
from analysis.scaling.conjugate_gradients import SparseItems, items_design
from analysis.scaling.counts import MOST_ITEMS_KEPT
from analysis.scaling.designs import ITEMS
from analysis.scaling.fitting import fit_sparse
from analysis.scaling.laws import Davidson, Law, Logistic, RaoKupper
from analysis.scaling.penalty import NO_PENALTY, Gaussian
from analysis.scaling.result import goodness_of_fit
from documents.arrays import Floats
from documents.blas_threads import set_blas_threads
from tests.choice import nightly
from tests.kept import known


# Elimination against LAPACK and against exact fractions.
def graphs(n: int, batch: int, low: float, high: float) -> st.SearchStrategy[Floats]:
    """Symmetric weights, their exponents spread evenly."""

    def build(seed: int) -> Floats:
        random = np.random.default_rng(seed)
        weights = np.exp(random.uniform(np.log(low), np.log(high), (batch, n, n)))
        upper = np.triu(np.ones((n, n)), 1) * weights
        return upper + upper.transpose(0, 2, 1)

    return st.integers(0, 2**32).map(build)


@given(graphs(6, 3, 0.1, 10))
def test_both_ways_of_solving_agree(weights: Floats) -> None:
    right = np.random.default_rng(1).normal(size=(3, 6, 2))
    right -= right.mean(axis=1, keepdims=True)
    slow, fast = laplacian.by_elimination(weights, right), laplacian.by_lapack(weights, right)
    assert slow == pytest.approx(fast, abs=1e-12)
    assert slow.sum(axis=1) == pytest.approx(0, abs=1e-13)


@given(graphs(5, 1, 0.1, 10))
def test_the_pseudo_inverse_is_that_of_numpy(weights: Floats) -> None:
    plain = weights[0]
    matrix = np.diag(plain.sum(axis=1)) - plain
    assert laplacian.pseudo_inverse(weights)[0] == pytest.approx(np.linalg.pinv(matrix), abs=1e-12)


@settings(max_examples=30, deadline=None)
@given(graphs(5, 1, 1e-12, 1e12))
def test_elimination_is_exact_to_rounding_however_far_the_weights_span(weights: Floats) -> None:
    right = np.array([1.0, 0, 0, 0, -1.0])
    found = laplacian.by_elimination(weights, right[None, :, None])[0, :, 0]
    exact = _exact(weights[0], right)
    span = float(exact.max() - exact.min())
    assert found - found[0] == pytest.approx(exact, rel=1e-13, abs=1e-13 * span)


def test_the_pseudo_inverse_of_a_large_graph_is_that_of_a_small_one() -> None:
    random = np.random.default_rng(3)
    upper = np.triu(random.random((240, 240)) < 0.02, 1) * random.uniform(0.1, 10, (240, 240))
    weights = upper + upper.T
    weights[np.arange(239), np.arange(1, 240)] = weights[np.arange(1, 240), np.arange(239)] = 1
    slow = laplacian.by_lapack(weights[None], (np.eye(240) - 1 / 240)[None])[0]
    kept = weights.copy()
    large = laplacian.pseudo_inverse(weights[None])[0]
    assert (weights == kept).all()
    assert np.abs(large - slow).max() < 1e-12
    assert (large == large.T).all()
    assert laplacian.pair_variances(large) == pytest.approx(
        laplacian.contrast_variances(large)[np.triu_indices(240, 1)], rel=1e-15
    )


def _exact(weights: Floats, right: Floats) -> Floats:
    """Solve with fractions, item 0 held at zero."""
    n = len(weights)
    weight = [[Fraction(float(value)) for value in row] for row in weights]
    rows = [
        [sum(weight[i], Fraction()) if i == j else -weight[i][j] for j in range(1, n)] + [Fraction(float(right[i]))]
        for i in range(1, n)
    ]
    for k in range(n - 1):
        for other in range(n - 1):
            if other != k:
                factor = rows[other][k] / rows[k][k]
                rows[other] = [a - factor * b for a, b in zip(rows[other], rows[k], strict=True)]
    return np.array([0.0] + [float(rows[k][-1] / rows[k][k]) for k in range(n - 1)])


def test_strong_flows_cancel_and_the_weak_one_survives() -> None:
    first, second = np.array([0, 0, 1, 2]), np.array([1, 2, 2, 3])
    flow = np.array([1e16 / 3, -1e16 / 3, 1e16 / 3, 1.0])[None]
    nothing = np.zeros_like(flow)
    counts = Counts(4, first, second, nothing, nothing, nothing)
    assert counts.net_flows(flow).tolist() == [[0, 0, 1, -1]]
    both = np.repeat(nothing, 2, axis=0)
    twice = Counts(4, first, second, both, both, both)
    assert twice.net_flows(np.repeat(flow, 2, axis=0)).tolist() == [[0, 0, 1, -1]] * 2


@pytest.mark.parametrize("n", [5, 16, 17, 33, 50, 80])
@pytest.mark.usefixtures("blas_threads_kept")
def test_the_covariance_of_small_graphs_does_not_depend_on_threads(n: int) -> None:
    """Power's promise: the same numbers to the last bit from any process, with any number of threads."""
    weights = np.random.default_rng(1).random((40, n, n))
    weights += weights.transpose(0, 2, 1)
    weights[:, np.arange(n), np.arange(n)] = 0
    found = set()
    for threads in (1, 2, 3, 4):
        set_blas_threads(threads)
        found.add(b"".join(laplacian.pseudo_inverse(one[None]).tobytes() for one in weights))
    assert len(found) == 1


@pytest.mark.parametrize("batch", [1, laplacian.LARGE_BATCH])
def test_a_precision_is_on_the_diagonal_either_way(batch: int) -> None:
    random = np.random.default_rng(2)
    weights = random.uniform(0.5, 2, (batch, 4, 4))
    weights = np.triu(weights, 1) + np.triu(weights, 1).transpose(0, 2, 1)
    right = random.normal(size=(batch, 4, 1))
    right -= right.mean(axis=1, keepdims=True)
    matrix = weights.sum(axis=2)[:, :, None] * np.eye(4) - weights + 0.7 * np.eye(4)
    assert laplacian.solve(weights, right, 0.7) == pytest.approx(np.linalg.solve(matrix, right), abs=1e-12)


# Conjugate gradients against the dense fit.
def ring_with_chords(n: int, chords: int, seed: int, *, losses: bool = True) -> NDArray[np.float64]:
    """Counts whose graph of wins is strongly connected through a ring; without ``losses`` it is won one way round."""
    random = np.random.default_rng(seed)
    wins = np.zeros((n, n))
    ring = np.arange(n)
    wins[ring, (ring + 1) % n] = random.integers(1, 9, n)
    if losses:
        wins[(ring + 1) % n, ring] = random.integers(1, 9, n)
    first, step = random.integers(n, size=chords), random.integers(1, n, size=chords)
    np.add.at(wins, (first, (first + step) % n), random.integers(1, 9, chords))
    return wins


@settings(max_examples=20, deadline=None)
@given(st.integers(3, 60), st.integers(0, 200), st.integers(0, 2**32))
def test_the_sparse_fit_is_the_dense_fit(n: int, chords: int, seed: int) -> None:
    wins = ring_with_chords(n, chords, seed)
    dense, sparse = fit(wins), fit_sparse(csr_array(wins))
    assert sparse.converged
    assert sparse.theta[0] == pytest.approx(dense.theta, abs=1e-10)
    assert sparse.log_likelihood[0] == pytest.approx(dense.log_likelihood, rel=1e-10)


@settings(max_examples=20, deadline=None)
@given(st.integers(3, 60), st.integers(0, 3), st.integers(0, 2**32))
def test_a_ring_won_one_way_round_fulfils_the_likelihood_equations(n: int, chords: int, seed: int) -> None:
    """Some item then wins against one stronger by far: its θ is only as certain as the last digit of its flow."""
    wins = ring_with_chords(n, chords, seed, losses=False)
    for fitted in (fit(wins), fit_sparse(csr_array(wins))):
        assert fitted.converged
        flow = wins * probabilities(fitted.theta.ravel()).T
        assert np.abs((flow - flow.T).sum(axis=1)).max() <= 1e-13 * wins.sum()


def test_a_thousand_items_of_which_few_were_compared() -> None:
    wins = ring_with_chords(1000, 10_000, 1)
    counts = Counts.from_sparse(csr_array(wins))
    design = SparseItems(counts)
    sparse, dense = maximise(counts, design=design), maximise(counts, design=ITEMS)
    assert sparse.converged.all()
    assert np.abs(sparse.theta - dense.theta).max() < 1e-10
    assert design.products < 200
    assert isinstance(items_design(counts), SparseItems)


def test_separated_items_are_reported_and_not_fitted() -> None:
    fitted = fit_sparse(csr_array(np.array([[0.0, 1, 1], [0, 0, 1], [0, 1, 0]])))
    assert fitted.separated
    assert not fitted.converged
    assert np.isnan(fitted.theta).all()


@pytest.mark.parametrize(
    ("wins", "what"),
    [
        ([[0.0, 1.0]], "shape"),
        ([[0, -1], [1, 0]], "negative"),
        ([[1, 1], [1, 0]], "diagonal"),
        ([[0, np.nan], [1, 0]], "NaN"),
    ],
)
def test_counts_that_are_no_counts_are_refused(wins: list[list[float]], what: str) -> None:
    with pytest.raises(ResultsError, match=what):
        fit_sparse(csr_array(np.array(wins, dtype=float)))


@pytest.mark.parametrize(
    ("model", "method", "order_effect"),
    [
        ("davidson", "ml", True),
        ("thurstone", "map", False),
        *nightly(*product(("bradley-terry", "thurstone", "davidson"), ("ml", "map"), (False, True))),
    ],
)
def test_every_model_recognises_few_pairs_of_many_items(model: Model, method: ModelMethod, order_effect: bool) -> None:
    """Ring and chords, with ties, fitted by conjugate gradients as by dense equations."""
    random = np.random.default_rng(5)
    n = 300
    first = np.r_[np.arange(n), random.integers(n, size=600)]
    second = (first + np.r_[np.ones(n, dtype=int), random.integers(1, n, size=600)]) % n
    size = len(first)
    comparisons = from_arrays(
        tuple(f"{item}" for item in range(n)),
        ("",),
        winner=np.r_[first, second, first],
        loser=np.r_[second, first, second],
        observer=np.zeros(3 * size, dtype=np.intp),
        count=random.integers(1, 9, 3 * size).astype(float),
        winner_was_first=random.integers(0, 2, 3 * size).astype(np.int8),
        tie=np.r_[np.zeros(2 * size, dtype=bool), np.ones(size, dtype=bool)],
    )
    law = LAWS[model]
    counts, _ = count_pairs(comparisons, ordered=order_effect, ties=law.parameter is not None)
    assert isinstance(items_design(counts), SparseItems)
    penalty = Gaussian.of_sd(2.0) if method == "map" else NO_PENALTY
    dense = maximise(counts, law, penalty=penalty, design=ITEMS)
    fitted = fit_model(comparisons, model, method=method, order_effect=order_effect)
    assert fitted.converged
    assert fitted.theta == pytest.approx(dense.theta[0], abs=1e-10)
    assert fitted.log_likelihood == pytest.approx(float(dense.log_likelihood[0]), rel=1e-12)


def test_several_counts_at_once_are_never_sparse() -> None:
    first, second = np.arange(399), np.arange(1, 400)
    for batch in (1, 2):
        wins = np.ones((batch, 399))
        made = items_design(Counts(400, first, second, wins, wins, np.zeros((batch, 399))))
        assert isinstance(made, SparseItems) == (batch == 1)


# Each law's chances and derivatives, against their definitions and finite differences.

LAWS_LAWS: list[Law] = [Logistic(), Probit(), Davidson(), RaoKupper()]
number = st.floats(0, 50)


def cell(won: float, lost: float, tied: float) -> Counts:
    first, second = np.array([0]), np.array([1])
    return Counts(2, first, second, np.array([[won]]), np.array([[lost]]), np.array([[tied]]))


def likelihood(law: Law, cells: Counts, d: float, k: float) -> float:
    return float(law.log_likelihood(cells, np.array([[d]]), k)[0, 0])


@pytest.mark.parametrize("law", LAWS_LAWS, ids=lambda law: type(law).__name__)
@given(d=st.floats(-8, 8), k=st.floats(0.05, 3), won=number, lost=number, tied=number)
def test_derivatives_are_those_of_the_likelihood(
    law: Law, d: float, k: float, won: float, lost: float, tied: float
) -> None:
    cells = cell(won, lost, tied if law.parameter else 0.0)
    slopes = law.slopes(cells, np.array([[d]]), k)
    h = 1e-6
    by_d = (likelihood(law, cells, d + h, k) - likelihood(law, cells, d - h, k)) / (2 * h)
    assert slopes.d[0, 0] == pytest.approx(by_d, rel=1e-5, abs=1e-4)
    up, down = (law.slopes(cells, np.array([[d + step]]), k) for step in (h, -h))
    assert slopes.dd[0, 0] == pytest.approx(-(up.d[0, 0] - down.d[0, 0]) / (2 * h), rel=1e-5, abs=1e-4)
    if law.parameter:
        by_k = (likelihood(law, cells, d, k + h) - likelihood(law, cells, d, k - h)) / (2 * h)
        assert slopes.k[0, 0] == pytest.approx(by_k, rel=1e-4, abs=1e-3)
        assert slopes.dk[0, 0] == pytest.approx(-(up.k[0, 0] - down.k[0, 0]) / (2 * h), rel=1e-5, abs=1e-4)
        above, below = (law.slopes(cells, np.array([[d]]), k + step) for step in (h, -h))
        assert slopes.kk[0, 0] == pytest.approx(-(above.k[0, 0] - below.k[0, 0]) / (2 * h), rel=1e-4, abs=1e-3)


@pytest.mark.parametrize("law", LAWS_LAWS, ids=lambda law: type(law).__name__)
@given(d=st.floats(-30, 30), k=st.floats(0.01, 3))
def test_chances_sum_to_one_and_turn_round_with_the_items(law: Law, d: float, k: float) -> None:
    chances = np.concatenate(law.probabilities(np.array([d]), k))
    turned = np.concatenate(law.probabilities(np.array([-d]), k))
    assert chances.sum() == pytest.approx(1, abs=1e-12)
    assert (chances >= 0).all()
    assert turned == pytest.approx(chances[[1, 0, 2]], rel=1e-12)
    for outcome, chance in enumerate(chances.tolist()):
        if chance > 0:
            counts = [0.0, 0.0, 0.0]
            counts[outcome] = 1
            assert likelihood(law, cell(*counts), d, k) == pytest.approx(np.log(chance), rel=1e-9, abs=1e-12)


def test_the_laws_are_as_published() -> None:
    """π_i = 3, π_j = 1, ν = 0.5, η = 2."""
    d = np.array([np.log(3)])
    assert np.concatenate(Davidson().probabilities(d, np.log(0.5))) == pytest.approx(
        np.array([3, 1, 0.5 * np.sqrt(3)]) / (4 + 0.5 * np.sqrt(3))
    )
    first, second = 3 / (3 + 2), 1 / (1 + 6)
    assert np.concatenate(RaoKupper().probabilities(d, np.log(2))) == pytest.approx([first, second, 1 - first - second])
    assert Probit().probabilities(d, 0.0)[0] == pytest.approx(norm.cdf(np.log(3)))
    assert Logistic().probabilities(d, 0.0)[0] == pytest.approx(0.75)


@pytest.mark.parametrize("law", LAWS_LAWS, ids=lambda law: type(law).__name__)
def test_far_apart_the_information_keeps_its_digits(law: Law) -> None:
    """One surprising answer at 30: the slope of log p by d is 1 (logistic) or about d (probit)."""
    d: NDArray[np.float64] = np.array([[30.0]])
    slopes = law.slopes(cell(0, 1, 0), d, 0.7)
    assert np.isfinite(slopes.d).all()
    assert slopes.d[0, 0] == pytest.approx(-30.0332 if isinstance(law, Probit) else -1, rel=1e-4)
    assert slopes.dd[0, 0] > 0


def test_an_impossible_threshold_is_infinitely_unlikely() -> None:
    assert likelihood(RaoKupper(), cell(1, 1, 1), 0.0, -0.1) == -np.inf


# The start by plain sums against the iteration from near the log odds; one fit on any number of threads.

SLOW = 200  # steps; a limit makes the iteration begin near the log odds


def table(n: int, seed: int, spread: float = 0.7, share: float = 1.0, each: int = 20) -> Floats:
    """Counts of ``each`` answers to a ``share`` of all pairs, and of one loop through all items."""
    random = np.random.default_rng(seed)
    theta = random.normal(0, spread, n)
    first, second = np.triu_indices(n, 1)
    asked = random.random(len(first)) < share
    won = random.binomial(each, 1 / (1 + np.exp(theta[second] - theta[first]))) * asked
    wins = np.zeros((n, n))
    wins[first, second], wins[second, first] = won, each * asked - won
    wins[np.arange(n), np.arange(1, n + 1) % n] += 1
    return wins


@pytest.mark.parametrize(("n", "share"), [(2, 1.0), (3, 1.0), (10, 1.0), (40, 0.2), (100, 1.0)])
def test_it_ends_where_the_slow_way_ends(n: int, share: float) -> None:
    wins = table(n, n, share=share)
    near = known(newton.plain_maximum(wins))
    slow, fast = fit(wins, most_iterations=SLOW), fit(wins)
    assert np.abs(near[0] - slow.theta).max() < 1e-8
    assert np.abs(fast.theta - slow.theta).max() < 1e-12
    assert np.abs(fast.covariance - slow.covariance).max() < 1e-12 * slow.covariance.max()
    assert fast.log_likelihood == pytest.approx(slow.log_likelihood, rel=1e-14)
    assert (fast.converged, slow.converged) == (True, True)
    assert fast.iterations == near[1] + 1


@settings(max_examples=60)
@given(
    n=st.integers(2, 12),
    seed=st.integers(0, 10_000),
    spread=st.floats(0, 6),
    each=st.integers(1, 1000),
    scale=st.sampled_from([1e-3, 1.0, 1e6]),
)
def test_every_finite_fit_is_that_of_the_slow_way(n: int, seed: int, spread: float, each: int, scale: float) -> None:
    """Tables are scaled alike, which moves no maximum; the widest are refused by the start or taken rightly."""
    wins = scale * table(n, seed, spread, each=each)
    if not are_connected(wins[None])[0]:
        return
    slow, fast = fit(wins, most_iterations=SLOW), fit(wins)
    assert slow.converged
    assert fast.converged
    assert np.abs(fast.theta - slow.theta).max() < 1e-10


def test_long_steps_are_refused() -> None:
    wins = np.array([[0, 100, 0, 1], [0, 0, 100, 0], [0, 0, 0, 100], [1e-6, 0, 0, 0]])
    assert newton.plain_maximum(wins) is None
    assert fit(wins).converged


def test_a_table_that_is_not_plain_begins_near_the_log_odds(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = []
    monkeypatch.setattr("analysis.scaling.newton.plain_maximum", lambda wins: taken.append(len(wins)))
    wins = table(6, 1)
    maximise(Counts.from_wins(np.stack([wins, wins])))
    fit(wins, method="firth")
    fit(wins, most_iterations=5)
    assert not taken
    fit(wins)
    assert taken == [6]


@pytest.mark.usefixtures("blas_threads_kept")
def test_a_fit_is_the_same_on_any_number_of_threads() -> None:
    wins = table(180, 4)
    found = set()
    for threads in (1, 2, 4):
        set_blas_threads(threads)
        fitted = fit(wins)
        found.add(fitted.theta.tobytes() + fitted.covariance.tobytes())
    assert len(found) == 1


# Counts listed from matrices of wins, and spread over matrices again.
@pytest.mark.parametrize("n", [7, MOST_ITEMS_KEPT, MOST_ITEMS_KEPT + 1])
@pytest.mark.parametrize("share", [0.02, 1.0])
def test_only_compared_pairs_are_listed_and_the_wins_come_back(n: int, share: float) -> None:
    random = np.random.default_rng(n)
    wins = random.integers(1, 5, (2, n, n)) * (random.random((2, n, n)) <= share) * (1.0 - np.eye(n))
    counts = Counts.from_wins(wins)
    happened = wins.any(axis=0)
    first, second = np.nonzero(np.triu(happened | happened.T, 1))
    assert counts.first.tolist() == first.tolist()
    assert counts.second.tolist() == second.tolist()
    assert (counts.wins() == wins).all()
    assert (counts.matrix(counts.total) == wins + wins.transpose(0, 2, 1)).all()


def test_a_pair_shown_in_both_orders_is_added() -> None:
    first, second = np.array([0, 1, 1]), np.array([1, 0, 2])
    won, lost = np.array([[3.0, 5, 1]]), np.array([[2.0, 7, 4]])
    counts = Counts(3, first, second, won, lost, np.zeros((1, 3)), ordered=True)
    assert counts.wins()[0].tolist() == [[0, 10, 0], [7, 0, 1], [0, 4, 0]]
    assert counts.matrix(won)[0].tolist() == [[0, 8, 0], [8, 0, 1], [0, 1, 0]]


def test_sparse_wins_are_listed_as_dense_ones() -> None:
    wins = np.array([[0.0, 3, 0], [1, 0, 0], [0, 2, 0]])
    dense, sparse = Counts.from_wins(wins[None]), Counts.from_sparse(csr_array(wins))
    assert (dense.wins() == sparse.wins()).all()
    assert dense.first.tolist() == sparse.first.tolist()


# Goodness of fit against its definition, and its word of caution.
@pytest.mark.promise("believable-scores")
def test_deviance_and_pearson_are_sums_over_the_answers_to_each_pair(pudding: Comparisons) -> None:
    fitted = fit_model(pudding, "davidson")
    cells, _ = count_pairs(pudding, ties=True)
    deviance = pearson = 0.0
    k = fitted.parameters[0].estimate
    for i, j, *observed in zip(cells.first, cells.second, cells.won[0], cells.lost[0], cells.tied[0], strict=True):
        chances = Davidson().probabilities(np.array([fitted.theta[i] - fitted.theta[j]]), k)
        expected = np.concatenate(chances) * sum(observed)
        deviance += 2 * float((observed * np.log(observed / expected)).sum())
        pearson += float(chisquare(observed, expected).statistic)
    goodness = known(fitted.goodness)
    assert goodness.deviance == pytest.approx(deviance, rel=1e-10)
    assert goodness.pearson == pytest.approx(pearson, rel=1e-10)
    assert goodness.p_pearson == pytest.approx(chi2.sf(pearson, 24), rel=1e-9)
    assert goodness.caveat is None


def test_small_counts_are_told_and_no_freedom_has_no_p(pudding: Comparisons) -> None:
    cells, _ = count_pairs(pudding)
    half = np.full((1, len(cells.first)), 0.5)
    few = type(cells)(6, cells.first, cells.second, cells.won / 20, cells.lost / 20, cells.tied)
    goodness = goodness_of_fit(few, (half, half, 0 * half), 5, ties=False)
    assert goodness.share_small == 1
    assert "100%" in known(goodness.caveat)
    assert goodness_of_fit(cells, (half, half, 0 * half), 15, ties=False).p_deviance is None


# Units: constants against their definitions, and two items at 75 : 25 exactly one unit apart.
def test_constants_are_what_they_say() -> None:
    assert norm.cdf(units.STANDARD_DEVIATIONS_PER_JOD) == pytest.approx(0.75, abs=1e-15)
    assert expit(units.NATS_PER_JND) == pytest.approx(0.75, abs=1e-15)
    assert pytest.approx(1.4826, abs=5e-5) == units.JOD_PER_STANDARD_DEVIATION


def test_the_angular_law_of_iso_20462() -> None:
    share = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    assert units.iso_20462_jnd(share) == pytest.approx([-3, -1, 0, 1, 3], abs=1e-12)


@pytest.mark.parametrize("model", MODELS)
def test_three_of_four_answers_are_one_unit(model: Model) -> None:
    answers = [Answer("good", "bad", 75), Answer("bad", "good", 25)]
    if model in ("davidson", "rao-kupper"):
        answers.append(Answer("good", "bad", 1e-9, tie=True))
    told = score(from_answers(answers), model).to_json()["items"]
    assert told[0]["name"] == "good"
    assert told[0]["jnd"] - told[1]["jnd"] == pytest.approx(1, abs=1e-8)
    if model == "thurstone":
        assert told[0]["jod"] - told[1]["jod"] == pytest.approx(1, abs=1e-12)
        assert told[0]["score"] is None
    else:
        assert told[0]["score"] == pytest.approx(0.75)
