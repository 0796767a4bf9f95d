"""Power by simulated studies: the same whoever computes it, beside the same done one by one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from multiprocessing import active_children
from typing import Any

import numpy as np
import pytest

from analysis.bootstrap import intervals
from analysis.bootstrap.replicates import resample_counts
from analysis.choices import Adjust
from analysis.classes import corrected, two_sided_p
from analysis.comparisons import Answer, from_answers
from analysis.errors import ResultsError
from analysis.power import Plan, differing_pairs, simulate_power
from analysis.power import compute as compute_module
from analysis.power import studies as width_module
from analysis.power.simulation import blocks_of
from analysis.power.studies import Studies, analyse, draw, run, widths
from analysis.report import estimate_scores
from analysis.report.estimate import Estimate
from analysis.scaling import fit, probabilities
from analysis.scaling.result import COVARIANCE_CHOICES, Method
from benchmarks.simulated_studies import Design
from documents import counted_work
from documents.arrays import Floats
from tests.analysis.power.to_the_last_bit import numbers
from tests.choice import nightly
from tests.kept import known

# Power: the same whoever computes it, with errors that are true, and refused where it means nothing.

MakePlan = Callable[..., Plan]
STRENGTHS = (-1.2, -0.4, 0.1, 0.3, 1.2)


def test_a_number_of_observers_comes_to_the_same_whichever_others_are_asked_for(plan_of: MakePlan) -> None:
    plan = plan_of(*STRENGTHS)
    alone, among = simulate_power(plan, [20], replicates=200), simulate_power(plan, [30, 20, 10], replicates=200)
    assert among.observers == (10, 20, 30)
    assert among.separates[1].tolist() == alone.separates[0].tolist()
    assert among.mean_width[1] == alone.mean_width[0]


def test_another_seed_gives_other_studies(plan_of: MakePlan) -> None:
    plan = plan_of(*STRENGTHS)
    assert numbers(simulate_power(plan, [20], replicates=60)) == numbers(simulate_power(plan, [20], replicates=60))
    assert numbers(simulate_power(plan, [20], replicates=60)) != numbers(
        simulate_power(plan, [20], replicates=60, seed=1)
    )


def test_every_study_is_counted_once(plan_of: MakePlan) -> None:
    blocks = blocks_of(plan_of(*STRENGTHS, observer_sd=1.0), [5, 3000], 700, 1)
    for observers in (5, 3000):
        mine = [block for block in blocks if block.observers == observers]
        assert sum(block.replicates for block in mine) == 700
        assert [block.index for block in mine] == list(range(len(mine)))
        assert max(block.replicates for block in mine) * observers * 10 <= 7.5e6
    streams = [block.random().integers(2**62) for block in blocks]
    assert len(set(streams)) == len(blocks)


@pytest.mark.nightly
def test_the_errors_told_are_those_between_seeds(plan_of: MakePlan) -> None:
    plan = plan_of(-0.8, 0.0, 0.9)
    runs = [simulate_power(plan, [25], replicates=100, seed=seed) for seed in range(80)]
    for name in ("separates", "alike", "mean_width", "recovery"):
        values = np.array([np.atleast_1d(getattr(run, name)[0]) for run in runs])
        told = np.array([np.atleast_1d(getattr(run, f"{name}_error")[0]) for run in runs]).mean(axis=0)
        spread, mean = values.std(axis=0, ddof=1), values.mean(axis=0)
        # Errors of shares near 0 or 1 are told on the safe side. The standard deviation of 80 values is known to 8 %.
        open_ = (mean > 0.05) & (mean < 0.95)
        assert open_.any()
        np.testing.assert_allclose(told[open_], spread[open_], rtol=0.3)
        assert (told[~open_] > 0.7 * spread[~open_]).all()


def test_items_that_always_win_are_fitted_and_told_of(plan_of: MakePlan) -> None:
    found = simulate_power(plan_of(-6, 0, 6), [4], replicates=100)
    assert found.separated[0] > 0.5
    assert found.unfitted[0] == 0
    assert np.isfinite(found.mean_width).all()


def test_classes_that_come_out_are_those_named(plan_of: MakePlan) -> None:
    plan = plan_of(-1.5, -1.5, 1.5, 1.5)
    found = simulate_power(plan, [60], replicates=60)
    assert found.recovery[0] > 0.7
    merged = replace(plan, differs=np.zeros(6, dtype=bool))
    assert simulate_power(merged, [60], replicates=60).recovery[0] == 0


@pytest.mark.nightly
def test_work_moves_to_processes_once_it_is_worth_it(plan_of: MakePlan, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = plan_of(*STRENGTHS)
    expected = simulate_power(plan, [10, 20], replicates=750)
    monkeypatch.setattr(compute_module, "WORTH_PROCESSES_S", 0.0)
    monkeypatch.setattr(compute_module, "cores", lambda: 2)
    children: list[int] = []
    found = simulate_power(
        plan, [10, 20], replicates=750, done=lambda done, of: children.append(len(active_children()))
    )
    assert children[0] < children[-1]
    assert len(children) == 6
    assert numbers(found) == numbers(expected)


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
def test_a_plan_that_no_study_could_follow_is_refused(
    plan_of: MakePlan, change: dict[str, object], finding: str
) -> None:
    with pytest.raises(ResultsError, match=finding):
        simulate_power(replace(plan_of(0, 1, 2), **change), [10])  # type: ignore[arg-type]  # keywords by name


@pytest.mark.parametrize("observers", [[], [0, 10], [10**9]])
def test_absurd_numbers_of_observers_are_refused(plan_of: MakePlan, observers: list[int]) -> None:
    with pytest.raises(ResultsError, match="the numbers of observers are"):
        simulate_power(plan_of(0, 1), observers)


def test_one_observer_has_the_model_s_covariance(plan_of: MakePlan) -> None:
    plan = plan_of(0, 1, times=20, observer_sd=0.3)
    by_model = simulate_power(replace(plan, covariance="model"), [1, 10], replicates=100)
    assert (simulate_power(plan, [1, 10], replicates=100).width == by_model.width).all(axis=1).tolist() == [True, False]
    with pytest.raises(ResultsError, match="give numbers from 2"):
        simulate_power(plan_of(0, 1, interval="bootstrap"), [1, 10])


@pytest.mark.parametrize("covariance", ["model", "auto"])
def test_the_single_step_maximum_is_of_the_pairs_of_all_observers_where_they_share_them(covariance: Any) -> None:
    """The first observer's own pairs leave items apart."""
    theta, apart = np.array([1.0, 0.0, -1.0, 0.0]), np.array([[1, 0, 0, 0, 0, 1], [0, 1, 1, 1, 1, 0]])
    fields: dict[str, Any] = {"adjust": "maxz", "covariance": covariance, "observer_sd": 0.5}
    power = [
        simulate_power(Plan(tuple("abcd"), theta, times, differing_pairs(theta), **fields), [20], replicates=200)
        for times in (apart, apart[::-1])
    ]
    assert power[0].separates == pytest.approx(power[1].separates, abs=0.15)  # three standard errors of 200 studies
    assert power[0].separates[0, 1] > 0.5


