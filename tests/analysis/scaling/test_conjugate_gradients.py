"""Conjugate gradients against the dense fit."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse import csr_array

from analysis.comparisons.comparisons import from_arrays
from analysis.errors import ResultsError
from analysis.scaling import LAWS, Counts, Model, ModelMethod, count_pairs, fit, fit_model, maximise, probabilities
from analysis.scaling.conjugate_gradients import SparseItems, items_design
from analysis.scaling.designs import ITEMS
from analysis.scaling.fitting import fit_sparse
from analysis.scaling.penalty import NO_PENALTY, Gaussian
from tests.choice import nightly


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
