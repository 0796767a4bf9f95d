"""Power simulated at its edges: many stimuli in bounded memory, scores far apart, workers that keep dying."""

from __future__ import annotations

import os
import signal
import sys
from multiprocessing import active_children
from typing import Any

import numpy as np
import pytest

from analysis.power import Plan, differing_pairs, simulate_power, spread_theta
from analysis.power.results import Power
from analysis.power.studies import run
from benchmarks.power import by_report
from tests.analysis.power.test_studies import report_on
from tests.stress.memory import run_alone

pytestmark = pytest.mark.stress


STUDIES = 300

MANY = """
import numpy as np
from analysis.power.plan import differing_pairs, spread_theta
from analysis.power.plan import Plan
from analysis.power.simulation import simulate_power
from tests.stress.memory import forget_peak, peak_kb
theta = spread_theta(100, 3)
plan = Plan(tuple(map(str, range(100))), theta, np.ones(4950, dtype=np.int64), differing_pairs(theta), observer_sd=0.5)
before = forget_peak()
found = simulate_power(plan, [200], replicates=20, workers=1)
assert np.isfinite(found.separates).all() and np.isfinite(found.mean_width).all()
print((peak_kb() - before) // 1024)
"""


def plan_of(theta: np.ndarray[tuple[int, ...], np.dtype[np.float64]], **fields: Any) -> Plan:
    """Return a plan of all pairs, each once."""
    names = tuple(f"item {item}" for item in range(len(theta)))
    return Plan(
        names, theta, np.ones(len(theta) * (len(theta) - 1) // 2, dtype=np.int64), differing_pairs(theta), **fields
    )


def numbers(found: Power) -> list[bytes]:
    """Return all numbers, to the last bit."""
    return [value.tobytes() for name in Power.__slots__ if isinstance(value := getattr(found, name), np.ndarray)]


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells the peak of a process's memory so")
def test_a_hundred_stimuli_and_two_hundred_observers_fit_into_half_a_gigabyte() -> None:
    assert int(run_alone(MANY)) < 512


@pytest.mark.parametrize("nats", [0.0, 12.0, 30.0])
@pytest.mark.parametrize("fields", [{}, {"covariance": "model"}, {"adjust": "maxz"}, {"observer_sd": 5.0}])
def test_scores_far_apart_and_not_at_all_stay_finite(nats: float, fields: dict[str, Any]) -> None:
    found = simulate_power(plan_of(spread_theta(8, nats), **fields), [2, 30], replicates=200, workers=1)
    for name in ("separates", "reversed", "width", "recovery", "alike"):
        assert np.isfinite(getattr(found, name)).all(), name
    assert (found.unfitted == 0).all()
    if nats == 12.0 and not fields.get("observer_sd"):
        assert found.separated[0] > 0.9


@pytest.mark.parametrize(("observers", "observer_sd"), [(5, 0.7), (10, 0.0), (10, 0.7), (20, 1.5)])
def test_power_is_the_share_of_reports_that_separate_a_pair(observers: int, observer_sd: float) -> None:
    design = plan_of(spread_theta(6, 3), observer_sd=observer_sd, scores_of="average")
    found = simulate_power(design, [observers], replicates=4000, workers=1).separates[0]
    share = by_report(design, observers, STUDIES)
    error = np.sqrt(np.maximum(found * (1 - found), 0.01) * (1 / STUDIES + 1 / 4000))
    assert (np.abs(share - found) < 4.5 * error).all()
    assert found.max() > 0.3


@pytest.mark.parametrize(("observers", "observer_sd"), [(5, 0.0), (5, 0.7), (10, 1.5), (20, 0.7)])
@pytest.mark.parametrize("covariance", ["auto", "sandwich"])
def test_one_quantile_of_the_largest_z_serves_ten_items(observers: int, observer_sd: float, covariance: str) -> None:
    design = plan_of(spread_theta(10, 2), observer_sd=observer_sd, adjust="maxz", covariance=covariance)
    studies = run(design, observers, 20, np.random.default_rng(2))
    found = studies.significant(design.critical_z(observers))
    own = []
    for study in range(20):
        classes = report_on(studies, study, "maxz").scores.classes
        assert classes is not None
        own.append(classes.pair_p <= 0.05)
    assert (found == np.array(own)).mean() > 0.97


def test_workers_that_keep_dying_change_nothing() -> None:
    plan = plan_of(spread_theta(10, 2), interval="bootstrap")
    expected = simulate_power(plan, [15], replicates=250, workers=1)
    killed = []

    def kill_now_and_then(done: int, of: int) -> None:
        alive = [process for process in active_children() if process.is_alive()]
        if done in (2, 12, 22) and alive:
            assert alive[0].pid is not None
            os.kill(alive[0].pid, signal.SIGKILL)
            killed.append(done)

    found = simulate_power(plan, [15], replicates=250, workers=2, done=kill_now_and_then)
    assert len(killed) == 3
    assert numbers(found) == numbers(expected)
