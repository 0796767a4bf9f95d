"""`cyclopean scores` on two thousand items of which few pairs were compared: within its memory and time."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.stress.memory import command_alone

pytestmark = pytest.mark.stress

ITEMS, PAIRS, COMPARISONS = 2000, 10_000, 20


@pytest.mark.parametrize("options", [(), ("--json",), ("--method", "map"), ("--model", "thurstone")])
def test_few_pairs_of_many_items_take_little_memory_and_time(tmp_path: Path, options: tuple[str, ...]) -> None:
    """Two seconds of processor on a quiet machine; the test allows for a busy one."""
    random = np.random.default_rng(3)
    theta = random.normal(0, 1, ITEMS)
    first = random.integers(ITEMS, size=PAIRS)
    second = (first + 1 + random.integers(ITEMS - 1, size=PAIRS)) % ITEMS
    won = random.binomial(COMPARISONS, 1 / (1 + np.exp(theta[second] - theta[first])))
    lines = [f"{i},{j},{w}\n{j},{i},{COMPARISONS - w}\n" for i, j, w in zip(first, second, won, strict=True)]
    table = tmp_path / "table.csv"
    table.write_text("winner,loser,count\n" + "".join(lines), encoding="utf-8")
    said, seconds, megabytes = command_alone("scores", table, *options)
    assert megabytes <= 200
    assert seconds <= 6
    if "--json" in options:
        items = json.loads(said)["items"]
        estimate = np.array([item["theta"] for item in sorted(items, key=lambda item: int(item["name"]))])
        error = np.array([item["se"] for item in sorted(items, key=lambda item: int(item["name"]))])
        assert np.abs((estimate - theta + theta.mean()) / error).std() < 1
