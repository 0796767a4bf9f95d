"""Sparkles: both eyes' views of the plate culled, and sparkles planted in a picture found again: run time and error.

The plate is that of configs/stimuli/manitoba_gray.yaml (1.5 million flakes) on 1024 × 683 pixels. Brute force shades
and draws every flake. A flake is culled if it sends an eye less than the threshold's share of its lobe's peak.

1500 sparkles are planted in a picture of 1460 × 2190 pixels with noise. Beside ours stands what scikit-image and SciPy
offer for it: a median filter for the background (on a picture reduced eightfold, since one at full size takes minutes),
`peak_local_max`, and centroids over 5 × 5 pixels.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from curves import program, row, seconds, sized, times_faster
from numpy.typing import NDArray
from promises import Promise, times_as_fast, worst

from documents.arrays import Floats
from extensions.sparkle import SparklePlateRecipe
from extensions.sparkle.cull import LEAST_LOBE_SHARE as USUAL
from extensions.sparkle.flakes import Flakes, scatter_flakes
from extensions.sparkle.scene import Camera, Lamp, Plate
from extensions.sparkle.studio import SparkleMap, sparkle_map
from stimuli.recipes.recipe import read_recipe
from stimuli.sparkles.find import SparkleThreshold
from stimuli.sparkles.measure import measure_sparkles

Picture = NDArray[np.float32]
RECIPE = Path(__file__).parents[1] / "configs/stimuli/manitoba_gray.yaml"
FLAKES_PER_MM2 = sized((10, 100), (1,))
THRESHOLDS = sized((1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8), (1e-3, 1e-6))
WIDTH_PX = sized(1024, 128)
SHAPE = sized((1460, 2190), (292, 438))
SPARKLES = sized(1500, 60)
SD_PX, BASE, PEAK = 1.0, 10.0, 60.0

PLAIN = "scikit-image, SciPy"


def culling() -> dict[str, Any]:
    """Render the shipped plate; the error is that of the worst pixel, as a share of the largest luminance."""
    recipe, _ = read_recipe(RECIPE)
    assert isinstance(recipe, SparklePlateRecipe)
    plate, lamp = recipe.plate.plate(), recipe.lamp
    camera = recipe.camera.model_copy(update={"resolution_px_per_mm": WIDTH_PX / plate.width_mm})
    rows: list[dict[str, Any]] = []
    for density in FLAKES_PER_MM2:
        dense = replace(plate, flakes_per_mm2=float(density))
        rows += _plate_rows(dense, lamp, camera, scatter_flakes(dense, recipe.seed))
    wide = camera.model_copy(update={"resolution_px_per_mm": recipe.camera.resolution_px_per_mm / sized(1, 4)})
    rows += _spot_rows(replace(plate, width_mm=300.0, height_mm=200.0), lamp, wide, recipe.seed)
    return {"title": "Sparkle plate, two eyes", "rows": rows, "promises": _culling_promises(rows)}


def _culling_promises(rows: list[dict[str, Any]]) -> list[Promise]:
    usual = [row for row in rows if "ratio" in row]
    error, tiles = worst(usual), worst(rows, "tiles", series="spot, culled")
    return [
        Promise("worst pixel of the culled plate, share of the largest luminance", error, 1e-3, "error"),
        Promise("beside brute force, 1.5 million flakes", float(usual[-1]["ratio"]), 10.0, "ratio", "at least", "×"),
        Promise("tiles visited of 216 for a spot of 10°", tiles, None, "count"),
    ]


def _spot_rows(plate: Plate, lamp: Lamp, camera: Camera, seed: int) -> list[dict[str, Any]]:
    """A spot of 10° at 120 mm on a plate of 300 × 200 mm: tiles beyond its beam are dark, and left alone."""
    spot = lamp.model_copy(update={"distance_mm": 120.0, "beam_angle_deg": 10.0})
    plate = replace(plate, flakes_per_mm2=sized(20.0, 1.0))
    flakes = scatter_flakes(plate, seed)
    brute = sparkle_map(plate, spot, camera, "left", flakes, cull=False)
    rows: list[dict[str, Any]] = []
    for series, found, draw in (
        ("spot, brute force", brute, partial(sparkle_map, plate, spot, camera, "left", flakes, cull=False)),
        (
            "spot, culled",
            sparkle_map(plate, spot, camera, "left", flakes),
            partial(sparkle_map, plate, spot, camera, "left", flakes),
        ),
    ):
        note = (
            f"{found.tiles_visited} of {found.tiles} tiles visited, {found.shaded:,} of {found.flakes:,} flakes shaded"
        )
        error = _off(found, brute.luminance_cd_m2) / float(brute.luminance_cd_m2.max())
        taken_s = seconds(draw, repeats=2)
        rows.append(row(series, "one eye", taken_s, error, note=note, tiles=found.tiles_visited))
    return rows


def _plate_rows(plate: Plate, lamp: Lamp, camera: Camera, flakes: Flakes) -> list[dict[str, Any]]:
    def both(*, cull: bool = True, least_share: float = USUAL) -> list[SparkleMap]:
        return [
            sparkle_map(plate, lamp, camera, eye, flakes, cull=cull, least_share=least_share)
            for eye in ("left", "right")
        ]

    brute = [view.luminance_cd_m2 for view in both(cull=False)]
    peak = max(float(view.max()) for view in brute)
    slow = seconds(partial(both, cull=False), repeats=3)
    number = f"{len(flakes):,} flakes"
    rows = [row(f"brute force, {number}", "all", slow, 0.0)]
    for threshold in THRESHOLDS:
        found = both(least_share=threshold)
        fast = seconds(partial(both, least_share=threshold), repeats=3)
        note, usual = f"{sum(view.shaded for view in found):,} shaded", threshold == USUAL
        more = {}
        if usual:
            ratio = times_faster(partial(both, least_share=threshold), partial(both, cull=False), rounds=3)
            note = f"{ratio:.1f} × as fast, timed in turn; {note}"
            more = {"ratio": ratio}
        off = max(_off(view, of_all) for view, of_all in zip(found, brute, strict=True))
        parameter = f"{threshold:g} (usual)" if usual else f"{threshold:g}"
        rows.append(row(f"culled, {number}", parameter, fast, off / peak, note=note, **more))
    return rows


def _off(view: SparkleMap, brute: NDArray[np.float32]) -> float:
    return float(np.abs(view.luminance_cd_m2 - brute).max())


def planted(noise: float, sparkles: int = SPARKLES) -> tuple[Picture, Floats]:
    """Return the picture, its light falling off to the right, and the sparkles' places (n, 2)."""
    random = np.random.default_rng(2)
    places = random.uniform(10, np.array(SHAPE) - 10, (sparkles, 2))
    picture = np.full(SHAPE, BASE)
    offsets = np.arange(-6, 7)
    for y, x in places:
        i, j = round(y), round(x)
        # Nine points to a pixel: its mean light, nearly.
        fine = (np.arange(3) - 1) / 3
        down = np.exp(-0.5 * (((i + offsets)[:, None] + fine - y) / SD_PX) ** 2).mean(axis=1)
        across = np.exp(-0.5 * (((j + offsets)[:, None] + fine - x) / SD_PX) ** 2).mean(axis=1)
        picture[i - 6 : i + 7, j - 6 : j + 7] += PEAK * np.outer(down, across)
    picture *= np.linspace(1.3, 0.7, SHAPE[1])
    return (picture + random.normal(0, noise, SHAPE)).astype(np.float32), places