# Studies simulated and analysed a block at a time, beside the same done one by one.

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
def test_every_study_is_fitted_and_tested_as_the_report_does(
    plan_of: MakePlan, observers: int, covariance: str
) -> None:
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


def test_freedom_of_a_study_in_which_all_answer_alike_is_the_reports(plan_of: MakePlan) -> None:
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
    plan_of: MakePlan, covariance: str, observers: int, observer_sd: float
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


def test_the_critical_z_of_two_items_is_the_normal_quantile(plan_of: MakePlan) -> None:
    assert plan_of(0, 1, adjust="maxz", covariance="model").critical_z(10) == pytest.approx(1.96, abs=0.02)
    assert plan_of(0, 1, adjust="maxz", covariance="sandwich").critical_z(5) == pytest.approx(2.776, abs=0.12)


def test_bootstrap_widths_are_those_of_the_bootstrap(plan_of: MakePlan, monkeypatch: pytest.MonkeyPatch) -> None:
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
def test_answers_are_drawn_as_the_law_says(plan_of: MakePlan, fields: dict[str, object]) -> None:
    plan = plan_of(*STUDIES_STRENGTHS, lapse_rate=0.1, **fields)
    first, second = plan.pairs
    won = draw(plan, 8, 2000, np.random.default_rng(8)).sum(axis=1)
    each = 8 * plan.times
    p = 0.9 * probabilities(plan.theta)[first, second] + 0.05
    np.testing.assert_array_less(np.abs(won.mean(axis=0) - each * p), 4.5 * np.sqrt(each * p * (1 - p) / 2000))
    np.testing.assert_allclose(won.var(axis=0), each * p * (1 - p), rtol=0.2)


@pytest.mark.parametrize("observer_sd", [0.7, 2.0])
def test_the_average_answer_of_observers_who_differ_is_as_assumed(plan_of: MakePlan, observer_sd: float) -> None:
    plan = plan_of(*STUDIES_STRENGTHS, observer_sd=observer_sd, scores_of="average")
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
    plan = plan_of(*STUDIES_STRENGTHS, observer_sd=0.7, adjust=adjust)
    studies = run(plan, observers, 200, np.random.default_rng(3))
    with counted_work() as work:
        verdicts = studies.significant(2.5)
    assert 0 < work["profiles_climbed"] < verdicts.size / (2 if observers == 5 else 8)
    freedom = None if studies.freedom is None else studies.freedom[:, : studies.spread.shape[1]]
    p = np.minimum(two_sided_p(np.abs(studies.statistics()), freedom), studies.exchanged)
    assert (verdicts == (corrected(p, adjust) <= plan.alpha)).all()
    assert 0.05 < verdicts.mean() < 0.9


def test_verdicts_by_the_maximum_of_z_are_those_of_all_profiles(plan_of: MakePlan) -> None:
    studies = run(plan_of(*STUDIES_STRENGTHS, observer_sd=0.7, adjust="maxz"), 20, 200, np.random.default_rng(3))
    assert (studies.significant(2.5) == (np.abs(studies.statistics()) >= 2.5)).all()
