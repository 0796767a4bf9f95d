"""A process killed with SIGKILL at random moments loses no answer and goes on in the same order."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from analysis.records import FILE_NAME, read_session
from runner.blocks.pair_order import pair_order

DRIVER = Path(__file__).with_name("killed_session.py")
NAMES = "abcdefgh"
ROOT = Path(__file__).parents[2]


def _start(folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, str(DRIVER), str(folder)], stdout=subprocess.PIPE, text=True, cwd=ROOT)


def _asked(told: str) -> list[tuple[str, ...]]:
    # The last line may have been cut by the kill.
    return [
        tuple(line.split()[1:]) for line in told.splitlines() if line.startswith("asked") and len(line.split()) == 3
    ]


@pytest.mark.parametrize("seed", range(4))
def test_killed_at_random_moments(tmp_path: Path, seed: int) -> None:
    folder = tmp_path / "s"
    expected: list[tuple[str, ...]] = [
        (NAMES[first], NAMES[second]) for first, second in pair_order(8, 1, "side", "order")
    ]
    rng = random.Random(seed)
    kills = 0
    for _ in range(60):
        process = _start(folder)
        assert process.stdout is not None
        # Wait until it has asked a few times, then for a random moment of the next trial.
        heard = "".join(process.stdout.readline() for _ in range(rng.randint(1, 5)))
        time.sleep(rng.uniform(0.0, 0.006))
        process.send_signal(signal.SIGKILL)
        told = heard + process.stdout.read()
        process.wait()
        process.stdout.close()
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


def test_a_complete_session_has_each_trial_once(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    told = subprocess.run(
        [sys.executable, str(DRIVER), str(folder)], capture_output=True, text=True, cwd=ROOT, check=True
    ).stdout
    assert told.splitlines()[-1] == "end"
    log = read_session(folder / FILE_NAME)
    keys = [(trial.block, trial.trial) for trial in log.trials]
    assert len(keys) == len(set(keys)) == 30
