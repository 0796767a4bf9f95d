"""The thesis's 90 pictures, built by one thread and by two, changed in one picture, and found again.

The second time, files that nobody touched are not hashed again; beside it, every file is read (`--verify`), which is
what a plain check does. Times are of this process: wall clock, and processor time beside it, which other work on the
machine changes less. The error is that of a build's digest against the first one's: 0 where all pictures are equal.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time, sleep
from typing import Any

import numpy as np
import yaml
from curves import is_quick, program, sized
from promises import Promise

from stimuli.build.recipe_to_set import build_set
from stimuli.build.stimulus_set import StimulusSet
from stimuli.pictures import StereoImage, write_exr

RECIPE = Path(__file__).parents[1] / "configs/stimuli/exposure_series.yaml"
PITCH_MM = sized(0.2768, 4.0)
LARGE_PX = sized((7360, 4912), (400, 300))
LARGE_RECIPE = """schema_version: 1
kind: pictures
luminance: {scale: 0.9}
stimuli: [{name: large, file: large.exr}]
"""
# Builds a recipe, in bands of rows where pictures have so many pixels, and prints what that took.
BUILDING = """
import json, os, re, sys, time
from pathlib import Path
import OpenImageIO, stimuli.build.builder, stimuli.recipes.banded_picture as banded
from stimuli.build import build_set
os.environ["CYCLOPEAN_CACHE"], banded.LEAST_PX = sys.argv[2], int(sys.argv[3])
wall, cpu = time.perf_counter(), time.process_time()
made = build_set(Path(sys.argv[1]), 0.2768)
taken = time.perf_counter() - wall, time.process_time() - cpu
# Not `resource`'s peak: that begins with the one of the process that started this one. It is known on Linux alone.
status = Path("/proc/self/status")
peak = re.search(r"VmHWM:\\s+([0-9]+) kB", status.read_text()) if status.exists() else None
print(json.dumps([*taken, int(peak[1]) / 1024 if peak else float("nan"), made.digest]))
"""


def large(folder: Path) -> list[dict[str, Any]]:
    """Build a scaled pair of 36 megapixels at once and in bands, each in a process of its own."""
    rng = np.random.default_rng(0)
    light = rng.uniform(1, 60, (LARGE_PX[1], LARGE_PX[0], 3)).astype(np.float32)
    write_exr(folder / "large.exr", StereoImage(light, light[::-1]))
    del light
    (folder / "large.yaml").write_text(LARGE_RECIPE)
    rows: list[dict[str, Any]] = []
    plain = ""
    for way, least_px in (("at once", 1 << 40), ("in bands of rows", 1)):
        words = str(folder / "large.yaml"), str(folder / way), str(least_px)
        child = subprocess.run(
            [sys.executable, "-c", BUILDING, *words], check=True, stdout=subprocess.PIPE, text=True, encoding="utf-8"
        )
        wall, cpu, peak_mb, digest = json.loads(child.stdout)
        plain = plain or digest
        rows.append(
            {
                "series": f"a large pair, {way}",
                "parameter": f"2 × {LARGE_PX[0] * LARGE_PX[1] / 1e6:.1f} megapixels",
                "seconds": wall,
                "processor seconds": cpu,
                "peak MB": peak_mb,
                "error": 0.0 if digest == plain else 1.0,
            }
        )
    return rows


def run() -> dict[str, Any]:
    """Build, build in two threads, change one series, find, and read all."""
    rows: list[dict[str, Any]] = []
    digests: list[str] = []

    def timed(series: str, work: Callable[[], StimulusSet], same: bool = True) -> None:
        wall, cpu = perf_counter(), process_time()
        made = work()
        wall, cpu = perf_counter() - wall, process_time() - cpu
        digests.append(made.digest)
        rows.append(
            {
                "series": series,
                "parameter": f"{made.rendered} of {len(made.names)} pictures made",
                "made": made.rendered,
                "seconds": wall,
                "processor seconds": cpu,
                "error": 0.0 if made.digest == digests[0] or not same else 1.0,
            }
        )

    with tempfile.TemporaryDirectory() as folder:
        recipe = Path(folder) / "recipe.yaml"
        data = yaml.safe_load(RECIPE.read_text(encoding="utf-8"))
        if is_quick():
            data["plate"]["size_mm"], data["plate"]["flakes"]["per_mm2"] = [30, 20], 20
            data["series"] = data["series"][-2:]
        recipe.write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
        before = os.environ.get("CYCLOPEAN_CACHE")
        os.environ["CYCLOPEAN_CACHE"] = f"{folder}/cache"
        try:
            timed("first build, one thread", lambda: build_set(recipe, PITCH_MM))
            sleep(sized(2.1, 0.0))  # until then the last pictures are too fresh to be relied on
            build_set(recipe, PITCH_MM)
            timed("again, files known", lambda: build_set(recipe, PITCH_MM))
            timed("again, every file read", lambda: build_set(recipe, PITCH_MM, verify=True))
            timed("all anew, two threads", lambda: build_set(recipe, PITCH_MM, jobs=2, force=True))
            data["series"][-1]["luminance_scale"] = 0.9
            recipe.write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
            timed("one series of five paints changed", lambda: build_set(recipe, PITCH_MM, jobs=2), same=False)
        finally:
            os.environ.pop("CYCLOPEAN_CACHE")
            if before is not None:
                os.environ["CYCLOPEAN_CACHE"] = before
    first_s = float(rows[0]["processor seconds"])
    promises = [
        Promise("builds that differ from the first", sum(row["error"] for row in rows), 0, "count", "exactly"),
        Promise("the thesis's 90 pictures, processor", first_s, 180.0, "seconds", unit="s"),
        Promise("pictures made again when one series changed", rows[-1]["made"], None, "count"),
    ]
    with tempfile.TemporaryDirectory() as folder:
        rows += large(Path(folder))
    plain, banded = rows[-2:]
    promises += [
        Promise(
            "files made from bands of rows that differ from those of the whole", banded["error"], 0, "count", "exactly"
        ),
        Promise("memory of bands of rows, as against the whole", banded["peak MB"] / plain["peak MB"], 0.5, "ratio"),
    ]
    return {"title": "Stimuli built from a recipe", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("stimuli_build", run)
