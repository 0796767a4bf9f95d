"""A new study of 20 pairs of JPEG of 2 megapixels: checked, checked again, previewed, beside writing the PNG files.

`check` builds the stimuli and computes what the gamut costs; again, it finds both: the costs are counted, two, since
the 20 pairs show two scenes. `preview` draws each screen that differs once and writes it for each eye; beside it,
Pillow writes the same codes as PNG. The error of a preview is the largest difference of its codes from those that
Pillow's own copy gives back: 0; of `check`, whether two runs say the same. Files and bytes are counted.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any, TypeVar

import numpy as np
from curves import program, sized
from ordinary_pictures import save_pairs
from PIL import Image
from promises import Promise

from devices.display import PanelSpec
from runner.check import check_file
from runner.reports import preview
from runner.studies import StudyOptions, new_study

PANEL = PanelSpec(resolution_px=sized((1920, 1080), (480, 270)), pixel_pitch_mm=0.2768)
FIRST = sized(10, 2)
COUNTED = ("clipping_costs_computed", "clipping_costs_cached", "pictures_rendered")
Made = TypeVar("Made")


def timed(work: Callable[[], Made]) -> tuple[float, Made]:
    """Return how many seconds ``work`` takes, and what it gives."""
    began = perf_counter()
    made = work()
    return perf_counter() - began, made


def written_again(files: tuple[Path, ...], folder: Path) -> tuple[float, int]:
    """Return in how many seconds Pillow writes the same pictures, and the largest difference of their codes."""
    folder.mkdir()
    codes = [np.asarray(Image.open(file)) for file in files]

    def save() -> None:
        for number, picture in enumerate(codes):
            Image.fromarray(picture).save(folder / f"{number}.png")

    seconds, _ = timed(save)
    again = [np.asarray(Image.open(folder / f"{number}.png")) for number in range(len(codes))]
    worst = max(int(np.abs(one.astype(int) - other).max()) for one, other in zip(codes, again, strict=True))
    return seconds, worst


def run(pairs: int = sized(20, 2)) -> dict[str, Any]:
    """Check twice; preview whole, as a sheet, and its first trials."""
    rows: list[dict[str, Any]] = []
    before = os.environ.get("CYCLOPEAN_CACHE")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ["CYCLOPEAN_CACHE"] = f"{name}/cache"
        try:
            (folder / "photos").mkdir()
            save_pairs(folder / "photos", pairs)
            study = new_study(folder / "study", [folder / "photos"], StudyOptions(panel=PANEL)).folder
            experiment, what = study / "experiment.yaml", f"{pairs} pairs of 2 megapixels"
            seconds, first = timed(lambda: check_file(experiment))
            rows.append({"series": "check, pictures built", "parameter": what, "seconds": seconds, "error": None})
            again, second = timed(lambda: check_file(experiment))
            said = [
                {key: report.facts[key] for key in report.facts if key not in COUNTED} for report in (first, second)
            ]
            same = said[0] == said[1] and not first.errors
            costs = ", ".join(f"{report.facts[COUNTED[0]]}" for report in (first, second))
            note = f"{seconds / again:.0f} times as fast as the first time; costs computed: {costs}"
            rows.append(
                {"series": "check again", "parameter": what, "seconds": again, "error": float(not same), "note": note}
            )
            shown: dict[str, dict[str, Any]] = {
                f"preview, first {FIRST} trials": {"first": FIRST},
                f"preview --sheet, first {FIRST} trials": {"first": FIRST, "sheet": True},
            }
            for series, options in shown.items():
                place = folder / series.replace(" ", "_")
                seconds, files = timed(partial(preview, experiment, place, **options))
                size = sum(file.stat().st_size for file in files) / 1e6
                note = f"{len(files)} files, {size:.1f} MB"
                row: dict[str, object] = {"series": series, "parameter": what, "seconds": seconds, "error": None}
                if "sheet" not in options:
                    pillow, row["error"] = written_again(files, folder / f"{place.name}_again")
                    note += f"; {seconds / pillow:.2f} times Pillow's writing of them"
                    rows.append(
                        {"series": "Pillow writes the same", "parameter": series, "seconds": pillow, "error": None}
                    )
                rows.append({**row, "note": note})
        finally:
            os.environ.pop("CYCLOPEAN_CACHE", None)
            if before is not None:
                os.environ["CYCLOPEAN_CACHE"] = before
    wrong = max(float(row["error"]) for row in rows if row["error"] is not None)
    promises = [
        Promise("difference of a preview's codes, and of a second check", wrong, 0, "count", "exactly"),
        Promise("clipping costs computed at the second check", second.facts[COUNTED[0]], 0, "count", "exactly"),
    ]
    return {"title": "A study checked and previewed", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("check_preview", run)
