"""Work on a Dask scheduler: in order, to the last bit, and what it raises comes through."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

from extensions.power import simulate_power
from extensions.power.compute import compute
from tests.extensions.power.to_the_last_bit import numbers
from tests.plans import plan_of

pytestmark = pytest.mark.nightly
STRENGTHS = (-1.2, -0.4, 0.1, 0.3, 1.2)


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


def test_what_the_work_raises_comes_through(scheduler: str) -> None:
    with pytest.raises(ValueError, match=r"math domain error|nonnegative"):
        compute(math.sqrt, [4.0, -1.0], scheduler=scheduler)


@pytest.mark.parametrize("interval", ["wald", "bootstrap"])
def test_processes_give_the_same_answer_to_the_last_bit(scheduler: str, interval: str) -> None:
    plan = plan_of(*STRENGTHS, observer_sd=0.5, covariance="sandwich", interval=interval)
    replicates = 1000 if interval == "wald" else 30
    here = simulate_power(plan, [8, 12], replicates=replicates, workers=1)
    there = simulate_power(plan, [8, 12], replicates=replicates, scheduler=scheduler)
    assert numbers(there) == numbers(here)
