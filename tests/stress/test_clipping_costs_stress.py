"""Kept costs: every byte damaged in turn, several programs at once, and programs killed while they keep."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from benchmarks.session_opening import run
from runner.session.clipping_costs import CostCache

pytestmark = pytest.mark.stress
ROOT = Path(__file__).parents[2]
COST = {"flat": True, "clipping": {"left": {"percent_any": 0.25, "delta_e_00_mean": 0.00125}}}
# Keeps and looks up a hundred costs, over and over, until it is killed or time is up; fails if it finds another's.
KEEPING = """
import sys, time, random
from pathlib import Path
from runner.session.clipping_costs import CostCache
folder, until = Path(sys.argv[1]), time.monotonic() + float(sys.argv[2])
print("begun", flush=True)
while time.monotonic() < until:
    number = random.randrange(100)
    cache = CostCache(folder)
    found = cache.find({"number": number})
    assert found in (None, {"number": number, "more": "x" * 5000}), found
    cache.keep({"number": number}, {"number": number, "more": "x" * 5000})
"""


def test_no_damaged_byte_changes_a_cost(tmp_path: Path) -> None:
    cache = CostCache(tmp_path)
    depends_on = {"version": 1, "picture": "ab" * 32, "lift_share": 0.1}
    cache.keep(depends_on, COST)
    (file,) = tmp_path.iterdir()
    whole = file.read_bytes()
    found = 0
    for place in range(len(whole)):
        for bit in range(8):
            file.write_bytes(whole[:place] + bytes([whole[place] ^ 1 << bit]) + whole[place + 1 :])
            cost = cache.find(depends_on)
            assert cost in (None, COST)
            found += cost is not None
        file.write_bytes(whole[:place])
        assert cache.find(depends_on) in (None, COST)
    assert found < 0.01 * 8 * len(whole)  # spaces that became other white space


def _start(folder: Path, seconds: float) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", KEEPING, str(folder), str(seconds)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    program = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert program.stdout is not None
    assert program.stdout.readline() == "begun\n"
    return program


def test_programs_at_once_find_each_other_s_costs_whole(tmp_path: Path) -> None:
    programs = [_start(tmp_path, 3.0) for _ in range(3)]
    for program in programs:
        _, errors = program.communicate(timeout=60)
        assert program.returncode == 0, errors
    assert len(list(tmp_path.glob("*.json"))) == 100
    assert not list(tmp_path.glob(".*.part"))


def test_programs_killed_while_they_keep_leave_nothing_half_written_to_be_found(tmp_path: Path) -> None:
    rng = random.Random(3)
    for _ in range(12):
        program = _start(tmp_path, 60.0)
        time.sleep(rng.uniform(0.02, 0.3))
        program.send_signal(signal.SIGKILL)
        program.communicate()
    cache = CostCache(tmp_path)
    found = [cache.find({"number": number}) for number in range(100)]
    assert all(cost in (None, {"number": number, "more": "x" * 5000}) for number, cost in enumerate(found))
    assert sum(cost is not None for cost in found) == len(list(tmp_path.glob("*.json"))) > 0
    for part in tmp_path.glob(".*.part"):
        os.utime(part, (0, 0))
    assert CostCache(tmp_path).keep({"number": 0}, {"number": 0, "more": "x" * 5000})
    assert not list(tmp_path.glob(".*.part"))


def test_a_session_of_many_pictures_opens_without_reading_them() -> None:
    rows = {(row["series"], row["parameter"]): row for row in run(150, (180, 120))["rows"]}
    plain, first, again = (
        {what: rows[series, f"to {what}"] for what in ("first trial", "all costs")}
        for series in ("plainly, again", "in turn, first time", "in turn, again")
    )
    assert [of["all costs"]["pictures read"] for of in (plain, first, again)] == [150, 150, 2]
    assert all(row["error"] == 0.0 for row in rows.values())
    for of in (first, again):  # less than a tenth is usual
        assert 2.0 * of["first trial"]["processor seconds"] < plain["first trial"]["processor seconds"]
