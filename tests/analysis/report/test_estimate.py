"""Which scores, intervals and standard errors the report shows, held against the rooms that they come from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from analysis.bootstrap.confidence_intervals import intervals
from analysis.bootstrap.replicates import resample
from analysis.bootstrap.stability import Covariance
from analysis.classes.classes import classify
from analysis.comparisons.session_comparisons import from_sessions
from analysis.errors import ResultsError
from analysis.records.session_record import SessionLog
from analysis.report.summary import summarise
from analysis.scaling.fitting import fit_model
from analysis.scaling.learnt_prior import learnt_posterior

Maker = Callable[..., SessionLog]


def many(make_session: Maker, count: int, **header: object) -> list[SessionLog]:
    return [make_session(f"{number:02d}", **header) for number in range(1, count + 1)]


@pytest.mark.parametrize(("observers", "expected"), [(9, "model"), (10, "sandwich")])
def test_ten_observers_are_enough_for_errors_clustered_by_observer(
    make_session: Maker, observers: int, expected: str
) -> None:
    found = summarise(many(make_session, observers), covariance="auto").estimate
    assert found.method == "ml"
    assert found.covariance == expected
    assert found.df == (observers - 1 if expected == "sandwich" else None)


def test_many_stimuli_are_told_apart_by_the_model_and_their_draws_not_classed(make_session: Maker) -> None:
    for count, covariance, classed in ((30, "sandwich", True), (31, "sandwich", False), (61, "model", False)):
        names = [f"{number:02d}" for number in range(count)]
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
    with pytest.raises(ResultsError, match="covariance is 'robust'"):
        summarise(many(make_session, 2, analysis={"covariance": "robust"}))


def test_intervals_are_the_bootstraps_in_the_order_of_the_scores(make_session: Maker) -> None:
    sessions = many(make_session, 15)
    summary = summarise(sessions)
    found = intervals(resample(from_sessions(sessions)), "log10_score")
    ends = {names[0]: (low, high) for names, low, high in zip(found.names, found.low, found.high, strict=True)}
    assert summary.estimate.interval_kind == "expanded-bca"
    for item, (low, high) in zip(summary.scores.items, summary.log10_interval, strict=True):
        assert (low, high) == pytest.approx(ends[item.name])
        assert item.log10_score is not None
        assert low < item.log10_score < high


def test_one_observer_has_the_models_intervals_and_no_stability(make_session: Maker) -> None:
    names = "abc"
    answers = [pair for one, other in combinations(names, 2) for pair in ((one, other), (other, one), (one, other))]
    found = summarise([make_session(names=names, answers=answers)], covariance="sandwich").estimate
    assert (found.interval_kind, found.covariance, found.stability) == ("model", "model", None)


def test_pairs_chosen_by_the_answers_are_scored_under_the_learnt_prior(make_session: Maker) -> None:
    plain = make_session()
    chosen = replace(plain, answers=tuple(replace(trial, kind="active_pairs") for trial in plain.answers))
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


def test_stability_uses_the_same_standard_errors_as_the_classes(make_session: Maker) -> None:
    wishes: tuple[Covariance, ...] = ("model", "sandwich")
    for wish in wishes:
        found = summarise(many(make_session, 10), covariance=wish).estimate
        assert found.stability is not None
        assert found.stability.covariance == found.covariance == wish
