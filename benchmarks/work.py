"""What is not done: the work of one session of all pairs, counted, and the processor's time while nobody presses a key.

Counts are exact where clocks are noisy. The window stands on a virtual screen (Xvfb); its wait is ended by a real key.
The error column has no meaning here.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
from itertools import combinations
from pathlib import Path
from time import monotonic, perf_counter, sleep

import numpy as np
from curves import Row, program, row, sized
from promises import Promise

from devices.display.display_file import read_display
from runner.presenter.modes.registry import find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.surfaces.opening import open_surface
from runner.scene import Picture, Scene, Text
from stimuli.pictures.stereo_image import StereoImage

ROOT = Path(__file__).parents[1]
SIZE_PX = (640, 480)
SETTLING_S, IDLE_S = sized((0.5, 10.0), (0.3, 0.5))
MOST_IDLE_PERCENT = 1.0
UPLOADS = PASSES = 15


def _pictures() -> dict[str, StereoImage]:
    """Five stereo pictures and their five flat versions."""
    model = read_display(ROOT / "configs/displays/asus_vg248qe.yaml").models("side-by-side").left
    rng = np.random.default_rng(0)
    found = {}
    for number in range(5):
        left, right = (model.xyz(rng.uniform(0, 0.9, (120, 160, 3))).astype(np.float32) for _ in range(2))
        found[f"{number} stereo"], found[f"{number} flat"] = StereoImage(left, right), StereoImage.flat(left)
    return found


def session_row() -> tuple[Row, list[Promise]]:
    """Show all 45 pairs of ten stimuli as a session does, and count."""
    pictures = _pictures()
    pairs = [Scene((Picture(a, (0, -70)), Picture(b, (0, 70)))) for a, b in combinations(pictures, 2)]
    models = read_display(ROOT / "configs/displays/asus_vg248qe.yaml").models("side-by-side")
    with (
        open_surface("egl", SIZE_PX) as surface,
        Presenter(surface, find_mode("side-by-side"), models, pictures.__getitem__) as presenter,
    ):
        began = perf_counter()
        for scene, following in zip(pairs, [*pairs[1:], Scene()], strict=True):
            presenter.show(scene)
            presenter.prefetch(following)
        taken = perf_counter() - began
        work = presenter.counters
    note = f"{work.uploads} uploads, {work.colour_passes} colour passes, {work.frames_drawn} draws"
    line = row("session", "45 pairs of ten", taken, note=note)
    promises = [
        Promise(
            "uploads for 45 pairs of five stereo and five flat pictures", work.uploads, UPLOADS, "count", "exactly"
        ),
        Promise("colour passes for them", work.colour_passes, PASSES, "count", "exactly"),
        Promise("draws for them", work.frames_drawn, len(pairs), "count", "exactly"),
    ]
    return line, promises


def idle_row() -> tuple[Row, Promise]:
    """Wait for a key in a window, in a process of its own, and tell the share of a core that it took."""
    missing = [tool for tool in ("xvfb-run", "xdotool") if shutil.which(tool) is None]
    name, unit = "a core's time while nobody presses a key", "%"
    if missing:
        why = f"{' and '.join(missing)} not installed"
        line: Row = row("idle wait", "window", None, note=why)
        return line, Promise(name, None, MOST_IDLE_PERCENT, "share", unit=unit, missing=why)
    screen = ["xvfb-run", "-a", "-s", f"-screen 0 {SIZE_PX[0]}x{SIZE_PX[1]}x24"]
    told = subprocess.run(
        [*screen, sys.executable, __file__, "--wait", *sized([], ["--quick"])],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
        env=_environment(),
    )
    found = json.loads(told.stdout.strip().splitlines()[-1])
    percent = 100 * found["busy_s"] / found["waited_s"]
    note = f"{percent:.2f} % of one core over {found['waited_s']:.1f} s"
    line = row("idle wait", "window", found["busy_s"], note=note)
    return line, Promise(name, percent, MOST_IDLE_PERCENT, "share", unit=unit)


def wait() -> None:
    """Show words and a picture, then wait for the key; prints the time and the whole process's processor time."""
    models = read_display(ROOT / "configs/displays/asus_vg248qe.yaml").models("side-by-side")
    with (
        open_surface("window", SIZE_PX) as surface,
        Presenter(surface, find_mode("side-by-side"), models, _pictures().__getitem__) as presenter,
    ):
        presenter.show(Scene((Picture("0 stereo"), Text("Which?", (0, -150)))))
        # Another process presses the key, so that its time is not counted here.
        key = subprocess.Popen(["sh", "-c", f"sleep {SETTLING_S + IDLE_S}; xdotool key x"])
        sleep(SETTLING_S)
        before, began = resource.getrusage(resource.RUSAGE_SELF), monotonic()
        surface.wait_key()
        waited = monotonic() - began
        after = resource.getrusage(resource.RUSAGE_SELF)
        key.wait()
    busy = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    print(json.dumps({"waited_s": waited, "busy_s": busy}))


def _environment() -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if name != "WAYLAND_DISPLAY"}
    return kept | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(Path(__file__).parent)])}


def run() -> dict[str, object]:
    """Count and wait."""
    (session, counted), (idle, waited) = session_row(), idle_row()
    return {"title": "Work that is not done", "rows": [session, idle], "promises": [*counted, waited]}


if __name__ == "__main__":
    if sys.argv[1:2] == ["--wait"]:
        wait()
    else:
        program("work", run)
