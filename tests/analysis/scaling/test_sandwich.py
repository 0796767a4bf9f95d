"""Covariances: sandwiches, shrunk ones, quasi-variances, and Thurstone's two kinds of information."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import minimize

from analysis.choices import CovarianceChoice
from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.covariance import Clustered, Spread, shrink
from analysis.covariance.shrinkage import CLUSTERED, pseudo_inverses
from analysis.errors import ResultsError
from analysis.report import estimate_scores
from analysis.scaling import Model, Probit, fit, fit_model, score
from analysis.scaling import sandwich as sandwich_module
from analysis.scaling.laws import Davidson, Logistic
from analysis.scaling.quasi import quasi_variances
from analysis.scaling.sandwich import FEWEST_FREE, MOST_LEVERAGE, Contributions
from documents.arrays import Floats
from tests.kept import known

# The sandwich covariance against its definition, and where it must agree with the model's.

Drawer = Callable[..., Comparisons]
THETA = np.array([0.7, 0.0, -0.3, -0.4])


@pytest.mark.parametrize(
    ("law", "model"), [(Logistic(), "bradley-terry"), (Davidson(), "davidson"), (Probit(), "thurstone")]
)
def test_it_is_a_sum_over_observers(draw: Drawer, law: Logistic | Davidson | Probit, model: Model) -> None:
    """Each observer's gradient and information by finite differences of their own likelihood, answer by answer."""
    comparisons = draw(law, THETA, k=-0.3, order=0.2, observers=5)
    fitted = fit_model(comparisons, model, order_effect=True, covariance="model")
    robust = fit_model(comparisons, model, order_effect=True, covariance="sandwich")
    at = np.r_[fitted.theta, [parameter.estimate for parameter in fitted.parameters]]

    def own(values: np.ndarray, observer: int) -> float:
        theta, k, order = values[:4], values[4] if model == "davidson" else 0.0, values[-1]
        total = 0.0
        tied = comparisons.tied
        sources = [(comparisons.winner, comparisons.loser, comparisons.observer, comparisons.winner_was_first, 0)]
        sources += [(tied.item_a, tied.item_b, tied.observer, tied.a_was_first, 2)] if model == "davidson" else []
        for ones, others, people, firsts, outcome in sources:
            for one, other, person, first in zip(ones, others, people, firsts, strict=True):
                if person == observer:
                    d = np.array([theta[one] - theta[other] + (order if first else -order)])
                    total += float(np.log(law.probabilities(d, k)[outcome][0]))
        return total

    values, vectors = np.linalg.eigh(fitted.joint_covariance)
    root = vectors[:, 1:] * np.sqrt(values[1:])
    expected = np.zeros((len(at), len(at)))
    for observer in range(5):
        steps = np.eye(len(at)) * 1e-4

        def slope(values: np.ndarray, observer: int = observer, steps: np.ndarray = steps) -> np.ndarray:
            return np.array([(own(values + step, observer) - own(values - step, observer)) / 2e-4 for step in steps])

        information = -np.array([(slope(at + step) - slope(at - step)) / 2e-4 for step in steps])
        shares, axes = np.linalg.eigh(root.T @ (information + information.T) / 2 @ root)
        moved = root @ (axes / np.sqrt(1 - shares)) @ axes.T @ root.T @ slope(at)
        expected += np.outer(moved, moved)
    assert robust.joint_covariance == pytest.approx(expected, rel=1e-4, abs=1e-6)
    assert robust.theta == pytest.approx(fitted.theta, abs=1e-13)