def ours(picture: Picture) -> Floats:
    """Return the places of sparkles twice as bright as their background."""
    found = measure_sparkles(picture, SparkleThreshold(times=2.0)).moments
    return np.stack([found.row_px, found.column_px], axis=-1)


def plain(picture: Picture) -> Floats:
    """Return the same by well-known functions."""
    from scipy.ndimage import median_filter, zoom
    from skimage.feature import peak_local_max

    coarse = median_filter(picture[::8, ::8], 9, mode="nearest")
    background = zoom(coarse, np.array(picture.shape) / coarse.shape, order=1)
    above = np.where(picture > 2 * background, picture, 0)
    peaks = peak_local_max(above, min_distance=2, threshold_abs=1e-6, exclude_border=False)
    light = picture - background
    offsets = np.arange(-2, 3)
    inside = np.clip(peaks, 2, np.array(picture.shape) - 3)
    around = light[inside[:, 0, None, None] + offsets[:, None], inside[:, 1, None, None] + offsets]
    total = around.sum(axis=(1, 2))
    return inside + np.stack([(around.sum(axis=axis) * offsets).sum(axis=1) / total for axis in (2, 1)], axis=-1)


def finding() -> dict[str, object]:
    """Find the sparkles of pictures with less and more noise."""
    from scipy.spatial import cKDTree

    rows: list[dict[str, Any]] = []
    for noise in sized((0.0, 0.1, 0.5), (0.1,)):
        picture, places = planted(noise)
        for name, way in (("ours", ours), (PLAIN, plain)):
            found = way(picture)
            distance, _ = cKDTree(found).query(places)
            # Nearer than 3 px, two may be one peak.
            apart = cKDTree(places).query(places, k=2)[0][:, 1] > 3
            error = float(np.sqrt(np.mean(distance[apart] ** 2)))
            note = f"{len(found)} found of {len(places)}, {int(apart.sum())} of them more than 3 px apart, "
            note += f"those within {distance[apart].max():.2f} px"
            parameter = f"noise {100 * noise / BASE:.0f} % of the background"
            time_s = seconds(partial(way, picture), repeats=3, at_least_s=0)
            rows.append(row(name, parameter, time_s, error, note=note))
    promises = [
        Promise("places of sparkles", worst(rows, series="ours"), 0.02, "error", unit="px"),
        Promise("beside scikit-image's peaks", times_as_fast(rows, "ours", PLAIN), None, "ratio", "at least", "×"),
    ]
    return {"title": "Places of sparkles: time against error in pixels", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("sparkle", culling, finding)
