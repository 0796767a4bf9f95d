"""Limits against classes, counted by hand, and against the plain way."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from analysis.agreement import Drawn, ObservedGroup, calibrate
from analysis.agreement.limits import best_limits
from documents.arrays import Floats


def group(same: list[bool], drawn: list[list[bool]] | None = None, observers: int = 10) -> ObservedGroup:
    """Return a group whose first stimulus is the photograph; ``same`` says which others are in its class."""
    n = len(same) + 1

    def square(alike: list[bool]) -> NDArray[np.bool_]:
        differs = np.zeros((n, n), dtype=np.bool_)
        differs[0, 1:] = differs[1:, 0] = ~np.array(alike)
        return differs

    samples = None
    if drawn is not None:
        zeros = np.zeros((len(drawn), n))
        samples = Drawn(zeros, zeros, np.array([square(row) for row in drawn]))
    names = tuple(f"s{place}" for place in range(n))
    return ObservedGroup("", "ratings", "points", names, np.zeros(n), square(same), observers, samples)


def test_a_limit_is_counted_by_hand() -> None:
    found = calibrate([group([True, True, True, False, False])], [np.array([0, 0.5, 1.0, 2.0, 1.4, 3.0])], [0], 1.4)
    assert found.table is not None
    counts = found.table.hits, found.table.misses, found.table.false_alarms, found.table.correct_rejections
    assert counts == (2, 1, 1, 1)  # a stimulus at the limit is within it
    assert found.table.hit_rate.share == pytest.approx(2 / 3)
    assert found.table.false_alarm_rate.share == 0.5
    assert (found.stimuli, found.same, found.table.right.times) == (5, 3, 3)


def test_a_measure_of_which_more_is_better() -> None:
    """Decibels: within the limit is at or above it."""
    found = calibrate(
        [group([True, True, False])], [np.array([np.inf, 50.0, 40.0, 20.0])], [0], 45.0, higher_is_better=True
    )
    assert found.table is not None
    assert found.best is not None
    assert (found.table.hits, found.table.misses, found.table.correct_rejections) == (1, 1, 1)
    assert found.area == 1
    assert found.best == pytest.approx(30)
    assert (found.best_from, found.best_to) == (20, 40)


def test_the_area_is_that_of_mann_and_whitney() -> None:
    random = np.random.default_rng(1)
    values = np.rint(random.normal(0, 3, 21))
    same = (random.random(20) < 0.4).tolist()
    found = calibrate([group(same)], [values], [0], None)
    near, far = values[1:][np.array(same)], values[1:][~np.array(same)]
    expected = stats.mannwhitneyu(far, near).statistic / (len(near) * len(far))
    assert found.area == pytest.approx(expected, abs=1e-12)


def test_the_best_limit_is_that_of_all_that_could_be_tried() -> None:
    random = np.random.default_rng(7)
    for _ in range(50):
        far = np.rint(random.normal(0, 3, 9))
        same = random.random(9) < 0.5
        best = best_limits(far, same)
        if best is None:
            assert same.all() or not same.any()
            continue
        middle = np.clip(np.mean(np.clip(best, -100, 100)), -100, 100)

        def youden(limit: float, far: Floats = far, same: NDArray[np.bool_] = same) -> float:
            return float((far <= limit)[same].mean() - (far <= limit)[~same].mean())

        assert youden(float(middle)) == pytest.approx(max(youden(limit) for limit in np.arange(-20, 20, 0.5)))


def test_all_in_one_class_say_nothing_of_a_limit() -> None:
    found = calibrate([group([True, True, True])], [np.array([0, 1.0, 2.0, 3.0])], [0], 1.4)
    assert (found.area, found.best, found.curve) == (None, None, ())
    assert found.table is not None
    assert found.table.false_alarm_rate.share is None
    assert found.to_json()["area"] is None


def test_the_interval_of_the_best_limit_is_that_of_the_draws() -> None:
    values = np.array([0, 1.0, 2.0, 3.0, 4.0])
    same = [True, True, False, False]
    drawn = [same] * 60 + [[True, True, True, False]] * 40
    found = calibrate([group(same, drawn, observers=1000)], [values], [0], None)
    assert (found.best, found.best_low, found.best_high) == (2.5, 2.5, 3.5)
    assert (found.area_low, found.area_high) == (1, 1)
    # Where most draws put all in one class, there is no interval.
    rarely = calibrate([group(same, [same] * 60 + [[True] * 4] * 40)], [values], [0], None)
    assert (rarely.best, rarely.best_low) == (2.5, None)
