"""Fits against published tables, oracles from R, plain minimisers, and what must hold for any answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.special import log_expit, ndtr
from scipy.stats import chi2, norm

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.scaling import MODELS, Model, Probit, fit, fit_model, probabilities, score
from analysis.scaling.fitting import fit_batch
from analysis.scaling.laws import Davidson, Law, Logistic, RaoKupper
from documents.arrays import Floats
from runner.reports.demo import agreement, expected_classes
from tests.choice import nightly
from tests.kept import known

# Fits against published tables, plain minimisers, and what must hold for any answers.

Drawer = Callable[..., Comparisons]
LAWS: dict[Model, Law] = {
    "bradley-terry": Logistic(),
    "davidson": Davidson(),
    "rao-kupper": RaoKupper(),
    "thurstone": Probit(),
}
NAMES = "abcd"


def answers_of_all_kinds() -> st.SearchStrategy[Comparisons]:
    """Answers to every pair of four items in both orders, of all three kinds, by two observers."""
    orders = [(one, other) for one in NAMES for other in NAMES if one != other]
    counts = st.lists(st.integers(1, 20), min_size=3 * len(orders), max_size=3 * len(orders))

    def made(numbers: list[int]) -> Comparisons:
        answers = []
        for place, (first, second) in enumerate(orders):
            won, lost, tied = numbers[3 * place : 3 * place + 3]
            observer = f"{place % 2}"
            answers.append(Answer(first, second, won, observer, first))
            answers.append(Answer(second, first, lost, observer, first))
            answers.append(Answer(first, second, tied, observer, first, tie=True))
        return from_answers(answers, NAMES)

    return counts.map(made)


def chances(model: Model, d: float, k: float) -> tuple[float, float, float]:
    """The laws again, as in their papers."""
    a, b = np.exp(d), 1.0
    if model == "thurstone":
        return float(ndtr(d)), float(ndtr(-d)), 0.0
    if model == "davidson":
        total = a + b + np.exp(k) * np.sqrt(a * b)
        return a / total, b / total, np.exp(k) * np.sqrt(a * b) / total
    if model == "rao-kupper":
        first, second = a / (a + np.exp(k) * b), b / (b + np.exp(k) * a)
        return first, second, 1 - first - second
    return a / (a + b), b / (a + b), 0.0


def slow_loss(comparisons: Comparisons, model: Model, order_effect: bool) -> Callable[[Floats], float]:
    """Minus the log likelihood, answer by answer, of θ but the last, then k, then δ."""
    n, ties = len(comparisons.items), model in ("davidson", "rao-kupper")

    def loss(free: Floats) -> float:
        theta = np.append(free[: n - 1], 0.0)
        k = float(free[n - 1]) if ties else 0.0
        shift = float(free[-1]) if order_effect else 0.0
        total = 0.0
        if model == "rao-kupper" and k <= 0:
            return 1e4 * (1 - k)  # no such law: a slope that leads back
        for winner, loser, count, first in zip(
            comparisons.winner, comparisons.loser, comparisons.count, comparisons.winner_was_first, strict=True
        ):
            d = theta[winner] - theta[loser] + (shift if first == 1 else -shift)
            total += count * np.log(chances(model, d, k)[0])
        tied = comparisons.tied
        for one, other, count, first in zip(tied.item_a, tied.item_b, tied.count, tied.a_was_first, strict=True):
            if ties:
                d = theta[one] - theta[other] + (shift if first == 1 else -shift)
                total += count * np.log(chances(model, d, k)[2])
        return -total

    return loss


def curvature(loss: Callable[[Floats], float], at: Floats, h: float = 1e-4) -> Floats:
    size = len(at)
    steps = np.eye(size) * h
    matrix = np.empty((size, size))
    for i in range(size):
        for j in range(size):
            matrix[i, j] = (
                loss(at + steps[i] + steps[j])
                - loss(at + steps[i] - steps[j])
                - loss(at - steps[i] + steps[j])
                + loss(at - steps[i] - steps[j])
            ) / (4 * h * h)
    return matrix


def test_pudding_has_the_worths_ties_and_deviance_of_davidson(pudding: Comparisons) -> None:
    fitted = fit_model(pudding, "davidson")
    worth = np.exp(fitted.theta) / np.exp(fitted.theta).sum()
    assert worth == pytest.approx([0.138803, 0.173002, 0.161747, 0.165373, 0.158685, 0.202389], abs=5.01e-7)
    (nu,) = fitted.parameters
    assert nu.to_json()["factor"] == pytest.approx(np.exp(nu.estimate))
    assert replace(nu, se=1e4).to_json()["factor_high"] is None
    assert nu.name == "nu"
    assert known(nu.factor)[0] == pytest.approx(0.746823, abs=5.01e-7)
    assert fitted.goodness is not None
    assert fitted.goodness.deviance == pytest.approx(15.770406, abs=5.01e-7)
    assert fitted.goodness.df == 24
    assert fitted.goodness.p_deviance == pytest.approx(chi2.sf(15.770406, 24), rel=1e-6)
    assert fitted.converged


@pytest.mark.parametrize(
    ("model", "order_effect"),
    [*((model, model in ("davidson", "bradley-terry")) for model in MODELS), *nightly(*product(MODELS, (False, True)))],
)
def test_a_fit_is_what_a_plain_minimiser_finds_and_its_covariance_the_inverse_curvature(
    draw: Drawer, model: Model, order_effect: bool
) -> None:
    theta = np.array([0.6, 0.0, -0.4, -0.2])
    comparisons = draw(LAWS[model], theta, k=0.4, order=0.3, observers=6)
    fitted = fit_model(comparisons, model, order_effect=order_effect, covariance="model")
    loss = slow_loss(comparisons, model, order_effect)
    start = np.append(np.zeros(3), [0.5] * (model in ("davidson", "rao-kupper")) + [0.0] * order_effect)
    found = minimize(loss, start, method="BFGS", options={"gtol": 1e-6})
    strengths = np.append(found.x[:3], 0.0)
    assert fitted.theta == pytest.approx(strengths - strengths.mean(), abs=2e-5)
    assert [parameter.estimate for parameter in fitted.parameters] == pytest.approx(found.x[3:], abs=2e-5)
    assert fitted.log_likelihood == pytest.approx(-found.fun, abs=1e-8)
    free = np.r_[fitted.theta[:3] - fitted.theta[3], [parameter.estimate for parameter in fitted.parameters]]
    expected = np.linalg.inv(curvature(loss, free))
    to_free = np.zeros((len(free), len(fitted.joint_covariance)))
    to_free[:3, :3], to_free[:3, 3] = np.eye(3), -1
    to_free[3:, 4:] = np.eye(len(free) - 3)
    assert to_free @ fitted.joint_covariance @ to_free.T == pytest.approx(expected, rel=2e-4, abs=1e-6)
    assert [parameter.se for parameter in fitted.parameters] == pytest.approx(np.sqrt(np.diag(expected))[3:], rel=2e-4)


@settings(max_examples=12)
@given(answers_of_all_kinds())
def test_without_ties_and_order_it_is_the_plain_fit(comparisons: Comparisons) -> None:
    plain, general = fit(comparisons.wins), fit_model(comparisons, covariance="model")
    assert general.theta == pytest.approx(plain.theta, abs=1e-11)
    assert general.covariance == pytest.approx(plain.covariance, abs=1e-11)
    assert general.log_likelihood == pytest.approx(plain.log_likelihood, rel=1e-12)
    assert known(general.goodness).deviance == pytest.approx(plain.deviance, abs=1e-9)
    assert known(general.goodness).df == plain.df
    assert general.ties_left_out == comparisons.ties
    penalised = fit_model(comparisons, method="firth", covariance="model")
    plainly = fit(comparisons.wins, method="firth")
    assert penalised.theta == pytest.approx(plainly.theta, abs=1e-12)
    assert penalised.covariance == pytest.approx(plainly.covariance, abs=1e-11)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("factor", [1e-3, 1e9])
def test_more_of_the_same_answers_shrinks_the_errors_and_nothing_else(
    pudding: Comparisons, model: Model, factor: float
) -> None:
    tied = replace(pudding.tied, count=pudding.tied.count * factor)
    scaled = replace(pudding, count=pudding.count * factor, tied=tied)
    once, more = fit_model(pudding, model), fit_model(scaled, model)
    assert more.converged
    assert more.theta == pytest.approx(once.theta, abs=1e-11)
    assert more.se == pytest.approx(once.se / np.sqrt(factor), rel=1e-9)


def test_two_items_have_closed_forms() -> None:
    answers = [Answer("a", "b", 9), Answer("b", "a", 3), Answer("a", "b", 6, tie=True)]
    comparisons = from_answers(answers)
    gap = {model: float(np.subtract(*fit_model(comparisons, model).theta)) for model in MODELS}
    assert gap["bradley-terry"] == pytest.approx(np.log(3))
    assert gap["davidson"] == pytest.approx(np.log(3))
    assert gap["thurstone"] == pytest.approx(norm.ppf(0.75))
    # p_first = 1/2 and p_second = 1/6: d − τ = 0 and −d − τ = −log 5.
    assert gap["rao-kupper"] == pytest.approx(np.log(5) / 2)
    (nu,) = fit_model(comparisons, "davidson").parameters
    assert nu.estimate == pytest.approx(np.log(6 / np.sqrt(27)))
    (eta,) = fit_model(comparisons, "rao-kupper").parameters
    assert eta.estimate == pytest.approx(np.log(5) / 2)


def test_an_order_effect_comes_back_and_its_test_tells_it_from_none(draw: Drawer) -> None:
    theta = np.array([0.8, 0.1, -0.3, -0.6])
    for law, model in ((Logistic(), "bradley-terry"), (Davidson(), "davidson")):
        with_effect = draw(law, theta, k=-0.5, order=0.5, observers=60)
        fitted = fit_model(with_effect, model, order_effect=True, covariance="model")
        order = fitted.parameters[-1]
        assert order.name == "order"
        assert abs(order.estimate - 0.5) < 3.5 * order.se
        assert order.low > 0
        assert known(fitted.order_test).p < 1e-6
        assert known(fitted.order_test).statistic == pytest.approx((order.estimate / order.se) ** 2, rel=0.1)


@pytest.mark.stress
def test_the_order_test_is_uniform_where_there_is_no_order_effect(draw: Drawer) -> None:
    theta = np.array([0.5, 0.0, -0.5])
    p = []
    for seed in range(200):
        fitted = fit_model(draw(Logistic(), theta, observers=20, seed=seed), order_effect=True)
        p.append(known(fitted.order_test).p)
    # Binomial with 200 draws: four standard deviations about 20 at 0.1, and about 100 at 0.5.
    assert 3 <= sum(value < 0.1 for value in p) <= 37
    assert 72 <= sum(value < 0.5 for value in p) <= 128


@settings(max_examples=15, deadline=None)
@given(answers_of_all_kinds(), st.floats(0.05, 20))
def test_the_fit_under_a_prior_is_what_a_plain_maximiser_gives(comparisons: Comparisons, prior_sd: float) -> None:
    fitted = fit_model(comparisons, method="map", prior_sd=prior_sd)
    wins, n = comparisons.wins, len(comparisons.items)

    def loss(theta: Floats) -> float:
        return float(
            (wins * np.logaddexp(0, theta[None, :] - theta[:, None])).sum() + (theta**2).sum() / 2 / prior_sd**2
        )

    def slope(theta: Floats) -> Floats:
        lost = wins / (1 + np.exp(theta[:, None] - theta[None, :]))
        return np.asarray(lost.sum(axis=0) - lost.sum(axis=1) + theta / prior_sd**2)

    slow = minimize(loss, np.zeros(n), jac=slope, method="BFGS", options={"gtol": 1e-10}).x
    assert fitted.theta == pytest.approx(slow, abs=1e-5 * max(1.0, float(np.abs(slow).max())))
    p = 1 / (1 + np.exp(-(fitted.theta[:, None] - fitted.theta[None, :])))
    weight = (wins + wins.T) * p * p.T
    hessian = np.diag(weight.sum(axis=1)) - weight + np.eye(n) / prior_sd**2
    # On strengths that sum to zero, without σ²/n of their mean.
    expected = np.linalg.inv(hessian) - prior_sd**2 / n
    assert fitted.covariance == pytest.approx(expected, rel=1e-6, abs=1e-9 * prior_sd**2)
    assert fitted.log_posterior == pytest.approx(fitted.log_likelihood - (fitted.theta**2).sum() / (2 * prior_sd**2))
    assert fitted.held_by_prior is None


@pytest.mark.parametrize("model", ["bradley-terry", "thurstone"])
def test_groups_that_were_never_compared_differ_by_what_the_prior_says(model: Model) -> None:
    answers = [Answer("a", "b", 5), Answer("b", "a", 2), Answer("c", "d", 3), Answer("d", "e", 3), Answer("e", "c", 1)]
    fitted = fit_model(from_answers(answers), model, method="map", prior_sd=1.5)
    assert fitted.converged
    gap = np.array([1 / 2, 1 / 2, -1 / 3, -1 / 3, -1 / 3])
    assert gap @ fitted.theta == pytest.approx(0, abs=1e-10)
    assert np.sqrt(gap @ fitted.covariance @ gap) == pytest.approx(1.5 * np.sqrt(1 / 2 + 1 / 3), rel=1e-9)
    assert "'a', 'b': never compared" in known(fitted.held_by_prior).sentences[0]


@pytest.mark.parametrize("model", MODELS)
def test_the_prior_holds_an_item_that_always_wins(model: Model) -> None:
    answers = [Answer("a", "b", 5), Answer("b", "c", 2), Answer("c", "b", 3), Answer("b", "c", 1, tie=True)]
    fitted = fit_model(from_answers(answers), model, method="map", prior_sd=2)
    assert fitted.converged
    assert np.isfinite(fitted.theta).all()
    assert fitted.theta[0] == fitted.theta.max()
    assert fitted.held_by_prior is not None


@pytest.mark.parametrize("model", MODELS)
def test_strengths_thirty_units_apart_come_back(model: Model) -> None:
    theta = np.linspace(15, -15, 7) if model != "thurstone" else np.linspace(4, -4, 7)
    answers = []
    for one in range(7):
        for other in range(one + 1, 7):
            d = theta[one] - theta[other]
            first, second, neither = (float(p[0]) for p in LAWS[model].probabilities(np.array([d]), 0.5))
            names = f"{one}", f"{other}"
            answers += [Answer(*names, 30 * first), Answer(*names[::-1], 30 * second)]
            answers.append(Answer(*names, 30 * neither, tie=True))
    fitted = fit_model(from_answers(answers, "0123456"), model)
    assert fitted.converged
    assert fitted.theta == pytest.approx(theta, abs=1e-8)
    assert np.isfinite(fitted.se).all()
    assert known(fitted.goodness).deviance == pytest.approx(0, abs=1e-8)


@pytest.mark.parametrize(
    ("what", "changes"),
    [
        ("there is no model 'elo'", {"model": "elo"}),
        ("there is no method 'mcmc'", {"method": "mcmc"}),
        ("standard deviation is 0", {"method": "map", "prior_sd": 0.0}),
        ("standard deviation is nan", {"method": "map", "prior_sd": float("nan")}),
        ("do not say which item was shown first", {"order_effect": True}),
        ("at least two observers", {"covariance": "sandwich"}),
    ],
)
def test_what_cannot_be_fitted_is_refused(pudding: Comparisons, what: str, changes: dict[str, object]) -> None:
    with pytest.raises(ResultsError, match=what):
        fit_model(pudding, **changes)  # type: ignore[arg-type]  # wrong on purpose


def test_a_model_of_ties_needs_a_tie() -> None:
    with pytest.raises(ResultsError, match="no answer is a tie"):
        fit_model(from_answers([Answer("a", "b"), Answer("b", "a")]), "davidson")


# The fit against oracles from R, and what must hold for any counts.

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


@pytest.mark.parametrize(
    ("wins", "theirs", "digits"),
    [
        (CITATIONS, [-2.944381822, -0.479075261, 0.268531023], 5e-10),
        (SEPARATION, [-3.724479, -4.238820, -4.367469], 5e-7),  # the first always wins
    ],
)
def test_penalised_strengths_are_those_of_r(wins: Floats, theirs: list[float], digits: float) -> None:
    fitted = fit(wins, method="firth")
    assert (fitted.theta - fitted.theta[0])[1:] == pytest.approx(theirs, abs=digits)
    assert fitted.converged
    assert not fitted.separated


def test_an_item_that_always_wins_is_named_and_not_fitted() -> None:
    fitted = fit(SEPARATION)
    assert fitted.separated == ((0,), (1, 2, 3))
    assert fitted.separated_items == (0,)
    assert not fitted.converged
    assert np.isnan(fitted.theta).all()


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


# Fits of published tables of paired comparisons against the coefficients that were printed with them.
#
# The counts are facts, typed from the sources named; the R package BradleyTerry2 lists them too.

# Agresti 2002, Section 10.6: the American League, 1987. Home team: wins at home/away wins against each of the others.
TEAMS = ("Milwaukee", "Detroit", "Toronto", "New York", "Boston", "Cleveland", "Baltimore")
BASEBALL = {
    "Milwaukee": "4/3 4/2 4/3 6/1 4/2 6/0",
    "Detroit": "3/3 4/2 4/3 6/0 6/1 4/3",
    "Toronto": "2/5 4/3 2/4 4/3 4/2 6/0",
    "New York": "3/3 5/1 2/5 4/3 4/2 6/1",
    "Boston": "5/1 2/5 3/3 4/2 5/2 6/0",
    "Cleveland": "2/5 3/3 3/4 4/3 4/2 2/4",
    "Baltimore": "2/5 1/5 1/6 2/4 1/6 3/4",
}


def baseball() -> Comparisons:
    answers = []
    for home, row in BASEBALL.items():
        away = [team for team in TEAMS if team != home]
        for guest, counts in zip(away, row.split(), strict=True):
            at_home, abroad = map(float, counts.split("/"))
            answers += [Answer(home, guest, at_home, first=home), Answer(guest, home, abroad, first=home)]
    return from_answers([answer for answer in answers if answer.count], TEAMS)


def test_baseball_has_the_strengths_and_the_deviance_that_agresti_printed() -> None:
    fitted = fit_model(baseball(), covariance="model")
    relative = fitted.theta - fitted.theta[-1]
    assert relative == pytest.approx([1.581, 1.436, 1.294, 1.248, 1.108, 0.684, 0], abs=5.1e-4)
    assert fitted.deviance == pytest.approx(15.737, abs=5.1e-4)
    assert fitted.df == 15


def test_baseball_has_the_home_advantage_that_agresti_printed() -> None:
    home = fit_model(baseball(), order_effect=True, covariance="model").parameters[0]
    assert home.estimate == pytest.approx(0.302, abs=5.1e-4)
    assert home.se == pytest.approx(0.131, abs=5.1e-4)


Table = Mapping[str, tuple[float, str]]


def test_thirty_observers_give_the_thesis_s_classes_on_average(table_4_4: Table) -> None:
    published = {name: label for name, (_, label) in table_4_4.items()}
    assert expected_classes(table_4_4, 30, 0.045, "none") == published
    assert expected_classes(table_4_4, 30, 0.05, "none") != published


def _counts(table: Table) -> Comparisons:
    names = list(table)
    share = {(i, j): table[i][0] / (table[i][0] + table[j][0]) for i in names for j in names if i != j}
    return from_answers([Answer(i, j, count=30 * p) for (i, j), p in share.items()], names)


def test_expected_counts_agree_wholly(table_4_4: Table) -> None:
    found = known(agreement(score(_counts(table_4_4), alpha=0.045, adjust="none"), table_4_4))
    assert found.correlation == pytest.approx(1.0, abs=1e-9)
    assert (found.pairs_alike, found.pairs) == (45, 45)


def test_swapped_publications_do_not_agree(table_4_4: Table) -> None:
    scores = score(_counts(table_4_4), alpha=0.045, adjust="none")
    swapped = dict(zip(table_4_4, reversed(list(table_4_4.values())), strict=True))
    found = known(agreement(scores, swapped))
    assert found.correlation < 0
    assert found.pairs_alike < 45


def test_an_item_that_was_not_published_gives_no_agreement(table_4_4: Table) -> None:
    scores = score(_counts(table_4_4), alpha=0.045, adjust="none")
    assert agreement(scores, {"8": table_4_4["8"]}) is None
