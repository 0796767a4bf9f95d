"""What a trial's line costs with its checksum and without, what a sync costs beside it, and reading 20,000 trials."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import perf_counter, process_time
from typing import Any

from curves import program, sized
from promises import Promise

from analysis.kinds import Trial, new_trial
from analysis.records import FILE_NAME, new_header, read_session
from analysis.seals import check_log
from documents.files.chain import EMPTY, sealed
from runner.session.folders import Recorder

TRIALS = sized(20_000, 200)
MOST_CHECKSUM_US, MOST_READING_S = 20.0, 4.0
UTC = "2026-01-02T03:00:00.000+00:00"
COST = {f"percent_{what}": 0.5 for what in ("red", "green", "blue", "any", "above_full")} | {"delta_e_00_mean": 0.1}
HEADER = new_header("bench", "01", "s", UTC, question="Which?", simulated=True, stimuli=({"name": "a"}, {"name": "b"}))


def _trial(number: int) -> Trial:
    pair = {"first": "a", "second": "b", "answer": "first", "chosen": "a", "rejected": "b", "first_position": "top"}
    clipping = {name: {"left": COST, "right": COST} for name in ("a", "b")}
    return new_trial(0, number, "all_pairs", (("up", 1.0),), 1.0, UTC, {**pair, "clipping": clipping})


def _of_processor(work: Callable[[], object], calls: int = 3) -> float:
    """Return the median processor time of ``calls`` in seconds, which other programs do not lengthen."""
    taken = []
    for _ in range(calls):
        began = process_time()
        work()
        taken.append(process_time() - began)
    return median(taken)


def _unchained(line: dict[str, object]) -> bytes:
    text = json.dumps(line, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.encode("utf-8", "backslashreplace") + b"\n"


def _line_rows() -> list[dict[str, Any]]:
    lines = [_trial(number).to_json() for number in range(sized(2000, 100))]
    plain = _of_processor(lambda: [_unchained(line) for line in lines], 21) / len(lines)
    chained = _of_processor(lambda: [sealed(line, 1, EMPTY) for line in lines], 21) / len(lines)
    added = 1e6 * (chained - plain)
    note = f"the number and the checksum add {added:.1f} µs"
    size = f"a line of {len(_unchained(lines[0]))} bytes"
    return [
        {"series": "without a checksum", "parameter": size, "seconds": plain, "error": None},
        {"series": "with a checksum", "parameter": size, "seconds": chained, "error": None, "note": note},
    ]


def _reading_rows(folder: Path) -> list[dict[str, Any]]:
    real = os.fsync
    with Recorder.create(folder / "s", HEADER) as recorder:
        began = perf_counter()
        for number in range(100):
            recorder.append(_trial(number))
        appended = (perf_counter() - began) / 100
        os.fsync = lambda descriptor: None  # 20,000 of them are not what is measured
        try:
            for number in range(100, TRIALS):
                recorder.append(_trial(number))
        finally:
            os.fsync = real
    file = folder / "s" / FILE_NAME
    reading = _of_processor(lambda: read_session(file))

    def reopen() -> None:
        Recorder.reopen(folder / "s")[0].close()

    reopening, checking = _of_processor(reopen), _of_processor(lambda: check_log(file))
    trials = f"{TRIALS} trials, {file.stat().st_size / 1e6:.0f} MB"
    note = "of the processor"
    return [
        {"series": "append with fsync", "parameter": "a trial", "seconds": appended, "error": None},
        {"series": "read a session", "parameter": trials, "seconds": reading, "error": None},
        {"series": "reopen to resume", "parameter": trials, "seconds": reopening, "error": None, "note": note},
        {"series": "verify", "parameter": trials, "seconds": checking, "error": None},
    ]


def run() -> dict[str, object]:
    """Time a line, and a log read again."""
    with tempfile.TemporaryDirectory() as place:
        rows = _line_rows() + _reading_rows(Path(place))
    times = {str(row["series"]): float(row["seconds"]) for row in rows}
    added_us = 1e6 * (times["with a checksum"] - times["without a checksum"])
    promises = [
        Promise("number and checksum of a line", added_us, MOST_CHECKSUM_US, "seconds", unit="µs"),
        Promise("reopened to resume, 20,000 trials", times["reopen to resume"], MOST_READING_S, "seconds", unit="s"),
    ]
    return {"title": "The log of a session", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("session_log", run)
