"""The fit against oracles from R, and what must hold for any counts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.special import log_expit

from analysis.errors import ResultsError
from analysis.scaling import LOGISTIC, Counts, fit, probabilities
from analysis.scaling.fitting import fit_batch
from analysis.scaling.penalty import FIRTH
from documents.arrays import Floats

# Agresti's citation counts and a separated table, fitted in R (BradleyTerry2, brglm2).
CITATIONS = np.array([[0, 730, 498, 221], [33, 0, 68, 17], [320, 813, 0, 142], [284, 276, 325, 0]], dtype=float)
SEPARATION = np.array([[0, 10, 10, 10], [0, 0, 6, 7], [0, 4, 0, 5], [0, 3, 5, 0]], dtype=float)
# Medina 2016, Table 4.4, samples 8 2 7 1 5 9 3 10 4 6.
PRINTED = np.array([0.0296, 0.0432, 0.0543, 0.0718, 0.0740, 0.0751, 0.0762, 0.1149, 0.2036, 0.2574])


def expected_counts(theta: Floats, count: float) -> Floats:
    wins = count * probabilities(theta)
    np.fill_diagonal(wins, 0)
    return wins


def counts(n: int = 5) -> st.SearchStrategy[Floats]:
    """Counts of which every one is positive, so that a maximum exists."""
    number = st.integers(1, 50)
    return st.lists(number, min_size=n * n, max_size=n * n).map(
        lambda values: np.array(values, dtype=float).reshape(n, n) * (1 - np.eye(n))
    )


def penalised_log_likelihood(wins: Floats, theta: Floats) -> float:
    counts = Counts.from_wins(wins[None])
    d = counts.differences(theta[None])
    added = FIRTH.value(counts, theta[None], lambda: LOGISTIC.slopes(counts, d, 0.0))
    return float(LOGISTIC.log_likelihood(counts, d, 0.0).sum() + added[0])


def test_citations_have_the_strengths_deviance_and_variances_of_r() -> None:
    fitted = fit(CITATIONS)
    relative = fitted.theta - fitted.theta[0]
    assert relative[1:] == pytest.approx([-2.949072497, -0.479569770, 0.268954056], abs=5e-10)
    assert fitted.deviance == pytest.approx(4.29338397, abs=5e-9)
    assert fitted.df == 3
    contrast = [
        np.sqrt(fitted.covariance[i, i] + fitted.covariance[0, 0] - 2 * fitted.covariance[i, 0]) for i in (1, 2, 3)
    ]
    assert contrast == pytest.approx([0.1025453354, 0.0605887292, 0.0708299651], abs=5e-10)
    assert fitted.converged
    assert not fitted.separated


def test_citations_have_the_penalised_strengths_of_r() -> None:
    fitted = fit(CITATIONS, method="firth")
    assert (fitted.theta - fitted.theta[0])[1:] == pytest.approx([-2.944381822, -0.479075261, 0.268531023], abs=5e-10)
    assert fitted.converged


def test_an_item_that_always_wins_is_named_and_not_fitted() -> None:
    fitted = fit(SEPARATION)
    assert fitted.separated == ((0,), (1, 2, 3))
    assert fitted.separated_items == (0,)
    assert not fitted.converged
    assert np.isnan(fitted.theta).all()


def test_the_penalised_fit_holds_an_item_that_always_wins() -> None:
    fitted = fit(SEPARATION, method="firth")
    assert (fitted.theta - fitted.theta[0])[1:] == pytest.approx([-3.724479, -4.238820, -4.367469], abs=5e-7)
    assert fitted.converged
    assert not fitted.separated


def test_table_4_4_gives_back_its_scores() -> None:
    fitted = fit(expected_counts(np.log(PRINTED), 30))
    assert fitted.score == pytest.approx(PRINTED / PRINTED.sum(), abs=1e-12)
    assert [f"{value:.4f}" for value in fitted.score] == [f"{value:.4f}" for value in PRINTED]
    assert fitted.deviance == pytest.approx(0, abs=1e-10)
    assert fitted.df == 36
    assert fitted.score.sum() == pytest.approx(1, abs=1e-14)
    assert fitted.log10_score == pytest.approx(np.log10(fitted.score), abs=1e-14)


def test_two_items_have_the_logit_and_its_error() -> None:
    fitted = fit(np.array([[0.0, 9.0], [3.0, 0.0]]))
    assert fitted.theta[0] - fitted.theta[1] == pytest.approx(np.log(3), abs=1e-14)
    # The variance of a logit is 1/9 + 1/3; each centred strength carries half of the contrast.
    assert fitted.se == pytest.approx(np.full(2, np.sqrt(1 / 9 + 1 / 3) / 2), abs=1e-14)


@given(counts())
def test_the_fit_agrees_with_a_general_minimiser(wins: Floats) -> None:
    def loss(free: Floats) -> float:
        theta = np.append(free, 0)
        return -float((wins * log_expit(theta[:, None] - theta[None, :])).sum())

    found = minimize(loss, np.zeros(4), method="BFGS", options={"gtol": 1e-7})
    theta = np.append(found.x, 0)
    fitted = fit(wins)
    assert fitted.theta == pytest.approx(theta - theta.mean(), abs=1e-5)
    assert fitted.log_likelihood >= -found.fun - 1e-9
    assert fitted.log_likelihood == pytest.approx(-loss(fitted.theta[:4] - fitted.theta[4]), rel=1e-12)


@given(counts(), st.permutations(range(5)))
def test_the_order_of_the_items_does_not_matter(wins: Floats, order: list[int]) -> None:
    straight, shuffled = fit(wins), fit(wins[np.ix_(order, order)])
    assert shuffled.theta == pytest.approx(straight.theta[order], abs=1e-12)
    assert shuffled.covariance == pytest.approx(straight.covariance[np.ix_(order, order)], rel=1e-9, abs=1e-12)
    assert shuffled.deviance == pytest.approx(straight.deviance, rel=1e-9, abs=1e-9)


@given(counts())
def test_losses_instead_of_wins_turn_the_scale_round(wins: Floats) -> None:
    assert fit(wins.T).theta == pytest.approx(-fit(wins).theta, abs=1e-12)


@given(counts(), st.floats(1e-3, 1e3))
def test_more_of_the_same_answers_shrinks_the_errors_and_nothing_else(wins: Floats, factor: float) -> None:
    once, more = fit(wins), fit(wins * factor)
    assert more.theta == pytest.approx(once.theta, abs=1e-11)
    assert more.se == pytest.approx(once.se / np.sqrt(factor), rel=1e-10)


@settings(max_examples=25)
@given(counts())
def test_the_penalised_fit_is_at_a_maximum(wins: Floats) -> None:
    fitted = fit(wins, method="firth")
    top = penalised_log_likelihood(wins, fitted.theta)
    for index in range(5):
        for step in (-1e-3, 1e-3):
            aside = fitted.theta.copy()
            aside[index] += step
            assert penalised_log_likelihood(wins, aside) < top


@settings(max_examples=25)
@given(st.lists(counts(4), min_size=1, max_size=20))
def test_a_batch_gives_what_single_fits_give(replicates: list[Floats]) -> None:
    batch = fit_batch(np.array(replicates))
    for number, wins in enumerate(replicates):
        single = fit(wins)
        assert batch.theta[number] == pytest.approx(single.theta, abs=1e-12)
        assert batch.log_likelihood[number] == pytest.approx(single.log_likelihood, rel=1e-12)
        assert batch.converged[number]


def test_a_batch_reports_each_separated_replicate_and_solves_the_others() -> None:
    batch = fit_batch(np.array([CITATIONS, SEPARATION, CITATIONS.T]))
    assert batch.separated.tolist() == [False, True, False]
    assert batch.converged.tolist() == [True, False, True]
    assert np.isnan(batch.theta[1]).all()
    assert batch.theta[0] == pytest.approx(fit(CITATIONS).theta, abs=1e-13)
    assert batch.theta[2] == pytest.approx(-batch.theta[0], abs=1e-12)


def test_pairs_that_were_never_compared_count_for_nothing() -> None:
    ring = np.zeros((5, 5))
    for first, second in pairwise([0, 1, 2, 3, 4, 0]):
        ring[first, second], ring[second, first] = 2, 1
    fitted = fit(ring)
    assert fitted.df == 1
    assert fitted.theta == pytest.approx(np.zeros(5), abs=1e-14)


@pytest.mark.parametrize(
    ("wins", "what"),
    [
        ([[0, 1, 2], [1, 0, 2]], "shape"),
        ([[0.0]], "shape"),
        ([[0, -1], [1, 0]], "negative"),
        ([[0, np.nan], [1, 0]], "NaN"),
        ([[0, np.inf], [1, 0]], "infinite"),
        ([[1, 2], [1, 0]], "diagonal"),
    ],
)
def test_counts_that_are_no_counts_are_refused(wins: list[list[float]], what: str) -> None:
    with pytest.raises(ResultsError, match=what):
        fit(np.array(wins, dtype=float))
