"""Which scores, intervals and standard errors the report shows, held against the rooms that they come from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy import stats

from analysis.classes import classify
from analysis.comparisons import from_sessions
from analysis.records import SessionLog
from analysis.report.summary import summarise
from analysis.scaling import CovarianceKind, fit_model, learnt_posterior
from tests.answers import changed
from tests.choice import nightly

Maker = Callable[..., SessionLog]


def many(make_session: Maker, count: int, **header: object) -> list[SessionLog]:
    return [make_session(f"{number:02d}", **header) for number in range(1, count + 1)]


@pytest.mark.parametrize(("observers", "expected"), [(1, "model"), (2, "shrinkage"), *nightly((30, "shrinkage"))])
def test_two_observers_are_enough_for_errors_clustered_by_observer(
    make_session: Maker, observers: int, expected: str
) -> None:
    names = "abc"
    answers = [pair for one, other in combinations(names, 2) for pair in ((one, other), (other, one), (one, other))]
    sessions = [make_session(f"{number:02d}", names=names, answers=answers) for number in range(observers)]
    found = summarise(sessions, covariance="auto").estimate
    assert (found.method, found.covariance) == ("ml", expected)


@pytest.mark.parametrize(
    ("count", "covariance", "classed"),
    nightly((30, "shrinkage", True), (31, "shrinkage", False), (201, "scaled", False)),
)
def test_many_stimuli_have_no_shrinkage_and_their_draws_are_not_classed(
    make_session: Maker, count: int, covariance: str, classed: bool
) -> None:
    names = [f"{number:03d}" for number in range(count)]
    ring = [(one, other) for one, other in zip(names, names[1:] + names[:1], strict=True)]
    answers = ring + [(other, one) for one, other in ring]
    sessions = [make_session(f"{number:02d}", names=names, answers=answers) for number in range(10)]
    found = summarise(sessions).estimate
    assert (found.covariance, found.stability is not None) == (covariance, classed)


def test_classes_by_the_sandwich_are_those_of_its_covariance_and_students_law(make_session: Maker) -> None:
    sessions = many(make_session, 20)
    summary = summarise(sessions, 0.05, "holm", "sandwich")
    comparisons = from_sessions(sessions)
    fitted = fit_model(comparisons, covariance="sandwich")
    classes = classify(fitted.theta, fitted.covariance, alpha=0.05, adjust="holm", df=19)
    place = {name: index for index, name in enumerate(comparisons.items)}
    for item in summary.scores.items:
        assert item.label == classes.labels[place[item.name]]
        assert item.se == pytest.approx(fitted.se[place[item.name]], rel=1e-9)
    by_model = summarise(sessions, 0.05, "holm", "model")
    assert [item.se for item in by_model.scores.items] != [item.se for item in summary.scores.items]
    assert [item.score for item in by_model.scores.items] == [item.score for item in summary.scores.items]


def test_the_experiment_chooses_the_errors_and_the_reader_may_overrule_it(make_session: Maker) -> None:
    sessions = many(make_session, 12, analysis={"alpha": 0.05, "adjust": "holm", "covariance": "model"})
    assert summarise(sessions).estimate.covariance == "model"
    assert summarise(sessions, covariance="sandwich").estimate.covariance == "sandwich"


@pytest.mark.parametrize("covariance", ["shrinkage", *nightly("model", "scaled", "sandwich")])
def test_intervals_follow_by_the_delta_method(make_session: Maker, covariance: CovarianceKind) -> None:
    """The gradient by finite differences, the degrees of freedom of each log score by a contrast written out."""
    sessions = many(make_session, 15)
    summary = summarise(sessions, covariance=covariance)
    fitted, order = summary.scores.fit, list(summary.scores.order)
    step = 1e-6 * np.eye(len(order))

    def log10(theta: np.ndarray) -> np.ndarray:
        return np.asarray((theta - np.log(np.exp(theta).sum())) / np.log(10))

    gradient = np.array([(log10(fitted.theta + up) - log10(fitted.theta - up)) / 2e-6 for up in step]).T
    error = np.sqrt(np.diag(gradient @ fitted.covariance @ gradient.T))
    free = fitted.freedom(gradient * np.log(10))
    quantile = stats.norm.ppf(0.975) if free is None else stats.t.ppf(0.975, free)
    assert summary.log10_interval[:, 0] == pytest.approx((log10(fitted.theta) - quantile * error)[order], abs=1e-6)
    upper = np.minimum(log10(fitted.theta) + quantile * error, 0)
    assert summary.log10_interval[:, 1] == pytest.approx(upper[order], abs=1e-6)


def test_one_observer_has_the_models_intervals_and_no_stability(make_session: Maker) -> None:
    names = "abc"
    answers = [pair for one, other in combinations(names, 2) for pair in ((one, other), (other, one), (one, other))]
    found = summarise([make_session(names=names, answers=answers)], covariance="sandwich").estimate
    assert (found.covariance, found.stability) == ("model", None)


def test_pairs_chosen_by_the_answers_are_scored_under_the_learnt_prior(make_session: Maker) -> None:
    plain = make_session()
    chosen = replace(plain, answers=tuple(changed(trial, kind="active_pairs") for trial in plain.answers))
    summary = summarise([chosen])
    expected = learnt_posterior(from_sessions([chosen]).wins)
    order = list(summary.scores.order)
    assert summary.estimate.method == "learnt_prior"
    assert summary.estimate.prior_sd == expected.prior_sd
    centred = expected.theta - expected.theta.mean()
    assert [item.theta for item in summary.scores.items] == pytest.approx(centred[order].tolist())
    scores = [item.score or 0.0 for item in summary.scores.items]
    assert np.diff(scores).max() <= 1e-12  # equal scores stand in the order of their names, whatever their last bit
    assert sum(scores) == pytest.approx(1)
    assert any("chosen by the answers" in note for note in summary.notes)
    assert np.isfinite(summary.log10_interval).all()


def test_intervals_under_the_learnt_prior_are_as_wide_as_observers_differ(make_session: Maker) -> None:
    """Three of six observers always choose the other way; one observer alone has the posterior's own."""
    one, other = (("a", "b"), ("b", "c"), ("a", "c")), (("b", "a"), ("c", "b"), ("c", "a"))
    sessions = [
        make_session(observer=f"{number:02d}", names=("a", "b", "c"), answers=4 * (one if number % 2 else other))
        for number in range(6)
    ]
    chosen = [
        replace(each, answers=tuple(changed(trial, kind="active_pairs") for trial in each.answers)) for each in sessions
    ]
    scaled, model = (summarise(chosen, covariance=kind).estimate for kind in ("auto", "model"))
    assert (scaled.covariance, model.covariance) == ("scaled", "model")
    assert scaled.scores.fit.theta.tolist() == model.scores.fit.theta.tolist()
    factor = scaled.scores.fit.covariance / model.scores.fit.covariance
    assert factor.min() == pytest.approx(factor.max())
    assert factor.min() > 2
    wide, narrow = (np.diff(each.log10_interval, axis=1) for each in (scaled, model))
    assert (wide > 1.2 * narrow).all()
    alone = summarise(chosen[:1]).estimate
    assert (alone.covariance, alone.scores.fit.clustered) == ("model", None)


def test_stability_uses_the_same_standard_errors_as_the_classes(make_session: Maker) -> None:
    wishes: tuple[CovarianceKind, ...] = ("scaled", "sandwich")
    for wish in wishes:
        found = summarise(many(make_session, 6), covariance=wish).estimate
        assert found.stability is not None
        assert found.stability.covariance == found.covariance == wish
