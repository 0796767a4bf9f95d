"""A process killed with SIGKILL at random moments loses no answer and goes on in the same order."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from analysis.records import FILE_NAME, read_session
from runner.blocks.orders import pair_order

DRIVER = Path(__file__).with_name("killed_session.py")
NAMES = "abcdefgh"
ROOT = Path(__file__).parents[2]


class Runs:
    """Runs sessions, each in a process of its own."""

    def __init__(self, program: subprocess.Popen[str]) -> None:
        assert program.stdin is not None
        assert program.stdout is not None
        self._asked, self._told = program.stdin, program.stdout
        self._process = 0
        self._gone = True

    def start(self, folder: Path) -> None:
        """Begin the session, or resume it."""
        self._asked.write(f"{folder}\n")
        self._asked.flush()
        self._process = int(self._told.readline().removeprefix("process "))
        self._gone = False

    def hear(self) -> str:
        """Return the next line that the process tells; none once it is gone."""
        line = "" if self._gone else self._told.readline()
        self._gone = line in ("", "gone\n")
        return "" if self._gone else line

    def kill(self) -> None:
        """Kill the process, unless it is gone."""
        with suppress(ProcessLookupError):
            os.kill(self._process, signal.SIGKILL)

    def rest(self) -> str:
        """Return all that the process told, once it is gone."""
        return "".join(iter(self.hear, ""))


@pytest.fixture(scope="module")
def runs() -> Iterator[Runs]:
    """Runs sessions in processes."""
    if not hasattr(os, "fork"):
        pytest.skip("processes are forked here, so that killing many takes no time")
    with subprocess.Popen(
        [sys.executable, str(DRIVER)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT
    ) as program:
        yield Runs(program)
        assert program.stdin is not None
        program.stdin.close()


def _asked(told: str) -> list[tuple[str, ...]]:
    # The last line may have been cut by the kill.
    return [
        tuple(line.split()[1:]) for line in told.splitlines() if line.startswith("asked") and len(line.split()) == 3
    ]


@pytest.mark.promise("no-answer-lost")
@pytest.mark.parametrize("seed", range(4))
def test_killed_at_random_moments(runs: Runs, tmp_path: Path, seed: int) -> None:
    folder = tmp_path / "s"
    expected: list[tuple[str, ...]] = [
        (NAMES[first], NAMES[second]) for first, second in pair_order(8, 1, "side", "order")
    ]
    rng = random.Random(seed)
    kills = 0
    for _ in range(60):
        runs.start(folder)
        # Wait until it has asked a few times, then for a random moment of the next trial.
        heard = "".join(runs.hear() for _ in range(rng.randint(1, 5)))
        time.sleep(rng.uniform(0.0, 0.006))
        runs.kill()
        told = heard + runs.rest()
        log = read_session(folder / FILE_NAME)
        pairs = [(t.data["first"], t.data["second"]) for t in log.trials if t.kind == "all_pairs"]
        asked = _asked(told)
        # Whatever was asked before the last question was answered, and is on disk.
        assert pairs == expected[: len(pairs)]
        assert len(pairs) >= expected.index(asked[-1]) if asked else True
        if log.complete:
            break
        kills += 1
    assert log.complete
    assert pairs == expected
    assert kills >= 2


def test_a_complete_session_has_each_trial_once(runs: Runs, tmp_path: Path) -> None:
    folder = tmp_path / "s"
    runs.start(folder)
    assert runs.rest().split()[-1] == "end"
    log = read_session(folder / FILE_NAME)
    keys = [(trial.block, trial.trial) for trial in log.trials]
    assert len(keys) == len(set(keys)) == 30
