"""Power by simulated studies: the same whoever computes it, with errors that are true."""

from __future__ import annotations

from dataclasses import replace
from multiprocessing import active_children
from typing import Any

import numpy as np
import pytest

from analysis.errors import ResultsError
from analysis.simulation import Plan
from extensions.power import compute as compute_module
from extensions.power import differing_pairs, simulate_power
from tests.extensions.power.to_the_last_bit import numbers
from tests.plans import plan_of

STRENGTHS = (-1.2, -0.4, 0.1, 0.3, 1.2)


def test_a_number_of_observers_comes_to_the_same_whichever_others_are_asked_for() -> None:
    plan = plan_of(*STRENGTHS)
    alone, among = simulate_power(plan, [20], replicates=200), simulate_power(plan, [30, 20, 10], replicates=200)
    assert among.observers == (10, 20, 30)
    assert among.separates[1].tolist() == alone.separates[0].tolist()
    assert among.mean_width[1] == alone.mean_width[0]


def test_another_seed_gives_other_studies() -> None:
    plan = plan_of(*STRENGTHS)
    assert numbers(simulate_power(plan, [20], replicates=60)) == numbers(simulate_power(plan, [20], replicates=60))
    assert numbers(simulate_power(plan, [20], replicates=60)) != numbers(
        simulate_power(plan, [20], replicates=60, seed=1)
    )


@pytest.mark.nightly
def test_the_errors_told_are_those_between_seeds() -> None:
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


def test_items_that_always_win_are_fitted_and_told_of() -> None:
    found = simulate_power(plan_of(-6, 0, 6), [4], replicates=100)
    assert found.separated[0] > 0.5
    assert found.unfitted[0] == 0
    assert np.isfinite(found.mean_width).all()


def test_classes_that_come_out_are_those_named() -> None:
    plan = plan_of(-1.5, -1.5, 1.5, 1.5)
    found = simulate_power(plan, [60], replicates=60)
    assert found.recovery[0] > 0.7
    merged = replace(plan, differs=np.zeros(6, dtype=bool))
    assert simulate_power(merged, [60], replicates=60).recovery[0] == 0


@pytest.mark.nightly
def test_work_moves_to_processes_once_it_is_worth_it(monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_one_observer_has_the_model_s_covariance() -> None:
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


def test_right_classes_part_what_shares_no_label_and_what_is_not_equal() -> None:
    theta = np.array([2.0, 1.0, 1.0])
    assert differing_pairs(theta).tolist() == [True, True, False]
    assert differing_pairs(theta, ["1", "1+2", "2"]).tolist() == [False, True, False]
    assert differing_pairs(theta, ["1", "", "2"]).tolist() == [True, True, False]