@pytest.mark.parametrize(("people", "rank"), [(3, 5), (6, 6), (40, 3), (2, 1)])
def test_degrees_of_freedom_are_those_of_every_two_observers(people: int, rank: int) -> None:
    """Written out: P_st = k_s 1(s = t) u K_s/(1 − K_s) u − u K_s (1 − K_s)^(−1/2) K_t (1 − K_t)^(−1/2) u."""
    rng = np.random.default_rng(people)
    factors = rng.normal(size=(people, rank, rank))
    leverages = factors @ factors.transpose(0, 2, 1)
    values, vectors = np.linalg.eigh(leverages.sum(axis=0))
    half = vectors / np.sqrt(values) @ vectors.T
    leverages = half @ leverages @ half
    root = rng.normal(size=(rank + 1, rank))
    found = Contributions(np.zeros((people, rank + 1)), None, root, leverages, np.full(people, 1 / people))
    rows = rng.normal(size=(5, rank + 1))
    expected = []
    for u in rows @ root:
        together = np.zeros((people, people))
        moved, own = [], []
        for one in leverages:
            shares, axes = np.linalg.eigh(one)
            shares = np.clip(shares, 0, MOST_LEVERAGE)
            moved.append(axes @ np.diag(shares / np.sqrt(1 - shares)) @ axes.T @ u)
            own.append(u @ axes @ np.diag(shares / (1 - shares)) @ axes.T @ u)
        for s in range(people):
            for t in range(people):
                together[s, t] = (own[s] if s == t else 0) - moved[s] @ moved[t]
        expected.append(max(np.trace(together) ** 2 / (together**2).sum(), FEWEST_FREE))
    np.testing.assert_allclose(found.degrees_of_freedom(lambda: rows, len(rows)), expected, rtol=1e-10)


@pytest.mark.parametrize("alike", [True, False], ids=["one design", "leverages"])
@pytest.mark.parametrize("observers", [3, 40], ids=["fewer than items", "more than items"])
def test_what_is_kept_of_the_observers_products_gives_the_spread_that_all_of_them_give(
    draw: Drawer, observers: int, *, alike: bool
) -> None:
    """The slow, obvious twin has every two observers' d_s H d_t; of many observers none of that size is made."""
    whole = draw(Logistic(), THETA, observers=observers, seed=4)
    count = whole.count if alike else whole.count * np.random.default_rng(4).integers(1, 3, len(whole.count))
    clustered = known(fit_model(replace(whole, count=count)).clustered)
    each, spread = clustered.contributions, clustered.spread
    pulled = each.pulled[None]
    every_two = pulled @ pseudo_inverses(spread.model) @ pulled.transpose(0, 2, 1)
    twin = shrink(spread.model, pulled, "shrinkage", freedom=each.freedom, products=every_two)
    assert len(known(each.products)) <= len(THETA)
    assert (each.leverages is None) == alike
    assert spread.covariance == pytest.approx(twin.covariance, rel=1e-9, abs=1e-12)
    assert spread.dimensions == pytest.approx(twin.dimensions, rel=1e-9)


# Covariances clustered by observer against their formulas written out, against simulation, and fast against slow.

SHRINKAGE_THETA = np.array([0.9, 0.3, 0.0, -0.2, -1.0])


def contributed(n: int, observers: int, batch: int = 1, uneven: float = 1.0) -> tuple[Floats, Floats]:
    """Return a model's covariance and observers' contributions, which vary more along the first item."""
    random = np.random.default_rng(5)
    centre = np.eye(n) - 1 / n
    spread = random.standard_normal((n, n))
    model = centre @ (spread @ spread.T / n + np.eye(n)) @ centre
    root = np.linalg.cholesky(model + np.ones((n, n)) / n)
    pulled = random.standard_normal((batch, observers, n)) @ root.T
    pulled[..., 0] *= uneven
    pulled -= pulled.mean(axis=2, keepdims=True)
    return model[None], pulled / np.sqrt(observers - 1)


