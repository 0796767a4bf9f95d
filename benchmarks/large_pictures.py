"""Four stereo pairs of 36 megapixels built by the command, and one of them shown, each in a process of its own.

Seconds are those of the whole command, its start too; processor seconds and the most memory are beside them. The error
column has no meaning here: that bands of rows make the same files is in `stimuli_build.py`.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from curves import program, sized
from promises import Promise

from stimuli.pictures import StereoImage, write_exr

ROOT = Path(__file__).parents[1]
SIZE_PX = sized((7360, 4912), (240, 160))
RIG = ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml"
DISPLAY = ROOT / "configs/displays/asus_vg248qe.yaml"
NAMES = "abcd"
LIMIT_MB = 1200.0
# Runs the program on words; then its seconds, its processor's and the most memory, which Linux alone says.
MEASURED = """
import json, re, sys, time
from pathlib import Path
wall = time.perf_counter()
from runner.cli.main import main
try:
    main()
finally:
    status = Path("/proc/self/status")
    peak = re.search(r"VmHWM:\\s+([0-9]+) kB", status.read_text()) if status.exists() else None
    peak_mb = int(peak[1]) * 1024 / 1e6 if peak else None
    print(json.dumps([time.perf_counter() - wall, time.process_time(), peak_mb]), file=sys.stderr)
"""


def _write_pictures(folder: Path) -> None:
    """Write four pairs of grain that no compression shortens, and a recipe that scales their luminance."""
    width, height = SIZE_PX
    light = np.random.default_rng(0).uniform(1.0, 60.0, (height, width, 3)).astype(np.float32)
    for name, turned in zip(NAMES, (light, light[::-1], light[:, ::-1], light[::-1, ::-1]), strict=True):
        write_exr(folder / f"{name}.exr", StereoImage(turned, turned[:, ::-1]))
    recipe = {
        "schema_version": 1,
        "kind": "pictures",
        "luminance": {"scale": 0.9},
        "stimuli": [{"name": name, "file": f"{name}.exr"} for name in NAMES],
    }
    (folder / "recipe.yaml").write_text(json.dumps(recipe), encoding="utf-8")


def _measured(folder: Path, *words: object) -> tuple[float, float, float | None]:
    """Return a command's seconds, processor seconds and most memory in MB, if the system says it."""
    command = [sys.executable, "-c", MEASURED, *map(str, words)]
    own = {**os.environ, "PYTHONPATH": str(ROOT), "CYCLOPEAN_CACHE": str(folder / "cache")}
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", cwd=folder, env=own)
    if done.returncode:
        raise RuntimeError(f"cyclopean {' '.join(map(str, words))}: {done.stderr}")
    wall, cpu, peak_mb = json.loads(done.stderr.splitlines()[-1])
    return wall, cpu, peak_mb


def run() -> dict[str, Any]:
    """Build in two threads, and show."""
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _write_pictures(folder)
        build = ("stimuli", "build", "recipe.yaml", "--rig", RIG)
        show = ("show", "a.exr", "--display", DISPLAY, "--mode", "side-by-side", "--headless", "--screenshot", "a.png")
        megapixels = f"2 × {SIZE_PX[0] * SIZE_PX[1] / 1e6:.1f} megapixels"
        for series, words in (("four pairs, scaled", (*build, "--jobs", 2)), ("a pair shown", show)):
            wall, cpu, peak_mb = _measured(folder, *words)
            row = {"series": series, "parameter": megapixels, "seconds": wall, "processor seconds": cpu}
            rows.append({**row, "peak MB": peak_mb, "error": None})
    built, shown = rows
    share = None if built["peak MB"] is None else built["peak MB"] / LIMIT_MB
    missing = "" if share is not None else "the system does not say how much memory a process took"
    promises = [
        Promise("four stereo pairs of 36 megapixels, scaled", built["seconds"], 25.0, "seconds", unit="s"),
        Promise("memory that they took, as against 1.2 GB", share, 1.0, "ratio", missing=missing),
        Promise("`show` of one of them", shown["seconds"], 6.0, "seconds", unit="s"),
    ]
    return {"title": "Pictures of 36 megapixels", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("large_pictures", run)
