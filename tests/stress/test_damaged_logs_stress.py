"""Logs damaged, changed, cut, watched and killed while written: named with their line, and nothing false believed."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.records import FILE_NAME, read_session
from runner.session import Watch, simulate
from runner.session.clipping_costs import CostCache
from tests.runner.changed_logs import EDITS, edit, flip, recorded, refused
from tests.runner.every_kind import VARIANTS
from tests.runner.killing import check_rounds, killer
from tests.runner.log_mutants import mutants
from tests.runner.test_damaged_logs import LOGS, NOT_NOTICED, made, put, read, use, what_counts
from tests.runner.test_power_cut import KINDS, cut_the_last
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress


# Thousands of damaged logs: no traceback in whatever reads them, and no answer believed that was not given.

MUTANTS = how_many(6000, 12_000)


def test_thousands_of_damaged_logs_are_refused_or_say_what_they_said(tmp_path: Path) -> None:
    original = {name: what_counts(read_session(log)) for name, log in LOGS.items()}
    believed: Counter[str] = Counter()
    for name, mutant in made(range(1000, 1000 + MUTANTS)):
        damaged = read(mutant.content, tmp_path)
        if damaged is not None and what_counts(damaged) != original[name]:
            believed[mutant.change] += 1
    assert sum(count for change, count in believed.items() if change not in NOT_NOTICED) <= MUTANTS // 1000, believed


def test_of_flipped_bits_only_what_is_recorded_once_is_believed(tmp_path: Path) -> None:
    """A rating whose key was pressed once, and the words and numbers of a test's outcome, are compared with nothing."""
    believed = 0
    for log in LOGS.values():
        original = what_counts(read_session(log))
        for mutant in mutants(log.read_bytes(), range(1500), ["flip a bit"]):
            damaged = read(mutant.content, tmp_path)
            if damaged is not None and what_counts(damaged) != original:
                changed = set(what_counts(damaged)) ^ set(original)
                assert {kind for _, _, kind, *_ in changed} <= {"rating", "screening"}, mutant.seed
                believed += 1
    assert believed <= 20


def test_whatever_reads_damaged_logs_comes_to_its_end(tmp_path: Path, cyclopean: Callable[..., Any]) -> None:
    for name, mutant in made(range(20_000, 20_000 + how_many(300, 1000))):
        if read(mutant.content, tmp_path) is not None:
            use(put(mutant.content, tmp_path, name), cyclopean)


# Ten thousand flipped bits and a thousand edited lines over logs of every kind: each named with its line.

FLIPS, EDITED = 10_000, 1_000


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[list[bytes], list[bytes]]]:
    """Two sessions of each kind, some without an end."""
    folder = tmp_path_factory.mktemp("logs")
    return [
        (
            recorded(folder, kind, variant, "01", end=number % 3 != 0),
            recorded(folder, kind, variant, "02", end=number % 3 != 0),
        )
        for number, (kind, variant) in enumerate(VARIANTS)
    ]


def test_ten_thousand_flipped_bits(logs: list[tuple[list[bytes], list[bytes]]], tmp_path: Path) -> None:
    rng = random.Random(18)
    for number in range(FLIPS):
        refused(tmp_path / FILE_NAME, *flip(rng, logs[number % len(logs)][0]))


def test_a_thousand_edited_lines(logs: list[tuple[list[bytes], list[bytes]]], tmp_path: Path) -> None:
    rng = random.Random(19)
    for number in range(EDITED):
        refused(tmp_path / FILE_NAME, *edit(rng, EDITS[number % len(EDITS)], *logs[number % len(logs)]))


# A log cut at every byte of its last record, of each kind.
@pytest.mark.parametrize("last", KINDS)
def test_a_cut_at_every_byte_of_the_last_record(tmp_path: Path, last: str) -> None:
    cut_the_last(tmp_path / "s", last, step=1)


# Hundreds of SIGKILLs over all kinds of blocks and all phases, the checksums and the copy compared after each.

KILLS = how_many(400, 1000)


def test_hundreds_of_kills_lose_nothing_change_nothing_and_leave_whole_copies(tmp_path: Path) -> None:
    if not hasattr(os, "fork"):
        pytest.skip("processes are forked here, so that killing many takes no time")
    kills = sessions = 0
    with killer(tmp_path / "errors.txt") as killed:
        while kills < KILLS:
            kind, variant = VARIANTS[sessions % len(VARIANTS)]
            folder = tmp_path / str(sessions)
            folder.mkdir()
            rounds = killed(folder, kind, variant, 10_000 + sessions)
            check_rounds(rounds)
            # The last kill may come between the end line and the end of the process: the copy is then caught up later.
            if rounds[-1]["told"] and rounds[-1]["told"][-1][0] == "end":
                assert (folder / "copies" / FILE_NAME).read_bytes() == (folder / "s" / FILE_NAME).read_bytes()
            kills += len(rounds)
            sessions += 1
    print(f"{kills} kills of {sessions} sessions")


# Logs that are watched while they are written: cut after any byte, they show a session or nothing, and no fault.

Study = Any  # tests/conftest.py


def test_a_log_cut_after_any_byte_is_no_fault(study: Study, tmp_path: Path) -> None:
    (folder,) = simulate(study.experiment, study.observers, 1, results=study.results).folders
    whole = (folder / FILE_NAME).read_bytes()
    place = tmp_path / "seen" / FILE_NAME
    place.parent.mkdir()
    header_bytes = whole.index(b"\n") + 1
    answered = 0
    for length in range(len(whole) + 1):
        place.write_bytes(whole[:length])
        found = Watch(place.parent).look()
        assert not found.findings
        if length != header_bytes - 1:  # the line end alone is missing
            assert len(found.sessions) == (length >= header_bytes)
        if found.sessions:
            assert found.sessions[0].answered >= answered
            answered = found.sessions[0].answered
    (last,) = Watch(place.parent).look().sessions
    assert answered == last.trials
    assert answered > 0
    assert last.complete


# Kept costs: every byte damaged in turn, several programs at once, and programs killed while they keep.

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
