"""Measurements killed with SIGKILL at random moments, and resumed until they are complete."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

from devices.readings import read_session

SIMULATED = ["--instrument", "simulated", "--backend", "egl", "--settle", "0", "--set", "grey"]
MOST_ROUNDS = 60


def kill_and_resume(folder: Path, seed: int, soonest: int = 1) -> None:
    """Measure the rig of ``folder`` to m.jsonl, killed again and again; assert that no reading is lost or doubled.

    Each time it is killed after ``soonest`` to 19 readings. An uninterrupted run, in whole.jsonl, says what should
    have been read: the noise of a patch depends on the seed and its place alone.
    """
    code = "from runner.cli.main import main; main()"
    command = [sys.executable, "-c", code, "display", "measure", str(folder / "rig.yaml"), *SIMULATED]
    subprocess.run([*command, "-o", str(folder / "whole.jsonl")], check=True, capture_output=True)
    whole = {place: kept.reading for place, kept in read_session(folder / "whole.jsonl").readings.items()}
    file = folder / "m.jsonl"
    rng = random.Random(seed)
    kills = 0
    for _ in range(MOST_ROUNDS):
        before = read_session(file).readings if file.exists() else {}
        more = ["--resume"] if file.exists() else []
        arguments = [*command, "-o", str(file), "--instrument-option", "takes_s=0.02", *more]
        process = subprocess.Popen(arguments, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert process.stderr is not None
        reported, stop_after = 0, rng.randrange(soonest, 20)
        for line in process.stderr:
            reported += " cd/m²" in line
            if reported >= stop_after:
                break
        time.sleep(rng.uniform(0.0, 0.04))
        if process.poll() is None:
            os.kill(process.pid, signal.SIGKILL)
            kills += 1
        process.communicate()
        after = read_session(file).readings
        assert len(after) >= len(before) + reported, "a reading that was reported is not on disk"
        assert {place: after[place] for place in before} == before
        if len(after) == len(whole):
            break
    assert kills >= 2
    lines = [json.loads(line) for line in file.read_text().splitlines()]
    assert sorted(line["position"] for line in lines if line["record"] == "reading") == sorted(whole)
    assert sum(line["record"] == "header" for line in lines) == 1
    assert {place: kept.reading for place, kept in read_session(file).readings.items()} == whole
