"""The default keeps its level with few observers, alike or not, and the model's errors do not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.simulated_studies import Design, decisions
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress
STUDIES = how_many(200, 600)
ERROR = (0.05 * 0.95 / STUDIES) ** 0.5  # standard error of 5 %
EQUAL = np.zeros(10)
HALVES = np.r_[np.ones(5), -np.ones(5)] / 2
POPULATIONS: dict[str, dict[str, Any]] = {
    "alike": {},
    "sd 0.7": {"observer_sd": 0.7},
    "sd 1.5": {"observer_sd": 1.5},
    "two items that divide": {"observer_sd": np.r_[1.5, 1.5, np.zeros(8)]},
    "two camps": {"camps": HALVES},
}


@pytest.mark.parametrize("share", [1.0, (0.2, 1.0)], ids=["all pairs", "some pairs"])
@pytest.mark.parametrize("observers", [5, 10, 30])
@pytest.mark.parametrize("population", POPULATIONS)
def test_the_default_seldom_reports_a_false_difference(population: str, observers: int, share: Any) -> None:
    found = decisions(Design(EQUAL, observers, share=share, **POPULATIONS[population]), studies=STUDIES)
    assert found.false_difference <= 0.05 + 3 * ERROR
    assert 0.93 <= found.differences <= 0.985
    assert 0.92 <= found.log10_scores <= 0.985


@pytest.mark.parametrize("observers", [5, 15])
def test_the_models_errors_report_many_where_observers_differ(observers: int) -> None:
    found = decisions(Design(EQUAL, observers, 0.7), studies=STUDIES, covariance="model")
    assert found.false_difference > 0.15
