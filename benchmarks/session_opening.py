"""From reading an experiment to its first trial, and to what clipping costs each of its pictures, first and again.

The plain way reads every picture before the first trial, computes its costs unless they are in the cache, and makes it
ready to be shown: what opening a session did. Beside it a session opens with what the cache has, makes the first trial
ready, and computes each other cost when it is needed; the time to all costs is that of asking for all of them at once.
Pictures read are counted. The error is the largest difference of any cost from the plain way's.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

from runner.protocol.experiment import Experiment, read_experiment
from runner.scene import Picture, Scene
from runner.session.clipping_costs import COSTS, ClippingCosts
from runner.session.options import SessionOptions
from runner.session.station import Station
from stimuli.build import StimulusSet, build_set, cache_folder
from stimuli.pictures import StereoImage, write_exr

PICTURES = 90
SIZE_PX = (360, 240)
DISPLAY = Path(__file__).parents[1] / "configs/displays/asus_vg248qe.yaml"
EXPERIMENT = """schema_version: 1
name: opening
rig: rig.yaml
stimuli: recipe.yaml
question: Which is closer?
layout: {arrangement: vertical, size_mm: [95, 60]}
blocks: [{kind: rating, ratings: [{name: closeness, question: "How close is it?"}]}]
"""


def make(folder: Path, pictures: int = PICTURES, size_px: tuple[int, int] = SIZE_PX) -> Path:
    """Write an experiment of ``pictures`` noisy pictures and return its file."""
    rng = np.random.default_rng(1)
    names = [f"p{number:03d}" for number in range(pictures)]
    light = rng.uniform(1, 60, (size_px[1], size_px[0], 3)).astype(np.float32)
    for number, name in enumerate(names):
        write_exr(
            folder / f"{name}.exr", StereoImage.flat(np.roll(light, number, axis=0) * np.float32(1 + number / 1000))
        )
    listed = "".join(f"  - {{name: {name}, file: {name}.exr}}\n" for name in names)
    (folder / "recipe.yaml").write_text(f"schema_version: 1\nkind: pictures\nstimuli:\n{listed}")
    (folder / "rig.yaml").write_text(
        f"schema_version: 1\ndisplay: {DISPLAY.as_posix()}\nmode: side-by-side\ndistance_mm: 700\n"
    )
    (folder / "experiment.yaml").write_text(EXPERIMENT)
    return folder / "experiment.yaml"


def built(design: Experiment) -> StimulusSet:
    """Return the experiment's stimuli."""
    return build_set(design.recipe_file, design.rig.display.panel.pixel_pitch_mm)


@contextmanager
def own_cache(folder: Path) -> Iterator[None]:
    """Keep stimuli and costs in ``folder`` meanwhile."""
    before = os.environ.get("CYCLOPEAN_CACHE")
    os.environ["CYCLOPEAN_CACHE"] = str(folder)
    try:
        yield
    finally:
        os.environ.pop("CYCLOPEAN_CACHE")
        if before is not None:
            os.environ["CYCLOPEAN_CACHE"] = before


Costs = Mapping[str, Any]
# Called once the first trial can be shown; the costs and the pictures read are returned.
Opening = Callable[[Experiment, StimulusSet, Callable[[], None]], tuple[Costs, int]]


def plainly(design: Experiment, stimuli: StimulusSet, first_trial: Callable[[], None]) -> tuple[Costs, int]:
    """Read every picture, for its costs and to be shown, before the first trial."""
    with Station.open(design, stimuli, SessionOptions(Path("unused"), backend="egl")) as station:
        costs = ClippingCosts.of(design, stimuli, station.pictures.stimulus)
        known = {}
        for name in stimuli.names:
            known[name] = costs.description(name)["clipping"]
            station.presenter.prefetch(Scene((Picture(name),)))
        first_trial()
        return known, station.pictures.read


def in_turn(design: Experiment, stimuli: StimulusSet, first_trial: Callable[[], None]) -> tuple[Costs, int]:
    """Open as a session does, make the first trial ready, then ask for all costs."""
    with Station.open(design, stimuli, SessionOptions(Path("unused"), backend="egl")) as station:
        station.presenter.prefetch(Scene(tuple(Picture(name) for name in stimuli.names[:2])))
        first_trial()
        return station.costs.of(stimuli.names), station.pictures.read


def run(pictures: int = PICTURES, size_px: tuple[int, int] = SIZE_PX) -> dict[str, Any]:
    """Open first and again, both ways."""
    rows: list[dict[str, Any]] = []
    reference: Costs = {}

    def timed(series: str, open_session: Opening) -> None:
        nonlocal reference
        design = read_experiment(folder / "experiment.yaml")
        stimuli = built(design)
        began, cpu = perf_counter(), process_time()
        first_s = cpu_first_s = 0.0

        def first_trial() -> None:
            nonlocal first_s, cpu_first_s
            first_s, cpu_first_s = perf_counter() - began, process_time() - cpu

        costs, read = open_session(design, stimuli, first_trial)
        all_s, cpu_all_s = perf_counter() - began, process_time() - cpu
        reference = reference or costs
        error = max(largest_difference(costs[name], reference[name]) for name in reference)
        for what, wall, processor in (("first trial", first_s, cpu_first_s), ("all costs", all_s, cpu_all_s)):
            rows.append(
                {
                    "series": series,
                    "parameter": f"to {what}",
                    "seconds": wall,
                    "processor seconds": processor,
                    "pictures read": read,
                    "error": error,
                }
            )

    with tempfile.TemporaryDirectory() as path, own_cache(Path(path) / "cache"):
        folder = Path(path)
        make(folder, pictures, size_px)
        built(read_experiment(folder / "experiment.yaml"))
        timed("plainly, first time", plainly)
        timed("plainly, again", plainly)
        for file in (cache_folder() / COSTS).iterdir():
            file.unlink()
        timed("in turn, first time", in_turn)
        timed("in turn, again", in_turn)
    return {"title": f"Opening a session of {pictures} pictures", "rows": rows}


def largest_difference(one: Any, other: Any) -> float:
    """Return the largest difference of a number in one mapping from that in another."""
    if isinstance(other, Mapping):
        return max((largest_difference(one[key], other[key]) for key in other), default=0.0)
    return abs(float(one) - float(other))


def promised() -> dict[str, Any]:
    """Measure, and state what is promised."""
    from curves import sized
    from promises import Promise, worst

    result = run(sized(PICTURES, 6), sized(SIZE_PX, (60, 40)))
    cpu = {row["series"]: row["processor seconds"] for row in result["rows"] if row["parameter"] == "to first trial"}
    read = next(row["pictures read"] for row in result["rows"] if row["series"] == "in turn, again")
    promises = (
        Promise("costs that came in turn", worst(result["rows"]), 0.0, "error"),
        Promise("pictures read for known costs, beside the first trial's two", read - 2, 0, "count", "exactly"),
        Promise(
            "first trial, the second time, as against reading every picture",
            cpu["plainly, again"] / cpu["in turn, again"],
            2.0,
            "ratio",
            "at least",
            "×",
        ),
    )
    return result | {"promises": promises}


if __name__ == "__main__":
    from curves import program

    program("session_opening", promised)
