"""Studies simulated and analysed a block at a time, beside the same done one by one; what cannot be is refused."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from analysis.bootstrap import intervals
from analysis.bootstrap.replicates import resample_counts
from analysis.choices import Adjust
from analysis.classes import corrected, two_sided_p
from analysis.comparisons import Answer, from_answers
from analysis.errors import ResultsError
from analysis.report import estimate_scores
from analysis.report.estimate import Estimate
from analysis.scaling import fit, probabilities
from analysis.scaling.result import COVARIANCE_CHOICES, Method
from analysis.simulation import StudyTally, blocks_of, summed
from analysis.simulation import studies as width_module
from analysis.simulation.studies import Studies, analyse, draw, run, widths
from benchmarks.simulated_studies import Design
from documents import counted_work
from documents.arrays import Floats
from tests.choice import nightly
from tests.kept import known
from tests.plans import plan_of

STRENGTHS = (-1.2, -0.4, 0.1, 0.3, 1.2)


def test_every_study_is_counted_once() -> None:
    blocks = blocks_of(plan_of(*STRENGTHS, observer_sd=1.0), [5, 3000], 700, 1)
    for observers in (5, 3000):
        mine = [block for block in blocks if block.observers == observers]
        assert sum(block.replicates for block in mine) == 700
        assert [block.index for block in mine] == list(range(len(mine)))
        assert max(block.replicates for block in mine) * observers * 10 <= 7.5e6
    streams = [block.random().integers(2**62) for block in blocks]
    assert len(set(streams)) == len(blocks)


@pytest.mark.parametrize(
    ("change", "finding"),
    [
        ({"theta": np.array([0.0, np.nan, 1.0])}, "not finite"),
        ({"theta": np.array([0.0, 50.0, 1.0])}, "too far apart"),
        ({"observer_sd": -1.0}, "observers' spread is -1 nats"),
        ({"lapse_rate": 1.0}, "the share of lapses is 1"),
        ({"alpha": 0.0}, "alpha is 0"),
        ({"times": np.array([1, 0, 0])}, "leave the items in 2 groups"),
    ],
)
def test_a_plan_that_no_study_could_follow_is_refused(change: dict[str, object], finding: str) -> None:
    with pytest.raises(ResultsError, match=finding):
        blocks_of(replace(plan_of(0, 1, 2), **change), [10], 100, 1)  # type: ignore[arg-type]  # keywords by name


@pytest.mark.parametrize("observers", [[], [0, 10], [10**9]])
def test_absurd_numbers_of_observers_are_refused(observers: list[int]) -> None:
    with pytest.raises(ResultsError, match="the numbers of observers are"):
        blocks_of(plan_of(0, 1), observers, 100, 1)
    with pytest.raises(ResultsError, match="1 replicates were asked for"):
        blocks_of(plan_of(0, 1), [10], 1, 1)


def test_numbers_of_observers_with_one_study_that_has_a_fit_are_refused() -> None:
    blocks, none = blocks_of(plan_of(0, 1), [5, 10], 2, 1), np.zeros(1)
    tallies = [StudyTally(2, unfitted, 0, none, none, 0, 0.0, 0.0, none, none) for unfitted in (0, 1)]
    with pytest.raises(ResultsError, match="studies with 10 observers have no fit"):
        summed(blocks, tallies)


EXACT: tuple[Adjust, ...] = ("none", "holm", "bh")
STUDIES_STRENGTHS = (-1.5, -0.4, 0.1, 0.2, 1.6)


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
def test_every_study_is_fitted_and_tested_as_the_report_does(observers: int, covariance: str) -> None:
    times = 3 if observers == 1 else 1
    plan = plan_of(
        *STUDIES_STRENGTHS,
        times=times,
        covariance=covariance,
        observer_sd=0.4,
        lapse_rate=0.05,
        alpha=0.1,
        interval="wald",
    )
    studies = run(plan, observers, 8, np.random.default_rng(3))
    assert studies.separated.any() == (observers < 9)
    found = {adjust: replace(studies, plan=replace(plan, adjust=adjust)).significant(float("nan")) for adjust in EXACT}
    width = widths(studies, np.random.default_rng(0))
    for study in range(8):
        for adjust in EXACT:
            report = report_on(studies, study, adjust)
            fit, classes = report.scores.fit, report.scores.classes
            assert (found[adjust][study] == (known(classes).pair_p <= 0.1)).all()
            assert report.covariance == plan.kind(observers, separated=bool(studies.separated[study]))
        np.testing.assert_allclose(studies.theta[study], fit.theta, atol=1e-8)
        np.testing.assert_allclose(studies.covariance[study], fit.covariance, atol=1e-7)
        ends = np.empty((5, 2))
        ends[list(report.scores.order)] = report.log10_interval
        np.testing.assert_allclose(width[study], ends[:, 1] - ends[:, 0], rtol=1e-7)


def test_freedom_of_a_study_in_which_all_answer_alike_is_the_reports() -> None:
    plan = plan_of(*STUDIES_STRENGTHS, covariance="scaled", interval="wald")
    studies = analyse(plan, 13, np.ones((1, 13, len(plan.differs))))
    freedom = known(report_on(studies, 0, "none").scores.fit.pair_freedom)
    assert known(studies.freedom)[0, :10] == pytest.approx(freedom)
    assert freedom == pytest.approx(np.full(10, 48.0))


@pytest.mark.parametrize(
    ("covariance", "observers", "observer_sd"),
    [
        ("shrinkage", 6, 0.0),
        *nightly(("model", 25, 0.0), ("shrinkage", 10, 1.0), ("sandwich", 12, 0.7), ("scaled", 6, 0.7)),
    ],
)
def test_one_quantile_of_the_largest_z_decides_like_one_for_each_study(
    covariance: str, observers: int, observer_sd: float
) -> None:
    plan = plan_of(*STUDIES_STRENGTHS, covariance=covariance, adjust="maxz", observer_sd=observer_sd)
    studies = run(plan, observers, 15, np.random.default_rng(4))
    found = studies.significant(plan.critical_z(observers))
    own = []
    for study in range(15):
        classes = known(report_on(studies, study, "maxz").scores.classes)
        own.append(classes.pair_p <= 0.05)
    assert 0.05 < found.mean() < 0.9
    assert (found == np.array(own)).mean() > 0.97


def test_the_critical_z_of_two_items_is_the_normal_quantile() -> None:
    assert plan_of(0, 1, adjust="maxz", covariance="model").critical_z(10) == pytest.approx(1.96, abs=0.02)
    assert plan_of(0, 1, adjust="maxz", covariance="sandwich").critical_z(5) == pytest.approx(2.776, abs=0.12)


def test_bootstrap_widths_are_those_of_the_bootstrap(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(width_module, "BOOTSTRAPS", 200)
    plan = plan_of(*STUDIES_STRENGTHS, interval="bootstrap")
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
def test_answers_are_drawn_as_the_law_says(fields: dict[str, Any]) -> None:
    plan = plan_of(*STUDIES_STRENGTHS, lapse_rate=0.1, **fields)
    first, second = plan.pairs
    won = draw(plan, 8, 2000, np.random.default_rng(8)).sum(axis=1)
    each = 8 * plan.times
    p = 0.9 * probabilities(plan.theta)[first, second] + 0.05
    np.testing.assert_array_less(np.abs(won.mean(axis=0) - each * p), 4.5 * np.sqrt(each * p * (1 - p) / 2000))
    np.testing.assert_allclose(won.var(axis=0), each * p * (1 - p), rtol=0.2)


@pytest.mark.parametrize("observer_sd", [0.7, 2.0])
def test_the_average_answer_of_observers_who_differ_is_as_assumed(observer_sd: float) -> None:
    plan = plan_of(*STUDIES_STRENGTHS, observer_sd=observer_sd, scores_of="average")
    np.testing.assert_allclose(Design(plan.typical, 2, observer_sd).truth(), plan.theta, atol=1e-5)
    alike = replace(plan, observer_sd=0.0)
    np.testing.assert_array_equal(alike.typical, replace(plan, scores_of="typical").typical)


@pytest.mark.parametrize(("nats", "observer_sd"), [(6.0, 3.0), (14.0, 8.0)])
def test_average_scores_that_no_observers_give_are_refused(nats: float, observer_sd: float) -> None:
    with pytest.raises(ResultsError, match="average scores"):
        _ = plan_of(-nats, nats, 0.0, observer_sd=observer_sd, scores_of="average").typical


@pytest.mark.parametrize(("adjust", "observers"), [("holm", 5), ("holm", 20), *nightly(("none", 5), ("bh", 20))])
def test_verdicts_are_those_of_all_profiles_of_which_few_are_computed(adjust: Adjust, observers: int) -> None:
    plan = plan_of(*STUDIES_STRENGTHS, observer_sd=0.7, adjust=adjust)
    studies = run(plan, observers, 200, np.random.default_rng(3))
    with counted_work() as work:
        verdicts = studies.significant(2.5)
    assert 0 < work["profiles_climbed"] < verdicts.size / (2 if observers == 5 else 8)
    freedom = None if studies.freedom is None else studies.freedom[:, : studies.spread.shape[1]]
    p = np.minimum(two_sided_p(np.abs(studies.statistics()), freedom), studies.exchanged)
    assert (verdicts == (corrected(p, adjust) <= plan.alpha)).all()
    assert 0.05 < verdicts.mean() < 0.9


def test_verdicts_by_the_maximum_of_z_are_those_of_all_profiles() -> None:
    studies = run(plan_of(*STUDIES_STRENGTHS, observer_sd=0.7, adjust="maxz"), 20, 200, np.random.default_rng(3))
    assert (studies.significant(2.5) == (np.abs(studies.statistics()) >= 2.5)).all()