@pytest.mark.parametrize(("n", "observers"), [(4, 9), (6, 4)])
@pytest.mark.parametrize("uneven", [1.0, 4.0])
def test_the_weight_is_ledoit_and_wolfs_in_whitened_coordinates(n: int, observers: int, uneven: float) -> None:
    model, pulled = contributed(n, observers, 3, uneven)
    found = shrink(model, pulled, freedom=observers - 1)
    values, vectors = np.linalg.eigh(model[0])
    whiten = vectors[:, 1:] / np.sqrt(values[1:])
    colour = vectors[:, 1:] * np.sqrt(values[1:])
    p, nu = n - 1, observers - 1
    for study in range(3):
        each = pulled[study] @ whiten
        s = each.T @ each
        trace, square = np.trace(s), (s**2).sum()
        true_square = nu**2 / ((nu - 1) * (nu + 2)) * (square - trace**2 / nu)
        true_square = min(max(true_square, trace**2 / p), trace**2)
        error_of_s = (true_square + trace**2) / nu  # E |S − Σ|² of a Wishart matrix
        distance = ((s - np.eye(p) * trace / p) ** 2).sum()
        share = min(error_of_s / distance, 1.0) * (1 - 2 / observers)
        expected = colour @ ((1 - share) * s + share * trace / p * np.eye(p)) @ colour.T
        assert found.share[study] == pytest.approx(share, rel=1e-9)
        np.testing.assert_allclose(found.covariance[study], expected, atol=1e-9)
    if uneven > 1 and observers > 5:
        assert found.share.max() < 0.6


def test_products_at_hand_change_nothing() -> None:
    model, pulled = contributed(5, 7)
    products = pulled @ np.linalg.pinv(model[0]) @ pulled.transpose(0, 2, 1)
    for kind in CLUSTERED:
        plain, quick = shrink(model, pulled, kind, freedom=6), shrink(model, pulled, kind, freedom=6, products=products)
        np.testing.assert_allclose(quick.covariance, plain.covariance, atol=1e-10)
        np.testing.assert_allclose(quick.degrees_of_freedom(), plain.degrees_of_freedom(), rtol=1e-9)


@pytest.mark.parametrize("kind", CLUSTERED)
def test_degrees_of_freedom_are_those_of_simulated_variances(kind: Clustered) -> None:
    """Of normal contributions with the covariance that was found: twice its square over the variance of estimates."""
    n, observers, studies = 4, 8, 40_000
    model, pulled = contributed(n, observers, uneven=2.0)
    whole = shrink(model, pulled, kind, freedom=observers - 1)
    truth = whole.covariance[0]
    values, vectors = np.linalg.eigh(truth)
    root = vectors[:, 1:] * np.sqrt(values[1:])
    each = np.random.default_rng(1).standard_normal((studies, observers - 1, n - 1)) @ root.T / np.sqrt(observers - 1)
    drawn = each.transpose(0, 2, 1) @ each
    scale = np.einsum("ij,bji->b", np.linalg.pinv(model[0]), drawn) / (n - 1)
    share = whole.share[0]
    variance = (1 - share) * drawn + share * scale[:, None, None] * model
    first, second = np.triu_indices(n, 1)
    contrast = np.eye(n)[first] - np.eye(n)[second]
    of_pairs = np.einsum("pi,bij,pj->bp", contrast, variance, contrast)
    expected = 2 * np.einsum("pi,ij,pj->p", contrast, truth, contrast) ** 2 / of_pairs.var(axis=0)
    found = whole.degrees_of_freedom()[0]
    if kind == "scaled":  # of the truth that was drawn here all contrasts vary alike
        expected = expected * whole.dimensions[0] / (n - 1)
    np.testing.assert_allclose(found, expected, rtol=0.05)
    np.testing.assert_allclose(whole.degrees_of_freedom(contrast)[0], found, rtol=1e-9)


def unbalanced(draw: Drawer, observers: int = 9) -> Comparisons:
    """Return answers of which each observer gave a share that grows with their number."""
    whole = draw(Logistic(), SHRINKAGE_THETA, observers=observers, seed=2)
    random = np.random.default_rng(3)
    kept = random.random(len(whole.winner)) < np.linspace(0.3, 1, observers)[whole.observer]
    names, people = whole.items, whole.observers
    rows = zip(whole.winner[kept], whole.loser[kept], whole.observer[kept], whole.count[kept], strict=True)
    return from_answers([Answer(names[a], names[b], float(c), people[o]) for a, b, o, c in rows], names)


def test_where_all_answered_the_same_freedom_is_one_less_than_the_observers(draw: Drawer) -> None:
    fitted = fit_model(draw(Logistic(), SHRINKAGE_THETA, observers=7), covariance="sandwich")
    np.testing.assert_allclose(known(fitted.pair_freedom), 6, rtol=1e-12)


