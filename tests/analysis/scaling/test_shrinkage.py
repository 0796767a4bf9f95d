"""Covariances clustered by observer against their formulas written out, against simulation, and fast against slow."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.covariance import Clustered, Spread, shrink
from analysis.covariance.shrinkage import CLUSTERED
from analysis.errors import ResultsError
from analysis.scaling import fit_model, score
from analysis.scaling import sandwich as sandwich_module
from analysis.scaling.laws import Logistic
from benchmarks.simulated_studies import Design, decisions
from documents.arrays import Floats

Drawer = Callable[..., Comparisons]
THETA = np.array([0.9, 0.3, 0.0, -0.2, -1.0])


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
    whole = draw(Logistic(), THETA, observers=observers, seed=2)
    random = np.random.default_rng(3)
    kept = random.random(len(whole.winner)) < np.linspace(0.3, 1, observers)[whole.observer]
    names, people = whole.items, whole.observers
    rows = zip(whole.winner[kept], whole.loser[kept], whole.observer[kept], whole.count[kept], strict=True)
    return from_answers([Answer(names[a], names[b], float(c), people[o]) for a, b, o, c in rows], names)


def test_freedom_of_an_unbalanced_design_is_satterthwaites_by_simulation(draw: Drawer) -> None:
    """Observers' gradients are drawn from their own information, and the fit follows them as it does in truth."""
    fitted = fit_model(unbalanced(draw), covariance="sandwich")
    assert fitted.clustered is not None
    each = fitted.clustered.contributions
    assert each.leverages is not None
    assert each.root is not None
    people, rank, _ = each.leverages.shape
    random, studies = np.random.default_rng(4), 20_000
    values, axes = np.linalg.eigh(each.leverages)
    roots = axes * np.sqrt(np.maximum(values, 0))[:, None, :]
    drawn = np.einsum("srt,bst->bsr", roots, random.standard_normal((studies, people, rank)))
    follows = drawn - np.einsum("srt,bt->bsr", each.leverages, drawn.sum(axis=1))
    stretch = (axes / np.sqrt(1 - np.clip(values, 0, 0.99))[:, None, :]) @ axes.transpose(0, 2, 1)
    first, second = np.triu_indices(len(THETA), 1)
    along = each.root[first] - each.root[second]
    moved = np.einsum("srt,bst->bsr", stretch, follows) @ along.T
    variance = (moved**2).sum(axis=1)
    np.testing.assert_allclose(variance.mean(axis=0), (along**2).sum(axis=1), rtol=0.03)  # CR2 is right on average
    expected = 2 * variance.mean(axis=0) ** 2 / variance.var(axis=0)
    assert fitted.pair_freedom is not None
    np.testing.assert_allclose(fitted.pair_freedom, expected, rtol=0.05)
    assert fitted.pair_freedom.max() < people - 1


def test_where_all_answered_the_same_freedom_is_one_less_than_the_observers(draw: Drawer) -> None:
    fitted = fit_model(draw(Logistic(), THETA, observers=7), covariance="sandwich")
    assert fitted.pair_freedom is not None
    np.testing.assert_allclose(fitted.pair_freedom, 6, rtol=1e-12)


@pytest.mark.parametrize("kind", CLUSTERED)
def test_one_factor_for_each_observer_is_close_to_cr2(
    draw: Drawer, monkeypatch: pytest.MonkeyPatch, kind: Clustered
) -> None:
    comparisons = unbalanced(draw, 150)
    slow = fit_model(comparisons, covariance=kind)
    monkeypatch.setattr(sandwich_module, "MOST_WORK", 0.0)
    quick = fit_model(comparisons, covariance=kind)
    assert quick.clustered is not None
    assert quick.clustered.contributions.leverages is None
    np.testing.assert_allclose(quick.se, slow.se, rtol=5e-3)
    assert quick.pair_freedom is not None
    assert slow.pair_freedom is not None
    np.testing.assert_allclose(quick.pair_freedom, slow.pair_freedom, rtol=0.1)


def test_observers_who_all_answer_alike_leave_a_finite_covariance() -> None:
    answers = [Answer(w, x, 1, o) for o in "1234" for w, x in ("ab", "ba", "bc", "cb", "ac", "ca")]
    fitted = fit_model(from_answers(answers))
    assert np.isfinite(fitted.covariance).all()
    assert fitted.clustered is not None
    assert fitted.clustered.to_json()["overdispersion"] == 0


@pytest.mark.parametrize("observers", [3, 5, 13, 30])
def test_freedom_of_observers_who_all_answer_alike_is_no_rounding(observers: int) -> None:
    """Nothing varies, so all contrasts alike. After Firth's fit rounding was left, and 14 degrees of freedom of 48."""
    ranking = [Answer(a, b, 1, str(who)) for a, b in combinations("ABCDE", 2) for who in range(observers)]
    for kind in CLUSTERED:
        clustered = score(from_answers(ranking), method="firth", covariance=kind).fit.clustered
        assert clustered is not None
        assert (clustered.contributions.pulled == 0).all()
        assert clustered.pair_freedom == pytest.approx(np.full(10, (4 if kind == "scaled" else 1) * (observers - 1.0)))


def test_a_covariance_by_observer_needs_two_and_a_known_name(draw: Drawer) -> None:
    alone = draw(Logistic(), THETA, observers=1)
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


@pytest.mark.nightly
def test_two_observers_who_agree_about_a_pair_do_not_set_it_apart() -> None:
    found = decisions(Design(np.zeros(10), 2), studies=300)
    assert found.false_difference < 0.02  # 0.067 by the sandwich
    assert found.differences > 0.95  # 0.887 by the sandwich
