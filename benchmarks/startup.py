"""How soon the help text appears, beside the least that any click program takes; and what each command's start costs.

Each command works on the smallest real input, in a process of its own. Its start is the processor time of the
interpreter and of all imports, whenever they happen; the rest is its own work. Python's compiled files are kept, as an
installation keeps them, and of three runs the least counts. The error column has no meaning here.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
from curves import program, seconds, sized, times_faster
from PIL import Image
from promises import Promise

PROGRAMS = {
    "cyclopean --help": "import sys; sys.argv = ['cyclopean', '--help']; from runner.cli.main import main; main()",
    "import click": "import click",
}
ROOT = Path(__file__).parents[1]
# A goal for all. NumPy, pydantic and YAML take some 0.2 s of it; above it is what needs an experiment's models of
# blocks and recipes (0.4 s more), SciPy (0.2 s more) or matplotlib (0.4 s more).
LIMIT_S = 0.35
# Prints the processor seconds of the start and of the whole process, and takes words for the command line.
MEASURED = """
import sys, time
from importlib import _bootstrap
taken, depth, load = time.process_time(), 0, _bootstrap._find_and_load
def timed(name, import_):
    global taken, depth
    if name in sys.modules:
        return load(name, import_)
    depth, before = depth + 1, time.process_time()
    try:
        return load(name, import_)
    finally:
        depth -= 1
        taken += 0 if depth else time.process_time() - before
_bootstrap._find_and_load = timed
from runner.cli.main import main
try:
    main()
finally:
    print(taken, time.process_time(), file=sys.stderr)
"""
STUDY, RIG = "study/experiment.yaml", str(ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml")
DISPLAY = str(ROOT / "configs/displays/asus_vg248qe.yaml")
# In this order: some read what others have written.
COMMANDS = (
    "help check",
    "completion bash",
    "schema experiment",
    "new study{run} pictures",
    f"check {STUDY}",
    "stimuli build study/stimuli.yaml --rig study/rig.yaml",
    "stimuli list",
    f"run {STUDY} --observer 01{{run}} --simulate study/simulated.yaml --results results",
    f"preview {STUDY} -o screens --first 1",
    "verify results",
    "seal results --replace",
    "export results -o bids --name small",
    "report results -o report.html",
    "agreement results --measures delta-e-2000 --photograph a -o agreement.html",
    "scores table.csv",
    f"power {STUDY} --scores study/simulated.yaml --observers 5 --replicates 20",
    "display new -o monitor{run}.yaml --white-cd-m2 120 --panel 1920x1080,0.2768",
    f"display patches {RIG} --list",
    f"display convert codes.csv --display {DISPLAY} --mode side-by-side --to xyz",
    "display fit readings.csv",
    "display report readings.csv -o display.html",
    "camera geometry --sensor-mm 36x24 --pixels 7360x4912 --focal-mm 105 --distance-mm 700",
    "doctor",
)
QUICK = ("help check", "scores table.csv")
GROUPS = ("display", "camera", "stimuli")


def _started(code: str) -> None:
    subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)


def run() -> dict[str, object]:
    """Time both programs in turn, then each command."""
    rows: list[dict[str, object]] = []
    for name, code in PROGRAMS.items():
        taken = seconds(partial(_started, code), repeats=3)
        rows.append({"series": name, "parameter": "whole process", "seconds": taken, "error": None})
    ours, click = (partial(_started, code) for code in PROGRAMS.values())
    ratio = 1 / times_faster(ours, click, rounds=sized(9, 1))
    promises = [Promise("cyclopean --help beside import click", ratio, 2.0, "ratio", unit="×")]
    for name, (start, whole) in _commands().items():
        rows.append({"series": name, "parameter": "start", "seconds": start, "error": None})
        rows.append({"series": name, "parameter": "whole process", "seconds": whole, "error": None})
        promises.append(Promise(f"start of {name}, processor", start, LIMIT_S, "seconds", unit="s"))
    return {"title": "Start-up", "rows": rows, "promises": promises}


def _commands() -> dict[str, tuple[float, float]]:
    """Return the seconds of processor of each command's start and of its whole process."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        _write_inputs(place)
        own = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
        own |= {"PYTHONPATH": str(ROOT)} | sized({"PYTHONPYCACHEPREFIX": str(place / "compiled")}, {})
        own |= {"CYCLOPEAN_CACHE": str(place / "cache"), "CYCLOPEAN_STATE": str(place / "state")}
        for words in sized(COMMANDS, QUICK):
            # The first run compiles. Some write where nothing may be: the later ones of them under other names.
            runs = [_measured(words.format(run=run), place, own) for run in ("", "2", "3")[: sized(3, 1)]]
            start, whole = (min(values) for values in zip(*runs, strict=True))
            found[f"cyclopean {' '.join(words.split()[: 1 + words.startswith(GROUPS)])}"] = (start, whole)
    return found


def _measured(words: str, place: Path, environment: dict[str, str]) -> tuple[float, float]:
    command = [sys.executable, "-c", MEASURED, *words.split()]
    done = subprocess.run(command, capture_output=True, text=True, cwd=place, env=environment)
    if done.returncode:
        raise RuntimeError(f"cyclopean {words}: {done.stderr}")
    start, whole = done.stderr.splitlines()[-1].split()
    return float(start), float(whole)


def _write_inputs(place: Path) -> None:
    """Write four pictures, answers to ten items, codes, and readings of 120 patches."""
    from devices.characterise import table_c1_codes, thesis_display

    random = np.random.default_rng(1)
    (place / "pictures").mkdir()
    picture = random.integers(40, 200, (40, 60, 3), dtype=np.uint8)
    for step, name in enumerate("abcd"):
        Image.fromarray(picture + np.uint8(5 * step)).save(place / "pictures" / f"{name}.png")
    pairs = [(a, b) for _ in range(20) for a in range(10) for b in range(10) if a != b and random.random() < 0.5]
    lines = ["winner,loser", *(f"s{a},s{b}" for a, b in pairs)]
    (place / "table.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (place / "codes.csv").write_text("red,green,blue\n0.1,0.2,0.3\n", encoding="utf-8")
    known = table_c1_codes()
    codes = np.vstack([known, random.random((120 - len(known), 3))]).round(4)
    light = thesis_display().xyz(codes) * (1 + 0.002 * random.normal(size=codes.shape))
    lines = ["R,G,B,X,Y,Z", *(",".join(f"{value:.6g}" for value in row) for row in np.hstack([codes, light]))]
    (place / "readings.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    program("startup", run)
