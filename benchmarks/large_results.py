"""Large results, each in a process of its own: many sessions in one report, many stimuli, a long session resumed, and a
million answers in a DataFrame; and what `cyclopean.scores` takes beside reading a DataFrame and `fit_model`.

Times are of the processor, so that other work on the machine counts less; the error column has no meaning here.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path
from time import process_time

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).parent))
from curves import Row, program, row, sized
from promises import Promise

import cyclopean
from analysis.kinds import new_trial
from analysis.records import FILE_NAME, new_header
from analysis.scaling import fit_model
from cyclopean.scaling import comparisons
from runner.session import simulate
from runner.session.folders import Recorder

UTC = "2026-01-02T03:00:00.000+00:00"
COST = {f"percent_{what}": 0.5 for what in ("red", "green", "blue", "any", "above_full")}
COST |= {"delta_e_00_mean": 0.1, "delta_e_00_max": 0.2}
PROMISED = {
    "report, 500 sessions of 90 trials": (10.0, 400.0),
    "report, 200 stimuli, 19,900 trials": (10.0, 400.0),
    "resume after 19,850 trials": (4.0, 400.0),
    "scores of a DataFrame, 1,000,000 answers of 20,000 observers to 150 items": (10.0, 1000.0),
}
MOST_READING_S = 4.0
MOST_BESIDE_FIT = 1.3
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
SCORED = """
import json, re, sys, time
from pathlib import Path
import cyclopean
from benchmarks.large_results import large_frame
frame = large_frame(*map(int, sys.argv[1:]))
cyclopean.scores(frame.head(1000), method="firth")
start = time.process_time()
cyclopean.scores(frame).to_frame()
peak = re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())
kept = {"seconds": time.process_time() - start, "peak_mb": int(peak[1]) / 1e3 if peak else None}
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
            header = new_header("large", code, "s1", UTC, question="Which?", simulated=True, stimuli=shown)
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
                    recorder.append(
                        new_trial(0, number, "all_pairs", (event,), time_s, UTC, {**data, "clipping": costs})
                    )
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


def large_frame(answers: int, items: int, observers: int) -> pd.DataFrame:
    """Return answers to random pairs of items, whose scores are normal with sd 1."""
    rng = np.random.default_rng(1)
    theta, first = rng.standard_normal(items), rng.integers(items, size=answers)
    second = (first + rng.integers(1, items, answers)) % items
    wins = rng.random(answers) < 1 / (1 + np.exp(theta[second] - theta[first]))
    names = np.array([f"picture {number}" for number in range(items)], dtype=object)
    people = np.array([f"{number:05d}" for number in range(observers)], dtype=object)
    pairs = {"winner": names[np.where(wins, first, second)], "loser": names[np.where(wins, second, first)]}
    return pd.DataFrame({**pairs, "observer": people[rng.integers(observers, size=answers)]})


def in_other_layouts(frame: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Return the answers of `large_frame` as choices from two items, and as the trials of results."""
    either = np.arange(len(frame)) % 2 == 0
    first, second = (np.where(side, frame["winner"], frame["loser"]) for side in (either, ~either))
    asked = {"observer": frame["observer"], "kind": "all_pairs", "first": first, "second": second}
    told = {"answer": np.where(either, "first", "second"), "chosen": frame["winner"], "rejected": frame["loser"]}
    rest = {"experiment": "e", "catch": None, "group": None, "simulated": False}
    return {
        "choices": pd.DataFrame(
            {"observer": frame["observer"], "item_a": first, "item_b": second, "choice": frame["winner"]}
        ),
        "trials": pd.DataFrame({**asked, **told, **rest}),
    }


def beside_fit(answers: int, items: int, observers: int, repeats: int = 5) -> dict[str, float]:
    """Return the least seconds of reading a frame, of `fit_model`, and of `scores` without and with its table."""
    frame = large_frame(answers, items, observers)
    read = comparisons(frame)
    works: dict[str, Callable[[], object]] = {
        "reading": lambda: comparisons(frame),
        "fit": lambda: fit_model(read),
        "scores": lambda: cyclopean.scores(frame),
        "table": lambda: cyclopean.scores(frame).to_frame(),
    }
    least = dict.fromkeys(works, float("inf"))
    for _ in range(sized(repeats, 1)):
        for name, work in works.items():
            start = process_time()
            work()
            least[name] = min(least[name], process_time() - start)
    return least


def measured(words: list[str], folder: Path, program: str = _MEASURED) -> tuple[float, float | None]:
    """Run a command of ``cyclopean`` in ``folder``; return its seconds of processor and its peak in megabytes."""
    root = str(Path(__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", program, *words],
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
            program_text = _MEASURED
            if name.startswith("scores"):
                words, program_text = ["1000000", "150", "20000"], SCORED
            elif name.startswith("resume"):
                words = write_stopped_session(folder / "pictures", sized(200, 8), sized(50, 5))
            else:
                write_sessions(
                    folder / "results", *(sized((500, 10, 2), (4, 4, 1)) if "500" in name else (1, sized(200, 8), 1))
                )
                words = ["report", "results"]
            taken, peak_mb = measured(words, folder, program_text)
        note = f"{taken:.1f} s of a processor" + ("" if peak_mb is None else f", {peak_mb:.0f} MB")
        rows.append(row(name, "whole process", taken, note=note))
        why = "" if peak_mb is not None else "this system does not say"
        promises.append(Promise(f"{name}, processor", taken, most_s, "seconds", unit="s"))
        promises.append(Promise(f"{name}, memory", peak_mb, most_mb, "share", unit="MB", missing=why))
    whole = large_frame(sized(1_000_000, 1000), 150, sized(20_000, 20))
    for name, frame in {"answers": whole, **in_other_layouts(whole)}.items():
        start = process_time()
        comparisons(frame)
        taken, what = process_time() - start, f"reading a DataFrame of 1,000,000 {name}"
        rows.append(row(what, "reading", taken, note=""))
        promises.append(Promise(what, taken, MOST_READING_S, "seconds", unit="s"))
    for items in sized((300, 1000), (30,)):
        found = beside_fit(sized(200_000, 2000), items, sized(1000, 20))
        both, name = found["reading"] + found["fit"], f"scores of {items} items, 200,000 answers of 1,000 observers"
        note = ", ".join(f"{what} {taken * 1e3:.0f} ms" for what, taken in found.items())
        rows.append(row(name, "scores", found["scores"], note=note))
        beside = f"{name}, beside reading them and fit_model"
        promises.append(Promise(beside, found["scores"] / both, MOST_BESIDE_FIT, "ratio", unit="×"))
        promises.append(Promise(f"{beside}, with the table", found["table"] / both, None, "ratio", unit="×"))
    return {"title": "Large results", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("large_results", run)
