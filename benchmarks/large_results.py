"""Large results, each in a process of its own: many sessions in one report, many stimuli, and a long session resumed.

Times are of the processor, so that other work on the machine counts less; the error column has no meaning here.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from curves import Row, program, sized
from promises import Promise

from analysis.records import FILE_NAME, Header, Trial
from runner.session import simulate
from runner.session.folders import Recorder

UTC = "2026-01-02T03:00:00.000+00:00"
COST = {f"percent_{what}": 0.5 for what in ("red", "green", "blue", "any", "above_full")}
COST |= {"delta_e_00_mean": 0.1, "delta_e_00_max": 0.2}
PROMISED = {
    "report, 500 sessions of 90 trials": (10.0, 400.0),
    "report, 200 stimuli, 19,900 trials": (10.0, 400.0),
    "resume after 19,850 trials": (4.0, 400.0),
}
_MEASURED = """
import json, re, sys, time
from pathlib import Path
from runner.cli.main import main
sys.argv = ["cyclopean", *sys.argv[1:]]
try:
    main()
finally:
    peak = re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())
    kept = {"seconds": time.process_time(), "peak_mb": int(peak[1]) / 1e3 if peak else None}
    print(json.dumps(kept), file=sys.stderr)
"""


@contextmanager
def without_syncs() -> Iterator[None]:
    """Let what is written be written without waiting for the disk, which is not what is measured."""
    real, os.fsync = os.fsync, lambda descriptor: None
    try:
        yield
    finally:
        os.fsync = real


def write_sessions(folder: Path, observers: int, stimuli: int, repeats: int) -> None:
    """Write a session of each observer, who compared every two stimuli ``repeats`` times, below ``folder``."""
    names = [f"s{number:03d}" for number in range(stimuli)]
    clipping = {"left": COST, "right": COST}
    shown = tuple({"name": name, "factors": {}, "flat": True, "clipping": clipping} for name in names)
    with without_syncs():
        for person in range(observers):
            code, rng = f"{person:03d}", random.Random(person)
            header = Header("large", code, "s1", UTC, 0, "Which?", True, shown, {}, {}, {}, {}, {})
            with Recorder.create(folder / f"sub-{code}" / "ses-s1", header) as recorder:
                pairs = [pair for _ in range(repeats) for pair in combinations(range(stimuli), 2)]
                rng.shuffle(pairs)
                for number, pair in enumerate(pairs):
                    first, second = pair if rng.random() < 0.5 else pair[::-1]
                    wins = rng.random() < 1 / (1 + 1.03 ** ((second - first) * 200 / stimuli))
                    chosen, rejected = (first, second) if wins else (second, first)
                    data = {"first": names[first], "second": names[second], "answer": "first" if wins else "second"}
                    data |= {"chosen": names[chosen], "rejected": names[rejected], "first_position": "left"}
                    costs = {names[place]: clipping for place in (first, second)}
                    time_s = round(rng.lognormvariate(0.5, 0.4), 6)
                    event = ("left" if wins else "right", time_s)
                    recorder.append(Trial(0, number, "all_pairs", (event,), time_s, UTC, {**data, "clipping": costs}))
                recorder.end({"work": {}})


def write_stopped_session(folder: Path, stimuli: int, missing: int) -> list[str]:
    """Write a study of every two of some pictures, and a session whose last trials are missing; return how to resume.

    The observer is simulated, in full: every trial was drawn.
    """
    from PIL import Image

    folder.mkdir(parents=True)
    scores = []
    for number in range(stimuli):
        codes = np.random.default_rng(number).integers(0, 255, (30, 40, 3), dtype=np.uint8)
        Image.fromarray(codes).save(folder / f"s{number:03d}.png")
        scores.append(f"  s{number:03d}: {{score: {1.03**number:.5f}}}")
    study, observer = folder.with_name("study"), folder.with_name("observer.yaml")
    measured(["new", str(study), str(folder), "--panel", "1920x1080,0.2768"], folder)
    experiment = study / "experiment.yaml"
    text = experiment.read_text(encoding="utf-8")
    head, tail = text[: text.index("blocks:")], text[text.index("# Of the report") :]
    experiment.write_text(f"{head}blocks:\n  - {{kind: all_pairs, break_every: 500}}\n{tail}", encoding="utf-8")
    law = "schema_version: 1\nkind: bradley_terry\nsource: made\nmedian_response_time_s: 2.0\nstimuli:\n"
    observer.write_text(law + "\n".join(scores) + "\n", encoding="utf-8")
    results = folder.with_name("results")
    with without_syncs():
        (session,) = simulate(experiment, observer, 1, results=results).folders
    lines = (session / FILE_NAME).read_bytes().splitlines(keepends=True)
    (session / FILE_NAME).write_bytes(b"".join(lines[: -missing - 1]))
    words = ["run", str(experiment), "--observer", "01", "--resume", "--simulate", str(observer)]
    return [*words, "--results", str(results)]


def measured(words: list[str], folder: Path) -> tuple[float, float | None]:
    """Run a command of ``cyclopean`` in ``folder``; return its seconds of processor and its peak in megabytes."""
    root = str(Path(__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", _MEASURED, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": root, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(done.stderr)
    last = json.loads(done.stderr.strip().splitlines()[-1])
    return last["seconds"], last["peak_mb"]


def run() -> dict[str, object]:
    """Make each of the large results, and report on it or resume it."""
    rows: list[Row] = []
    promises: list[Promise] = []
    for name, (most_s, most_mb) in [*PROMISED.items()][: sized(None, 1)]:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            if name.startswith("resume"):
                words = write_stopped_session(folder / "pictures", sized(200, 8), sized(50, 5))
            else:
                write_sessions(
                    folder / "results", *(sized((500, 10, 2), (4, 4, 1)) if "500" in name else (1, sized(200, 8), 1))
                )
                words = ["report", "results"]
            taken, peak_mb = measured(words, folder)
        note = f"{taken:.1f} s of a processor" + ("" if peak_mb is None else f", {peak_mb:.0f} MB")
        rows.append({"series": name, "parameter": "whole process", "seconds": taken, "error": None, "note": note})
        why = "" if peak_mb is not None else "this system does not say"
        promises.append(Promise(f"{name}, processor", taken, most_s, "seconds", unit="s"))
        promises.append(Promise(f"{name}, memory", peak_mb, most_mb, "share", unit="MB", missing=why))
    return {"title": "Large results", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("large_results", run)
