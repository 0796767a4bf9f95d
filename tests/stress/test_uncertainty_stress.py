"""Intervals and classes at their edges: calibration by simulation, many items, tiny and huge counts, few observers."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.bootstrap import class_stability, intervals
from analysis.bootstrap.confidence_intervals import DEFAULT, KINDS
from analysis.bootstrap.replicates import NAMES, resample_counts
from benchmarks.simulated_studies import Design, coverage, decisions
from tests.stress.memory import run_alone

pytestmark = pytest.mark.stress


# Medina 2016, Table 4.4.
PRINTED = np.array([0.0718, 0.0432, 0.0762, 0.2036, 0.0740, 0.2574, 0.0543, 0.0296, 0.0751, 0.1149])
THETA = np.log(PRINTED) - np.log(PRINTED).mean()


@pytest.mark.promise("level")
@pytest.mark.parametrize(("observers", "least"), [(30, 0.93), (15, 0.92)])
@pytest.mark.parametrize("observer_sd", [0.0, 0.7])
def test_95_percent_intervals_hold_the_truth(observers: int, least: float, observer_sd: float) -> None:
    """The promise, with three standard errors to spare, which 400 studies hold to about 1.5 %."""
    for found in coverage(Design(THETA, observers, observer_sd), [DEFAULT], NAMES, studies=400):
        assert found.standard_error < 0.008
        assert found.covered - 3 * found.standard_error > least - 0.02
        assert least < found.covered < 0.975


def test_equal_items_are_told_apart_in_at_most_5_5_percent_of_studies() -> None:
    """Two thousand studies: the standard error of 5 % is 0.5 %."""
    found = decisions(Design(np.zeros(10), 30), studies=2000, covariance="model")
    assert found.false_difference <= 0.055
    assert 0.94 < found.differences < 0.96


@pytest.mark.promise("level")
@pytest.mark.parametrize("observers", [5, 15])
@pytest.mark.parametrize("observer_sd", [0.0, 0.7])
def test_the_single_step_controls_the_level_with_few_observers(observers: int, observer_sd: float) -> None:
    """Three hundred studies of four items: the standard error of 5 % is 1.3 %."""
    found = decisions(Design(np.zeros(4), observers, observer_sd), studies=300, adjust="maxz")
    assert 0.005 < found.false_difference <= 0.05 + 3 * 0.013


@pytest.mark.parametrize("observers", [2, 3, 4])
@pytest.mark.parametrize("observer_sd", [0.0, 0.7, 1.5])
def test_two_to_four_observers_report_no_false_differences(observers: int, observer_sd: float) -> None:
    found = decisions(Design(np.zeros(10), observers, observer_sd), studies=1000)
    assert found.false_difference < 0.02
    assert found.differences > 0.95


def test_a_hundred_items_fit_into_bounded_memory() -> None:
    """The counts of 1000 replicates alone would take 80 MB, what fitting them together needs ten times as much."""
    program = """
import numpy as np
from tests.stress.memory import forget_peak, peak_kb
from benchmarks.simulated_studies import Design
from analysis.bootstrap.confidence_intervals import intervals
from analysis.bootstrap.replicates import resample_counts
(counts,) = Design(np.random.default_rng(1).normal(0, 0.7, 100), 30).studies(1, 1)
names = [str(place) for place in range(100)]
before = forget_peak()
drawn = resample_counts(counts, names, names[:30])
found = intervals(drawn, "difference")
assert len(found.low) == 4950 and (found.low < found.high).all()
print((peak_kb() - before) / 1024)
"""
    assert float(run_alone(program)) < 300


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e9])
@pytest.mark.parametrize("method", ["ml", "firth"])
def test_the_size_of_counts_moves_no_interval(scale: float, method: str) -> None:
    """Firth's prior counts as half an answer, whatever the answers count."""
    (counts,) = Design(THETA, 30).studies(1, 1)
    names = [str(place) for place in range(30)]
    plain, scaled = (resample_counts(size * counts, names[:10], names, replicates=200) for size in (1.0, scale))
    if method == "firth":
        scaled = resample_counts(scale * counts, names[:10], names, replicates=200, method="firth")
        assert np.isfinite(scaled.theta).all()
        return
    for kind in set(KINDS) - {"model"}:
        one, other = intervals(plain, kind=kind), intervals(scaled, kind=kind)
        assert one.low == pytest.approx(other.low, abs=1e-7)
        assert one.high == pytest.approx(other.high, abs=1e-7)


@pytest.mark.parametrize("observers", [2, 3, 1000])
def test_two_items_and_any_number_of_observers(observers: int) -> None:
    counts = np.zeros((observers, 2, 2))
    counts[::2, 0, 1] = counts[1::2, 1, 0] = 1
    drawn = resample_counts(counts, ["a", "b"], [str(place) for place in range(observers)])
    for kind in KINDS:
        found = intervals(drawn, "difference", kind=kind)
        assert found.low[0] <= found.estimate[0] <= found.high[0]
        assert found.high[0] - found.low[0] > 0
    assert class_stability(drawn).shared.min() > 0.5


def test_strengths_thirty_nats_apart() -> None:
    """Every draw is separated: intervals are Firth's model's at the least, finite, and hold the order."""
    (counts,) = Design(np.array([-15.0, 0.0, 0.3, 15.0]), 10).studies(1, 1)
    drawn = resample_counts(counts, list("abcd"), list("0123456789"), method="firth")
    assert drawn.separated.all()
    for kind in KINDS:
        found = intervals(drawn, kind=kind)
        assert np.isfinite([found.low, found.high]).all()
        assert found.high[0] < found.low[3]
        assert found.high[3] - found.low[3] > 1


def test_classes_of_forty_items_over_a_thousand_draws() -> None:
    (counts,) = Design(np.linspace(-2, 2, 40), 20).studies(1, 1)
    drawn = resample_counts(counts, [str(place) for place in range(40)], [str(place) for place in range(20)])
    stability = class_stability(drawn)
    assert stability.shared[0, 39] == 0
    assert stability.shared[0, 1] > 0.5
    assert sum(stability.class_counts.values()) == 1000
