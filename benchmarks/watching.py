"""Watching running sessions: time of a first look at all logs, and of the next where few or none changed.

    python benchmarks/watching.py

The error is how many logs are read that did not change since the last look.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
from curves import program, sized
from promises import Promise

from analysis.kinds import new_trial
from analysis.records import FILE_NAME, new_header
from runner.session.watching import Watch

SESSIONS, TRIALS = sized(20, 3), sized(300, 20)
STIMULI = ({"name": "a", "factors": {}}, {"name": "b", "factors": {}})
DATA = {"first": "a", "second": "b", "answer": "first", "chosen": "a", "rejected": "b", "first_position": "top"}


def run() -> dict[str, Any]:
    """Measure and return the title, the rows and the promise."""
    with TemporaryDirectory() as folder:
        files = [_write(Path(folder), f"{number:02d}") for number in range(SESSIONS)]
        watch = Watch(Path(folder))
        case = f"{SESSIONS} sessions of {TRIALS} trials"
        rows = []
        for series, changed in (("first look", SESSIONS), ("no log changed", 0), ("one log changed", 1)):
            for file in files[:changed]:
                os.utime(file)
            before = watch.read
            start_s = time.perf_counter()
            watch.look()
            taken_s = time.perf_counter() - start_s
            more = float(watch.read - before - changed)
            rows.append({"series": series, "parameter": case, "seconds": taken_s, "error": more})
    again = max(float(str(row["error"])) for row in rows)
    promises = [Promise("logs read again although they did not change", again, 0, "count")]
    return {"title": "Watching running sessions: time against logs read in vain", "rows": rows, "promises": promises}


def _write(folder: Path, observer: str) -> Path:
    planned = ({"kind": "all_pairs", "trials": 2 * TRIALS, "expected_s": 10.0 * TRIALS},)
    header = new_header("views", observer, "s1", "2026-01-31T09:30:00Z", seed=1, stimuli=STIMULI)
    lines: list[dict[str, Any]] = [header.to_json() | {"planned": planned}]
    for number in range(TRIALS):
        utc = f"2026-01-31T{9 + number // 3600:02}:{30 + number // 60 % 30:02}:{number % 60:02}Z"
        lines.append(new_trial(0, number, "all_pairs", (("up", 0.5),), 0.5, utc, DATA).to_json())
    file = folder / f"sub-{observer}" / "ses-s1" / FILE_NAME
    file.parent.mkdir(parents=True)
    file.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    return file


if __name__ == "__main__":
    program("watching", run)
