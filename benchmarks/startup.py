"""How soon the help text appears, beside the least that any click program takes; and what each command's start costs.

Each command works on the smallest real input, in a process of its own. Its start is the processor time of the
interpreter and of all imports, whenever they happen; the rest is its own work. Python's compiled files are kept, as an
installation keeps them, and of three runs the least counts; NumPy alone is the measure, as it is most of what a command
that computes imports. Then what extensions of others cost: none beside ours, 200 broken ones, and what looks through
them all. The error column has no meaning here.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
from curves import program, row, seconds, sized, times_faster
from PIL import Image
from promises import Promise

from documents.extensions import Environment
from tests.stress.broken_extensions import install_broken

PROGRAMS = {
    "cyclopean --help": "import sys; sys.argv = ['cyclopean', '--help']; from runner.cli.main import main; main()",
    "import click": "import click",
}
ROOT = Path(__file__).parents[1]
MOST_OF_NUMPY = 3.0
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
NUMPY = "import numpy, sys, time; print(0, time.process_time(), file=sys.stderr)"
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
BROKEN = 200
# Reads a display file, whose curves are of kinds that packages may add.
PATCHES = ["-m", "cyclopean", "display", "patches", RIG, "--list"]


def _started(code: str) -> None:
    subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)


def commands() -> dict[str, object]:
    """Time both programs in turn, then each command beside NumPy."""
    rows: list[dict[str, object]] = []
    for name, code in PROGRAMS.items():
        rows.append(row(name, "whole process", seconds(partial(_started, code), repeats=3)))
    ours, click = (partial(_started, code) for code in PROGRAMS.values())
    ratio = 1 / times_faster(ours, click, rounds=sized(9, 1))
    promises = [Promise("cyclopean --help beside import click", ratio, 2.0, "ratio", unit="×")]
    for name, (start, whole, numpy) in _commands().items():
        rows.append(row(name, "start", start, note=f"{start / numpy:.2f} × import numpy, {numpy:.3f} s"))
        rows.append(row(name, "whole process", whole))
        promise = f"start of {name} beside import numpy, processor"
        promises.append(Promise(promise, start / numpy, MOST_OF_NUMPY, "ratio", unit="×"))
    return {"title": "Start-up", "rows": rows, "promises": promises}


def others() -> dict[str, object]:
    """Time starts beside broken extensions of others in turn, and a look through the environment."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        install_broken(place / "site", BROKEN)
        numpy = partial(_started_beside, ["-c", "import numpy"], place)
        ours = partial(_started_beside, PATCHES, place)
        beside = partial(_started_beside, PATCHES, place, place / "site")
        works = {"import numpy": numpy, "ours alone": ours, f"{BROKEN} broken ones": beside}
        rows = [row(name, "whole process", seconds(work, repeats=3)) for name, work in works.items()]
        for name, path in (("ours alone", None), (f"{BROKEN} broken ones", [*sys.path, str(place / "site")])):
            rows.append(row(name, "looking through all", seconds(Environment(path).scan, repeats=3)))
        beside_numpy, beside_ours = (
            1 / times_faster(one, other, rounds=sized(9, 1)) for one, other in ((ours, numpy), (beside, ours))
        )
    promises = [
        Promise("display patches beside import numpy", beside_numpy, None, "ratio", unit="×"),
        Promise(f"the same with {BROKEN} broken extensions", beside_ours, 1.2, "ratio", unit="×"),
    ]
    return {"title": "Extensions at the start", "rows": rows, "promises": promises}


def _started_beside(words: list[str], place: Path, *sites: Path) -> None:
    own = _environment(place) | {"PYTHONPATH": os.pathsep.join(map(str, (ROOT, *sites)))}
    own |= {"PYTHONPYCACHEPREFIX": str(place / "compiled"), "XDG_CACHE_HOME": str(place / f"known-{len(sites)}")}
    subprocess.run([sys.executable, *words], capture_output=True, check=True, cwd=place, env=own)


def _environment(place: Path) -> dict[str, str]:
    """Return that of a process whose compiled files are kept, as an installation keeps them."""
    own = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    return own | {"PYTHONPATH": str(ROOT)} | sized({"PYTHONPYCACHEPREFIX": str(place / "compiled")}, {})


def _commands() -> dict[str, tuple[float, float, float]]:
    """Return the processor seconds of each command's start, of its whole process, and of NumPy's import beside it."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        _write_inputs(place)
        own = _environment(place) | {"CYCLOPEAN_CACHE": str(place / "cache"), "CYCLOPEAN_STATE": str(place / "state")}
        for words in sized(COMMANDS, QUICK):
            runs = []
            # The first run compiles. Some write where nothing may be: the later ones of them under other names.
            for run in ("", "2", "3")[: sized(3, 1)]:
                numpy = _measured(NUMPY, place, own)[1]
                runs.append((*_measured(MEASURED, place, own, *words.format(run=run).split()), numpy))
            start, whole, numpy = (min(values) for values in zip(*runs, strict=True))
            found[f"cyclopean {' '.join(words.split()[: 1 + words.startswith(GROUPS)])}"] = (start, whole, numpy)
    return found


def _measured(code: str, place: Path, environment: dict[str, str], *words: str) -> tuple[float, float]:
    command = [sys.executable, "-c", code, *words]
    done = subprocess.run(command, capture_output=True, text=True, cwd=place, env=environment)
    if done.returncode:
        raise RuntimeError(f"cyclopean {' '.join(words)}: {done.stderr}")
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
    program("startup", commands, others)