@pytest.mark.parametrize("kind", CLUSTERED)
def test_one_factor_for_each_observer_is_close_to_cr2(
    draw: Drawer, monkeypatch: pytest.MonkeyPatch, kind: Clustered
) -> None:
    comparisons = unbalanced(draw, 150)
    slow = fit_model(comparisons, covariance=kind)
    monkeypatch.setattr(sandwich_module, "MOST_WORK", 0.0)
    quick = fit_model(comparisons, covariance=kind)
    assert known(quick.clustered).contributions.leverages is None
    np.testing.assert_allclose(quick.se, slow.se, rtol=5e-3)
    np.testing.assert_allclose(known(quick.pair_freedom), known(slow.pair_freedom), rtol=0.1)


def test_observers_who_all_answer_alike_leave_a_finite_covariance() -> None:
    answers = [Answer(w, x, 1, o) for o in "1234" for w, x in ("ab", "ba", "bc", "cb", "ac", "ca")]
    fitted = fit_model(from_answers(answers))
    assert np.isfinite(fitted.covariance).all()
    assert known(fitted.clustered).to_json()["overdispersion"] == 0


@pytest.mark.parametrize("observers", [3, 5, 13, 30])
def test_freedom_of_observers_who_all_answer_alike_is_no_rounding(observers: int) -> None:
    """Nothing varies, so all contrasts alike. After Firth's fit rounding was left, and 14 degrees of freedom of 48."""
    ranking = [Answer(a, b, 1, str(who)) for a, b in combinations("ABCDE", 2) for who in range(observers)]
    for kind in CLUSTERED:
        clustered = known(score(from_answers(ranking), method="firth", covariance=kind).fit.clustered)
        assert (clustered.contributions.pulled == 0).all()
        assert clustered.pair_freedom == pytest.approx(np.full(10, (4 if kind == "scaled" else 1) * (observers - 1.0)))


def test_a_covariance_by_observer_needs_two_and_a_known_name(draw: Drawer) -> None:
    alone = draw(Logistic(), SHRINKAGE_THETA, observers=1)
    assert fit_model(alone).covariance_kind == "model"
    with pytest.raises(ResultsError, match="at least two observers"):
        fit_model(alone, covariance="shrinkage")
    with pytest.raises(ResultsError, match="no covariance 'robust'"):
        fit_model(alone, covariance="robust")  # type: ignore[arg-type]  # wrong on purpose


def test_a_spread_of_two_observers_is_a_third_the_scaled_covariance() -> None:
    model, pulled = contributed(4, 2)
    found: Spread = shrink(model, pulled, freedom=1)
    assert found.share[0] == pytest.approx(1 / 3)
    sandwich = pulled.transpose(0, 2, 1) @ pulled
    np.testing.assert_allclose(found.covariance, 2 / 3 * sandwich + found.scale[0] / 3 * model)


def test_the_largest_t_of_two_items_is_that_of_their_difference() -> None:
    model, pulled = contributed(2, 400)
    drawn = shrink(model, pulled, freedom=399).largest(2000, np.random.default_rng(3))
    assert np.quantile(drawn, 0.95) == pytest.approx(1.97, abs=0.12)


# Quasi-variances against R's qvcalc, and what must hold.

CITATIONS = np.array([[0, 730, 498, 221], [33, 0, 68, 17], [320, 813, 0, 142], [284, 276, 325, 0]], dtype=float)

PRINTED = np.array([0.00177417668, 0.00850747201, 0.00183576933, 0.00342411548])


