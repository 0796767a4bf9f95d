"""Scores within groups: time against scoring each group by itself, and how often the test of agreement is wrong.

    python benchmarks/groups.py [STUDIES]

The error of the scores is the largest difference in θ (nats) from those of each group's own table. That of a test is
the distance of its share of false alarms from 0.05, or, where groups differ, the share of studies that it misses.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from curves import numbers, program, row, seconds, sized
from promises import Promise, worst

from analysis.comparisons.comparisons import Comparisons, from_arrays, split_groups, without_groups
from analysis.scaling.fitting import fit_model
from analysis.scaling.group_agreement import GroupAgreement, group_agreement
from analysis.scaling.grouped import score_groups
from analysis.scaling.scores import score

Row = dict[str, object]

TITLE = "Scores within groups: time against error"
LEVEL = 0.05
OBSERVERS = sized((5, 10, 15, 30), (5,))
SPREADS = sized(((0.0, 0.0), (0.7, 0.0), (0.7, 0.7), (0.0, 1.5)), ((0.7, 0.0),))
PLANTED = 0.5
GROUPS, ITEMS = 4, 5


def run(studies: int = sized(150, 3)) -> dict[str, Any]:
    """Measure and return the title and the rows."""
    rows = [*_times()]
    promises = [Promise("error in θ of the scale of each group", worst(rows), 1e-10, "error")]
    for spread, observers in product(SPREADS, OBSERVERS):
        rows += _shares(observers, spread, studies)
    return {"title": TITLE, "rows": rows, "promises": promises}


def study(
    random: np.random.Generator,
    observers: int,
    spread: tuple[float, float] = (0.0, 0.0),
    apart: float = 0.0,
    *,
    groups: int = GROUPS,
    items: int = ITEMS,
) -> Comparisons:
    """Return a study in which every observer compares every pair of each group once.

    Parameters
    ----------
    spread
        Standard deviations (nats) of each observer's strengths, over all groups and within a group.
    apart
        Standard deviation (nats) of an item's strength between groups.
    """
    one, other = np.triu_indices(items, 1)
    own = random.normal(0, spread[0], (observers, 1, items)) + random.normal(0, apart, (1, groups, items))
    theta = own + random.normal(0, spread[1], (observers, groups, items))
    wins = random.random((observers, groups, len(one))) < 1 / (1 + np.exp(theta[..., other] - theta[..., one]))
    observer, group, _ = (place.ravel() for place in np.indices(wins.shape))
    answers = wins.size
    return from_arrays(
        tuple(f"codec {item}" for item in range(items)),
        tuple(f"{person:04}" for person in range(observers)),
        winner=np.where(wins, one, other).ravel(),
        loser=np.where(wins, other, one).ravel(),
        observer=observer,
        count=np.ones(answers),
        winner_was_first=np.full(answers, -1, dtype=np.int8),
        tie=np.zeros(answers, dtype=np.bool_),
        group=group,
        groups=tuple(f"scene {scene}" for scene in range(groups)),
    )


def agreement(comparisons: Comparisons) -> GroupAgreement | None:
    """Return the test alone; None if all answers together have no maximum."""
    pooled = fit_model(without_groups(comparisons), covariance="model")
    if pooled.separation:
        return None
    place = {item: number for number, item in enumerate(comparisons.items)}
    parts = [part for _, part in split_groups(comparisons)]
    return group_agreement(pooled, parts, [[place[item] for item in part.items] for part in parts])


def _times() -> Iterator[Row]:
    comparisons = study(np.random.default_rng(1), 30, groups=sized(20, 4), items=10)
    parts = dict(split_groups(comparisons))
    grouped, alone = score_groups(comparisons), {name: score(part) for name, part in parts.items()}
    error = max(float(np.abs(scores.fit.theta - alone[name].fit.theta).max()) for name, scores in grouped.groups)
    case = f"{len(parts)} groups of 10 items, 30 observers"
    note = "with the pooled scale and the test of agreement"
    yield row(case, "score_groups", seconds(lambda: score_groups(comparisons)), error, note)
    yield row(case, "score of each group's table", seconds(lambda: [score(part) for part in parts.values()]), 0.0)


def _shares(observers: int, spread: tuple[float, float], studies: int) -> Iterator[Row]:
    random = np.random.default_rng([observers, *(int(10 * sd) for sd in spread)])
    time = seconds(lambda: agreement(study(np.random.default_rng(1), observers, spread)), repeats=3)
    shares = []
    for apart in (0.0, PLANTED):
        tests = [test for _ in range(studies) if (test := agreement(study(random, observers, spread, apart)))]
        rejected = [(test.p is not None and test.p <= LEVEL, test.p_model <= LEVEL) for test in tests]
        shares.append(np.mean(rejected, axis=0))
    for place, name in enumerate(("by observer", "χ²")):
        false, true = shares[0][place], shares[1][place]
        case = f"{observers} observers, sd {spread[0]:g} over all groups, {spread[1]:g} within one"
        yield row(f"agreement {name}: false alarms", case, time, abs(float(false) - LEVEL), f"{false:.3f} at 0.05")
        yield row(f"agreement {name}: missed", case, time, 1 - float(true), f"power {true:.2f}")


if __name__ == "__main__":
    program("groups", lambda: run(*numbers()))
