"""What is shared among cores, by one thread and by two: run time, and the difference between the results: none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from curves import Row, program, row, seconds, sized, times_faster
from numpy.typing import NDArray
from promises import Promise, worst

from devices.colour import delta_e_2000
from devices.compensation import eye_clip_costs
from devices.display import read_display
from documents import at_most_threads
from extensions.sparkle import SparklePlateRecipe, scatter_flakes
from extensions.sparkle.studio import sparkle_map
from stimuli.develop.demosaic import RGB, Mosaic, by_bands
from stimuli.measures import SeenPicture, difference_map
from stimuli.pictures.resampling import axis_weights, resample
from stimuli.recipes import read_recipe

ROOT = Path(__file__).parents[1]
SIDE_PX = sized(1200, 120)
Floats = NDArray[np.floating]


def run() -> dict[str, object]:
    """Time each with one thread and with two, in turn."""
    rows: list[Row] = []
    for name, work in _users():
        alone, shared = _limited(work, 1), _limited(work, 2)
        ratio, error = times_faster(shared, alone, rounds=sized(3, 1)), float(np.abs(shared() - alone()).max())
        for threads, limited in ((1, alone), (2, shared)):
            note = f"{ratio:.2f} × as fast as with one" if threads == 2 else ""
            taken = seconds(limited, repeats=3)
            rows.append(row(name, threads, taken, error, note=note))
    promises = [Promise("largest difference between one thread and two", worst(rows), 0.0, "error", "exactly")]
    return {"title": "Work over pixels by one thread and by two", "rows": rows, "promises": promises}


def _limited(work: Callable[[], Floats], threads: int) -> Callable[[], Floats]:
    def limited() -> Floats:
        with at_most_threads(threads):
            return work()

    return limited


def _users() -> list[tuple[str, Callable[[], Floats]]]:
    rng = np.random.default_rng(0)
    white = np.array([95.0, 100.0, 109.0])
    one, other = (rng.uniform(0, 1, (SIDE_PX, SIDE_PX, 3)).astype(np.float32) * white.astype(np.float32) for _ in "ab")
    labs = rng.uniform([0, -90, -90], [100, 90, 90], (2, SIDE_PX * SIDE_PX // 4, 3))
    mosaic = Mosaic(one[..., 0] / 95, one[..., 0] > 94, np.array([[0, 1], [1, 2]]))
    rgb = np.empty(one.shape, np.float32)
    models = read_display(ROOT / "configs/displays/asus_vg248qe.yaml").models("side-by-side")
    weights = axis_weights(SIDE_PX, SIDE_PX * 0.1, 0.27)
    recipe, _ = read_recipe(ROOT / "configs/stimuli/manitoba_gray.yaml")
    assert isinstance(recipe, SparklePlateRecipe)
    plate = replace(recipe.plate.plate(), width_mm=SIDE_PX / 40, height_mm=SIDE_PX / 60)
    flakes, lamp, camera = scatter_flakes(plate, seed=1), recipe.lamp, recipe.camera

    def seen() -> Floats:
        pictures = (SeenPicture(picture, 45.0, white) for picture in (one, other))
        return difference_map(*pictures, white, filtered=True)

    def keep(band: slice, part: RGB) -> None:
        rgb[band] = part[0]

    def developed() -> Floats:
        by_bands(mosaic, "malvar", keep)
        return rgb.copy()

    def clipped() -> Floats:
        costs = eye_clip_costs(models, None, one, other)
        return np.array([list(costs[eye].values()) for eye in ("left", "right")])

    return [
        ("CIEDE2000", lambda: delta_e_2000(*labs)),
        ("map of CIEDE2000", lambda: difference_map(one, other, white)),
        ("S-CIELAB", seen),
        ("resampling", lambda: resample(one[..., 1], weights, weights)),
        ("developing", developed),
        ("clip costs", clipped),
        ("sparkle plate", lambda: sparkle_map(plate, lamp, camera, "left", flakes, cull=False).luminance_cd_m2),
    ]


if __name__ == "__main__":
    program("threads", run)
