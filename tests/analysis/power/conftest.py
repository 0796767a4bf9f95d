"""Plans to simulate."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from analysis.power import Plan, differing_pairs

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
