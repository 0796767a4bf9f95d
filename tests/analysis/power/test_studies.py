"""Studies simulated and analysed a block at a time, beside the same done one by one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from analysis.bootstrap import intervals
from analysis.bootstrap.replicates import resample_counts
from analysis.choices import Adjust
from analysis.classes.multiplicity import corrected, two_sided_p
from analysis.comparisons import Answer, from_answers
from analysis.errors import ResultsError
from analysis.power import Plan, differing_pairs
from analysis.power import studies as width_module
from analysis.power.studies import Studies, analyse, draw, run, widths
from analysis.report import estimate_scores
from analysis.report.estimate import Estimate
from analysis.scaling import fit, probabilities
from analysis.scaling.result import COVARIANCE_CHOICES, Method
from benchmarks.simulated_studies import Design
from documents import counted_work
from documents.arrays import Floats
from tests.choice import nightly
from tests.kept import known

MakePlan = Callable[..., Plan]
EXACT: tuple[Adjust, ...] = ("none", "holm", "bh")
STRENGTHS = (-1.5, -0.4, 0.1, 0.2, 1.6)


def counts_of(studies: Studies, study: int) -> Floats:
    """Return each observer's counts of one study, answer by answer."""
    plan, won = studies.plan, studies.won[study]
    counts = np.zeros((len(won), len(plan.items), len(plan.items)))
    totals = plan.times * (studies.observers // len(won))
    for pair, (one, other) in enumerate(zip(*plan.pairs, strict=True)):
        counts[:, one, other] = won[:, pair]
        counts[:, other, one] = totals[pair] - won[:, pair]
    return counts


def report_on(studies: Studies, study: int, adjust: Adjust) -> Estimate:
    """Return what `report` has, from the answers of each observer."""
    names = studies.plan.items
    answers = [
        Answer(names[one], names[other], count, str(observer))
        for observer, own in enumerate(counts_of(studies, study))
        for (one, other), count in np.ndenumerate(own)
        if count
    ]
    plan, comparisons = studies.plan, from_answers(answers, names)
    return estimate_scores(comparisons, alpha=plan.alpha, adjust=adjust, covariance=plan.covariance, draw=False)


@pytest.mark.parametrize(
    ("observers", "covariance"),
    [(1, "auto"), (2, "shrinkage"), (9, "sandwich"), *nightly(*product((1, 2, 9), COVARIANCE_CHOICES))],
)
def test_every_study_is_fitted_and_tested_as_the_report_does(
    plan_of: MakePlan, observers: int, covariance: str
) -> None:
    times = 3 if observers == 1 else 1
    plan = plan_of(
        *STRENGTHS, times=times, covariance=covariance, observer_sd=0.4, lapse_rate=0.05, alpha=0.1, interval="wald"
    )
    studies = run(plan, observers, 8, np.random.default_rng(3))
    assert studies.separated.any() == (observers < 9)
    found = {adjust: replace(studies, plan=replace(plan, adjust=adjust)).significant(float("nan")) for adjust in EXACT}
    width = widths(studies, np.random.default_rng(0))
    for study in range(8):
        for adjust in EXACT:
            report = report_on(studies, study, adjust)
            fit, classes = report.scores.fit, report.scores.classes
            assert classes is not None
            assert (found[adjust][study] == (classes.pair_p <= 0.1)).all()
            assert report.covariance == plan.kind(observers, separated=bool(studies.separated[study]))
        np.testing.assert_allclose(studies.theta[study], fit.theta, atol=1e-8)
        np.testing.assert_allclose(studies.covariance[study], fit.covariance, atol=1e-7)
        ends = np.empty((5, 2))
        ends[list(report.scores.order)] = report.log10_interval
        np.testing.assert_allclose(width[study], ends[:, 1] - ends[:, 0], rtol=1e-7)


def test_freedom_of_a_study_in_which_all_answer_alike_is_the_reports(plan_of: MakePlan) -> None:
    plan = plan_of(*STRENGTHS, covariance="scaled", interval="wald")
    studies = analyse(plan, 13, np.ones((1, 13, len(plan.differs))))
    freedom = report_on(studies, 0, "none").scores.fit.pair_freedom
    assert freedom is not None
    assert studies.freedom is not None
    assert studies.freedom[0, :10] == pytest.approx(freedom)
    assert freedom == pytest.approx(np.full(10, 48.0))


@pytest.mark.parametrize(
    ("covariance", "observers", "observer_sd"),
    [
        ("shrinkage", 6, 0.0),
        *nightly(("model", 25, 0.0), ("shrinkage", 10, 1.0), ("sandwich", 12, 0.7), ("scaled", 6, 0.7)),
    ],
)
def test_one_quantile_of_the_largest_z_decides_like_one_for_each_study(
    plan_of: MakePlan, covariance: str, observers: int, observer_sd: float
) -> None:
    plan = plan_of(*STRENGTHS, covariance=covariance, adjust="maxz", observer_sd=observer_sd)
    studies = run(plan, observers, 15, np.random.default_rng(4))
    found = studies.significant(plan.critical_z(observers))
    own = []
    for study in range(15):
        classes = known(report_on(studies, study, "maxz").scores.classes)
        own.append(classes.pair_p <= 0.05)
    assert 0.05 < found.mean() < 0.9
    assert (found == np.array(own)).mean() > 0.97


def test_the_critical_z_of_two_items_is_the_normal_quantile(plan_of: MakePlan) -> None:
    assert plan_of(0, 1, adjust="maxz", covariance="model").critical_z(10) == pytest.approx(1.96, abs=0.02)
    assert plan_of(0, 1, adjust="maxz", covariance="sandwich").critical_z(5) == pytest.approx(2.776, abs=0.12)


def test_bootstrap_widths_are_those_of_the_bootstrap(plan_of: MakePlan, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(width_module, "BOOTSTRAPS", 200)
    plan = plan_of(*STRENGTHS, interval="bootstrap")
    studies = run(plan, 6, 4, np.random.default_rng(6))
    found, random = widths(studies, np.random.default_rng(0)), np.random.default_rng(0)
    for study in range(4):
        counts, seed = counts_of(studies, study), int(random.integers(2**31))
        method: Method = "firth" if fit(counts.sum(axis=0)).separated else "ml"
        names = [str(number) for number in range(6)]
        drawn = resample_counts(counts, plan.items, names, replicates=200, seed=seed, method=method)
        ends = intervals(drawn, "log10_score")
        np.testing.assert_array_equal(found[study], ends.high - ends.low)


@pytest.mark.parametrize("fields", [{}, {"covariance": "sandwich"}, {"times": 3, "covariance": "sandwich"}])
def test_answers_are_drawn_as_the_law_says(plan_of: MakePlan, fields: dict[str, object]) -> None:
    plan = plan_of(*STRENGTHS, lapse_rate=0.1, **fields)
    first, second = plan.pairs
    won = draw(plan, 8, 2000, np.random.default_rng(8)).sum(axis=1)
    each = 8 * plan.times
    p = 0.9 * probabilities(plan.theta)[first, second] + 0.05
    np.testing.assert_array_less(np.abs(won.mean(axis=0) - each * p), 4.5 * np.sqrt(each * p * (1 - p) / 2000))
    np.testing.assert_allclose(won.var(axis=0), each * p * (1 - p), rtol=0.2)


@pytest.mark.parametrize("observer_sd", [0.7, 2.0])
def test_the_average_answer_of_observers_who_differ_is_as_assumed(plan_of: MakePlan, observer_sd: float) -> None:
    plan = plan_of(*STRENGTHS, observer_sd=observer_sd, scores_of="average")
    np.testing.assert_allclose(Design(plan.typical, 2, observer_sd).truth(), plan.theta, atol=1e-5)
    alike = replace(plan, observer_sd=0.0)
    np.testing.assert_array_equal(alike.typical, replace(plan, scores_of="typical").typical)


@pytest.mark.parametrize(("nats", "observer_sd"), [(6.0, 3.0), (14.0, 8.0)])
def test_average_scores_that_no_observers_give_are_refused(plan_of: MakePlan, nats: float, observer_sd: float) -> None:
    with pytest.raises(ResultsError, match="average scores"):
        _ = plan_of(-nats, nats, 0.0, observer_sd=observer_sd, scores_of="average").typical


def test_right_classes_part_what_shares_no_label_and_what_is_not_equal() -> None:
    theta = np.array([2.0, 1.0, 1.0])
    assert differing_pairs(theta).tolist() == [True, True, False]
    assert differing_pairs(theta, ["1", "1+2", "2"]).tolist() == [False, True, False]
    assert differing_pairs(theta, ["1", "", "2"]).tolist() == [True, True, False]


@pytest.mark.parametrize(("adjust", "observers"), [("holm", 5), ("holm", 20), *nightly(("none", 5), ("bh", 20))])
def test_verdicts_are_those_of_all_profiles_of_which_few_are_computed(
    plan_of: MakePlan, adjust: Adjust, observers: int
) -> None:
    plan = plan_of(*STRENGTHS, observer_sd=0.7, adjust=adjust)
    studies = run(plan, observers, 200, np.random.default_rng(3))
    with counted_work() as work:
        verdicts = studies.significant(2.5)
    assert 0 < work["profiles_climbed"] < verdicts.size / (2 if observers == 5 else 8)
    freedom = None if studies.freedom is None else studies.freedom[:, : studies.spread.shape[1]]
    p = np.minimum(two_sided_p(np.abs(studies.statistics()), freedom), studies.exchanged)
    assert (verdicts == (corrected(p, adjust) <= plan.alpha)).all()
    assert 0.05 < verdicts.mean() < 0.9


def test_verdicts_by_the_maximum_of_z_are_those_of_all_profiles(plan_of: MakePlan) -> None:
    studies = run(plan_of(*STRENGTHS, observer_sd=0.7, adjust="maxz"), 20, 200, np.random.default_rng(3))
    assert (studies.significant(2.5) == (np.abs(studies.statistics()) >= 2.5)).all()
