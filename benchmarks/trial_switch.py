"""Switching pictures and redrawing them in a real window, beside PsychoPy's ImageStim: same pictures, screen and GL.

PsychoPy runs in an environment of its own (`make bench` makes it in .venv-psychopy); without it its rows are left out
with a note. Times are whole frames: draw, swap, finish. A switch cannot take less than a frame that changes nothing, so
that is what it is promised beside; how it stands to PsychoPy's is followed.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np
from curves import program, row, sized
from promises import Promise

ROOT = Path(__file__).parents[1]
PSYCHOPY = Path(os.environ.get("PSYCHOPY_PYTHON", ROOT / ".venv-psychopy/bin/python"))
PAIRS, FRAMES = sized((6, 60), (2, 4))
SIZE_PX = sized((1920, 1080), (320, 180))


def run() -> dict[str, object]:
    """Time both programs on one virtual screen."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        ours = _measure([sys.executable, __file__, "--ours", str(folder), *sized([], ["--quick"])])
        if not PSYCHOPY.exists():
            rows = _rows("cyclopean", ours)
            return {"title": "Trial switch and steady frame", "rows": rows, "promises": _promises(ours, None)}
        script = Path(__file__).parent / "peers/psychopy_switch.py"
        theirs = _measure([str(PSYCHOPY), str(script), str(folder), str(FRAMES)])
    rows = _rows("cyclopean", ours) + _rows("PsychoPy", theirs)
    return {"title": "Trial switch and steady frame", "rows": rows, "promises": _promises(ours, theirs)}


def _promises(ours: dict[str, list[float]], theirs: dict[str, list[float]] | None) -> list[Promise]:
    switch = median(ours["prefetched"]) / median(ours["steady"])
    promises = [Promise("a switch beside a steady frame", switch, 1.2, "ratio", unit="×")]
    for name, key, own in (
        ("a switch beside PsychoPy's preloaded stimuli", "prefetched", "prefetched"),
        ("a switch beside PsychoPy's ImageStim with a new picture set", "set_image", "prefetched"),
        ("a steady frame beside PsychoPy's", "steady", "steady"),
    ):
        ratio = median(theirs[key]) / median(ours[own]) if theirs else None
        why = "" if theirs else "PsychoPy cannot be installed here"
        promises.append(Promise(name, ratio, None, "ratio", "at least", "×", missing=why))
    return promises


def _rows(series: str, times: dict[str, list[float]]) -> list[dict[str, object]]:
    names = {
        "steady": "steady frame",
        "prefetched": "switch, pictures prefetched",
        "set_image": "switch, a new picture set from its file",
    }
    return [row(series, names[key], median(values)) for key, values in times.items()]


def _measure(command: list[str]) -> dict[str, list[float]]:
    if shutil.which("xvfb-run") is None:
        sys.exit("this benchmark needs xvfb-run (package xvfb)")
    screen = ["xvfb-run", "-a", "-s", f"-screen 0 {SIZE_PX[0]}x{SIZE_PX[1]}x24"]
    path = os.pathsep.join([str(ROOT), str(Path(__file__).parent)])
    told = subprocess.run([*screen, *command], capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path})
    if told.returncode:
        sys.exit(told.stderr)
    times: dict[str, list[float]] = json.loads(told.stdout.strip().splitlines()[-1])
    return times


def ours(folder: Path) -> None:
    """Write the pictures as PNG for PsychoPy, then time our own frames; prints one line of JSON."""
    from PIL import Image

    from devices.display.display_file import read_display
    from runner.presenter.modes.registry import find_mode
    from runner.presenter.presenter import Presenter
    from runner.presenter.surfaces.opening import open_surface
    from runner.scene import Picture, Scene
    from stimuli.pictures.stereo_image import StereoImage

    models = read_display(ROOT / "configs/displays/asus_vg248qe.yaml").models("side-by-side")
    rng = np.random.default_rng(0)
    pictures: dict[str, StereoImage] = {}
    for number in range(PAIRS):
        codes = {
            eye: rng.integers(0, 240, (SIZE_PX[1], SIZE_PX[0] // 2, 3), dtype=np.uint8) for eye in ("left", "right")
        }
        for eye, values in codes.items():
            Image.fromarray(values).save(folder / f"{eye}-{number}.png", compress_level=1)
        left, right = (models.left.xyz(codes[eye] / 255).astype(np.float32) for eye in ("left", "right"))
        pictures[str(number)] = StereoImage(left, right)
    scenes = [Scene((Picture(name),)) for name in pictures]
    mode = find_mode("side-by-side")
    with (
        open_surface("window", SIZE_PX) as surface,
        Presenter(surface, mode, models, pictures.__getitem__) as presenter,
    ):
        for scene in scenes:
            presenter.prefetch(scene)
            presenter.show(scene)
        steady = []
        for _ in range(FRAMES):
            began = perf_counter()
            presenter.redraw()
            steady.append(perf_counter() - began)
        prefetched = []
        for frame in range(FRAMES):
            began = perf_counter()
            presenter.show(scenes[frame % PAIRS])
            prefetched.append(perf_counter() - began)
    print(json.dumps({"steady": steady, "prefetched": prefetched}))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--ours"]:
        ours(Path(sys.argv[2]))
    else:
        program("trial_switch", run)
