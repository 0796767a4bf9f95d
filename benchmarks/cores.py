"""What cores and compiled loops give: by one thread and two, and by Numba beside the twins in NumPy.

What is shared among cores, by one thread and by two: run time, and the difference between the results: none.

Loops that Numba compiles, beside their twins in NumPy: run time against the difference, with one thread.

Colour differences of XYZ have colour-science beside them. The first call, in which a loop is compiled or loaded, is not
counted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from curves import Row, answer_and_seconds, is_quick, program, row, seconds, sized, times_faster
from numpy.typing import NDArray
from promises import Promise, worst
from sparkle import planted

from devices.colour import delta_e_2000, delta_e_2000_of_xyz
from devices.compensation import eye_clip_costs
from devices.display import read_display
from documents import at_most_threads
from documents.arrays import Floats
from documents.compiled import compiler, without_compiled_loops
from extensions.sparkle import SparklePlateRecipe, scatter_flakes
from extensions.sparkle.studio import sparkle_map
from stimuli.align.warping import warp
from stimuli.develop.demosaic import RGB, Mosaic, by_bands
from stimuli.measures import SeenPicture, difference_map
from stimuli.pictures.resampling import axis_weights, resample
from stimuli.recipes import read_recipe
from stimuli.sparkles.measure import measure_sparkles

ROOT = Path(__file__).parents[1]
SIDE_PX = sized(1200, 120)


def threads() -> dict[str, object]:
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


Work = Callable[[], Floats]

COLOURS = sized(1_000_000, 20_000)
LARGE = 10**9  # of a picture of so many pixels, what is measured here is a part
WHITE = np.array([96.4, 100.0, 82.5])
# How many times as fast as its twin each loop must be, and the most that it may differ.
LIMITS = {"ΔE00 of XYZ": (2.0, 1e-10), "sparkles": (1.3, 1e-3), "shift": (1.2, 1e-5)}


def compiled_loops() -> dict[str, object]:
    """Time all three; the error is the largest difference from the twin, that of sparkles in pixels."""
    rows: list[Row] = []
    promises = []
    rng = np.random.default_rng(0)
    first = rng.uniform(1.0, 100.0, (COLOURS, 3))
    second = first * rng.uniform(0.8, 1.2, first.shape)
    light = rng.uniform(0.0, 9.0, (sized(304, 64), sized(7360, 200), 3)).astype(np.float32)
    shift = np.array([[1.0, 0.0, 0.4], [0.0, 1.0, 24.3], [0.0, 0.0, 1.0]])
    # As dense as on a car paint, and of more than four megapixels.
    picture = np.tile(planted(0.1, sized(15_000, 600))[0], sized((2, 1), (6, 6)))
    works: dict[str, Work] = {
        "ΔE00 of XYZ": lambda: delta_e_2000_of_xyz(first, second, WHITE, of=LARGE),
        "sparkles": lambda: _places(picture),
        "shift": lambda: np.asarray(warp(light, shift, (light.shape[1], light.shape[0] - 48), of=LARGE).picture),
    }
    with at_most_threads(1):
        for name, compiled in works.items():
            plain = partial(_in_numpy, compiled)
            (found, compiled_s), (expected, plain_s) = (
                answer_and_seconds(work, repeats=3) for work in (compiled, plain)
            )
            apart = float(np.nanmax(np.abs(found - expected)))
            ratio = plain_s / compiled_s if is_quick() else times_faster(compiled, plain, rounds=5)
            faster = f"{ratio:.1f} × as fast as NumPy"
            ours = compiler(LARGE) or "NumPy", compiled_s, apart, faster
            for way, taken, error, note in (ours, ("NumPy", plain_s, 0.0, "")):
                rows.append(row(way, name, taken, error, note=note))
            least, most = LIMITS[name]
            promises.append(Promise(f"{name}: difference from the twin in NumPy", apart, most, "error"))
            promises.append(_beside(name, ratio, least))
        rows.append(_colour_science(first, second, works["ΔE00 of XYZ"]))
    return {"title": "Compiled loops beside their twins in NumPy", "rows": rows, "promises": promises}


def _beside(name: str, ratio: float, least: float) -> Promise:
    what = f"{name}: beside NumPy"
    if compiler(LARGE) is None:
        return Promise(what, None, least, "ratio", "at least", "×", "Numba is not installed")
    return Promise(what, ratio, least, "ratio", "at least", "×")


def _in_numpy(work: Work) -> Floats:
    with without_compiled_loops():
        return work()


def _places(picture: NDArray[np.float32]) -> Floats:
    found = measure_sparkles(picture).moments
    return np.stack([found.row_px, found.column_px], axis=-1)


def _colour_science(first: Floats, second: Floats, ours: Work) -> Row:
    import colour

    def theirs() -> Floats:
        # As shares of the white, so that their white is ours.
        labs = (colour.XYZ_to_Lab(xyz / WHITE[1], colour.XYZ_to_xy(WHITE)) for xyz in (first, second))
        return np.asarray(colour.delta_E(*labs, method="CIE 2000"))

    (found, ours_s), (expected, theirs_s) = (answer_and_seconds(work, repeats=3) for work in (ours, theirs))
    ratio = theirs_s / ours_s if is_quick() else times_faster(ours, theirs, rounds=3)
    error = float(np.abs(found - expected).max())
    note = f"ours is {ratio:.1f} × as fast, and differs by {error:.0e}"
    row = {"series": "colour-science", "parameter": "ΔE00 of XYZ", "seconds": theirs_s, "note": note}
    return {**row, "error": 0.0}


if __name__ == "__main__":
    program("cores", threads, compiled_loops)
