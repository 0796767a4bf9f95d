"""The thesis's 90 pictures, built by one thread and by two, changed in one picture, and found again.

The second time, files that nobody touched are not hashed again; beside it, every file is read (`--verify`), which is
what a plain check does. Times are of this process: wall clock, and processor time beside it, which other work on the
machine changes less. The error is that of a build's digest against the first one's: 0 where all pictures are equal.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time, sleep
from typing import Any

import yaml
from curves import is_quick, program, sized
from promises import Promise

from stimuli.build.recipe_to_set import build_set
from stimuli.build.stimulus_set import StimulusSet

RECIPE = Path(__file__).parents[1] / "configs/stimuli/exposure_series.yaml"
PITCH_MM = sized(0.2768, 4.0)


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
    return {"title": "Stimuli built from a recipe", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("stimuli_build", run)
