"""`cyclopean scores --observers random` as a program."""

from __future__ import annotations

import csv
import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

Call = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def table(tmp_path: Path) -> Path:
    random = np.random.default_rng(5)
    strengths = np.linspace(0.8, -0.8, 5)
    lines = ["winner,loser,observer"]
    for observer in range(12):
        own = strengths + random.normal(0, 0.8, 5)
        for a in range(5):
            for b in range(a):
                won = random.random() < 1 / (1 + np.exp(own[b] - own[a]))
                lines.append(f"{'abcde'[a if won else b]},{'abcde'[b if won else a]},o{observer}")
    file = tmp_path / "table.csv"
    file.write_text("\n".join(lines), encoding="utf-8")
    return file


def test_what_it_prints_and_writes(cyclopean: Call, table: Path, tmp_path: Path) -> None:
    written = tmp_path / "observers.csv"
    done = cyclopean("scores", str(table), "--observers", "random", "--observer-scores", str(written))
    assert "0.941 nats for each item (95 % 0.23 to 1.76)" in done.stdout
    assert "a new observer" in done.stdout
    with written.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["group", "observer", "item", "theta", "sd"]
    assert len(rows) == 60
    values = json.loads(cyclopean("scores", str(table), "--observers", "random", "--json").stdout)
    assert values["spread"]["sd"] == pytest.approx(0.941, abs=5e-4)
    (group,) = values["groups"]
    assert [item["name"] for item in group["items"]] == list("abcde")
    assert len(group["pairs"]) == 10
    assert {entry["observer"] for entry in group["observers"]} == {row["observer"] for row in rows}


def test_options_that_do_not_go_together(cyclopean: Call, table: Path) -> None:
    done = cyclopean("scores", str(table), "--observers", "random", "--method", "firth", expect=2)
    assert "method does not go" in done.stderr
    done = cyclopean("scores", str(table), "--observer-scores", "x.csv", expect=2)
    assert "observer_scores goes with" in done.stderr
