"""Plans to simulate, and a scheduler to simulate them on."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from analysis.power.plan import Plan, differing_pairs

MakePlan = Callable[..., Plan]


@pytest.fixture(scope="session")
def plan_of() -> MakePlan:
    """Make a plan from log scores, with a class of its own for each; other fields by name."""

    def make(*theta: float, times: int = 1, **fields: object) -> Plan:
        strengths = np.array(theta) - np.mean(theta)
        names = tuple(f"item {item}" for item in range(len(theta)))
        every = np.full(len(theta) * (len(theta) - 1) // 2, times, dtype=np.int64)
        return Plan(names, strengths, every, differing_pairs(strengths), **fields)  # type: ignore[arg-type]  # keywords by name

    return make


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """The address of a scheduler with two workers, as a lab would have; it works also while nothing asks it to."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        worker_dashboard_address="127.0.0.1:0",
    ) as cluster:
        yield cluster.scheduler_address
