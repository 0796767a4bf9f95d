"""Plans to simulate."""

from __future__ import annotations

import numpy as np

from analysis.simulation import Plan


def plan_of(*theta: float, times: int = 1, **fields: object) -> Plan:
    """Return a plan of all pairs from log scores, a class for each that differs; other fields by name."""
    strengths = np.array(theta) - np.mean(theta)
    names = tuple(f"item {item}" for item in range(len(theta)))
    first, second = np.triu_indices(len(theta), 1)
    every, differs = np.full(len(first), times, dtype=np.int64), strengths[first] != strengths[second]
    return Plan(names, strengths, every, differs, **fields)  # type: ignore[arg-type]  # keywords by name