def as_r_iterates(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """The iteration of R's glm for the same least squares, stopped where glm stops: deviance settled to 1e-8."""
    n = len(covariance)
    first, second = np.triu_indices(n, 1)
    variance = np.diag(covariance)[first] + np.diag(covariance)[second] - 2 * covariance[first, second]
    design = np.zeros((len(first), n))
    design[range(len(first)), first] = design[range(len(first)), second] = 1
    total, last = variance, np.inf
    while True:
        working = total * (1 + np.log(variance) - np.log(total))
        q = np.linalg.lstsq(design / total[:, None], working / total, rcond=None)[0]
        total = design @ q
        deviance = float(((np.log(variance) - np.log(total)) ** 2).sum())
        if abs(deviance - last) / (0.1 + deviance) < 1e-8:
            return np.asarray(q)
        last = deviance


def test_citations_have_the_quasi_variances_of_r() -> None:
    """R stops at 1e-8 in the deviance, some 4e-7 before the minimum: its digits are those of its own iteration."""
    covariance = fit(CITATIONS).covariance
    assert as_r_iterates(covariance) == pytest.approx(PRINTED, rel=5e-9)
    found = quasi_variances(covariance)
    assert found.converged
    assert found.variances == pytest.approx(PRINTED, rel=4e-7)


def test_the_worst_errors_are_those_of_some_pair() -> None:
    covariance = fit(CITATIONS).covariance
    found = quasi_variances(covariance)
    errors = []
    for i in range(4):
        for j in range(i):
            exact = covariance[i, i] + covariance[j, j] - 2 * covariance[i, j]
            errors.append(np.sqrt((found.variances[i] + found.variances[j]) / exact) - 1)
    assert (found.worst_below, found.worst_above) == pytest.approx((min(errors), max(errors)), rel=1e-12)
    assert -0.05 < found.worst_below < 0 < found.worst_above < 0.05


@given(st.lists(st.floats(1e-3, 1e3), min_size=3, max_size=8), st.floats(-10, 10))
def test_independent_estimates_keep_their_variances(variances: list[float], shared: float) -> None:
    found = quasi_variances(np.diag(variances) + shared)
    assert found.converged
    assert found.variances == pytest.approx(variances, rel=1e-6, abs=1e-9 * max(variances))


@settings(max_examples=15)
@given(st.integers(0, 10_000), st.integers(3, 7))
def test_they_are_the_least_squares_of_the_logarithms(seed: int, n: int) -> None:
    random = np.random.default_rng(seed)
    root = random.normal(size=(n, n + 2))
    covariance = root @ root.T
    found = quasi_variances(covariance)
    first, second = np.triu_indices(n, 1)
    target = np.log(np.diag(covariance)[first] + np.diag(covariance)[second] - 2 * covariance[first, second])

    def loss(q: np.ndarray) -> float:
        total = q[first] + q[second]
        return float(((np.log(total) - target) ** 2).sum()) if (total > 0).all() else 1e9

    best = minimize(loss, found.variances, method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-14})
    assert loss(found.variances) <= best.fun + 1e-9
    order = random.permutation(n)
    turned = quasi_variances(covariance[np.ix_(order, order)])
    assert turned.variances == pytest.approx(found.variances[order], rel=1e-6, abs=1e-8)


def test_two_items_and_estimates_without_error_are_refused() -> None:
    with pytest.raises(ResultsError, match="there are 2 items"):
        quasi_variances(np.eye(2))
    with pytest.raises(ResultsError, match="no finite, positive variance"):
        quasi_variances(np.zeros((3, 3)))
    with pytest.raises(ResultsError, match="no finite, positive variance"):
        quasi_variances(np.full((3, 3), np.nan))


# Who prefers neither throughout has no answer to a model without ties, and counts for no covariance there.

ANSWERS = [Answer("a", "b", 3, "01"), Answer("b", "a", 1, "01"), Answer("a", "b", 4, "02", tie=True)]


def test_one_observer_with_preferences_has_the_model_s_covariance() -> None:
    assert fit_model(from_answers(ANSWERS)).covariance_kind == "model"
    assert fit_model(from_answers(ANSWERS), "davidson").covariance_kind != "model"


@pytest.mark.parametrize("choice", ["auto", "sandwich", "shrinkage", "scaled", "model"])
@pytest.mark.parametrize("answers", [ANSWERS, [ANSWERS[0], ANSWERS[2]]])
def test_a_report_on_them_has_scores(choice: CovarianceChoice, answers: list[Answer]) -> None:
    estimate = estimate_scores(from_answers(answers), alpha=0.05, adjust="holm", covariance=choice)
    assert estimate.covariance == "model"
