"""Pairs shared among observers: time of a design against its imbalance, with random parts of all pairs beside it.

    python benchmarks/incomplete_pairs.py

The error is how much oftener the commonest pair is compared than the rarest, over 10, 15 and 30 observers. The
time is that of all designs up to the last observer, who waits longest.
"""

from __future__ import annotations

import random
import sys
from collections.abc import Iterator, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from curves import program, seconds, sized
from promises import Promise, worst

from runner.blocks.incomplete_pairs import designs

Row = dict[str, object]
SIZES = sized(((12, 20), (30, 60), (60, 118), (60, 300)), ((12, 20), (30, 60)))
OBSERVERS = 10, 15, 30


def run() -> dict[str, Any]:
    """Measure and return the title, the rows and the promise."""
    rows = [row for count, each in SIZES for row in _rows(count, each)]
    ours = [row for row in rows if row["series"] == "balanced"]
    promises = [Promise("pairs compared oftener than the rarest, at most so many times", worst(ours), 1, "count")]
    return {"title": "Pairs shared among observers: time against imbalance", "rows": rows, "promises": promises}


def drawn(pairs: int, each: int, observers: int) -> list[list[int]]:
    """Return a random part of all pairs for each observer."""
    rng = random.Random(1)
    return [rng.sample(range(pairs), each) for _ in range(observers)]


def _rows(count: int, each: int) -> Iterator[Row]:
    pairs = list(combinations(range(count), 2))
    for observers in OBSERVERS:
        case = f"{count} stimuli, {each} of {len(pairs)} pairs each, {observers} observers"
        for series, parts in (
            ("balanced", lambda: list(designs(count, pairs, each, "seed", observers))),  # noqa: B023  called in this round
            ("random", lambda: drawn(len(pairs), each, observers)),  # noqa: B023  called in this round
        ):
            taken_s = seconds(parts, repeats=3)
            yield {"series": series, "parameter": case, "seconds": taken_s, "error": _imbalance(len(pairs), parts())}


def _imbalance(pairs: int, parts: Sequence[Sequence[int]]) -> float:
    times = np.bincount(np.concatenate([np.array(part) for part in parts]), minlength=pairs)
    return float(np.ptp(times))


if __name__ == "__main__":
    program("incomplete_pairs", run)
