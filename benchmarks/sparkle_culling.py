"""Both eyes' views of the sparkle plate: culled against brute force, run time against error over the threshold.

The plate is that of configs/stimuli/manitoba_gray.yaml (1.5 million flakes) on 1024 × 683 pixels. Brute force shades
and draws every flake. A flake is culled if it sends an eye less than the threshold's share of its lobe's peak.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from curves import Row, seconds, times_faster, write
from numpy.typing import NDArray

from stimuli.recipes.recipe import read_recipe
from stimuli.recipes.sparkle_plate import SparklePlateRecipe
from stimuli.sparkle.cull import LEAST_LOBE_SHARE as USUAL
from stimuli.sparkle.flakes import Flakes, scatter_flakes
from stimuli.sparkle.scene import Camera, Lamp, Plate
from stimuli.sparkle.studio import SparkleMap, sparkle_map

RECIPE = Path(__file__).parents[1] / "configs/stimuli/manitoba_gray.yaml"
FLAKES_PER_MM2 = (10, 100)
THRESHOLDS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
WIDTH_PX = 1024


def run() -> dict[str, Any]:
    """Render the shipped plate; the error is that of the worst pixel, as a share of the largest luminance."""
    recipe, _ = read_recipe(RECIPE)
    assert isinstance(recipe, SparklePlateRecipe)
    plate, lamp = recipe.plate.plate(), recipe.lamp.lamp()
    camera = replace(recipe.camera.camera(), resolution_px_per_mm=WIDTH_PX / plate.width_mm)
    rows: list[Row] = []
    for density in FLAKES_PER_MM2:
        dense = replace(plate, flakes_per_mm2=float(density))
        rows += _series(dense, lamp, camera, scatter_flakes(dense, recipe.seed))
    rows += _spot(replace(plate, width_mm=300.0, height_mm=200.0), lamp, recipe.camera.camera(), recipe.seed)
    return {"title": "Sparkle plate, two eyes", "rows": rows}


def _spot(plate: Plate, lamp: Lamp, camera: Camera, seed: int) -> list[Row]:
    """A spot of 10° at 120 mm on a plate of 300 × 200 mm: tiles beyond its beam are dark, and left alone."""
    spot = replace(lamp, distance_mm=120.0, beam_angle_deg=10.0)
    plate = replace(plate, flakes_per_mm2=20.0)
    flakes = scatter_flakes(plate, seed)
    brute = sparkle_map(plate, spot, camera, "left", flakes, cull=False)
    rows: list[Row] = []
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
        error = _worst(found, brute.luminance_cd_m2) / float(brute.luminance_cd_m2.max())
        row: Row = {"series": series, "parameter": "one eye", "seconds": seconds(draw, repeats=2), "error": error}
        rows.append({**row, "note": note})
    return rows


def _series(plate: Plate, lamp: Lamp, camera: Camera, flakes: Flakes) -> list[Row]:
    def both(*, cull: bool = True, least_share: float = USUAL) -> list[SparkleMap]:
        return [
            sparkle_map(plate, lamp, camera, eye, flakes, cull=cull, least_share=least_share)
            for eye in ("left", "right")
        ]

    brute = [view.luminance_cd_m2 for view in both(cull=False)]
    peak = max(float(view.max()) for view in brute)
    slow = seconds(partial(both, cull=False), repeats=3)
    number = f"{len(flakes):,} flakes"
    rows: list[Row] = [{"series": f"brute force, {number}", "parameter": "all", "seconds": slow, "error": 0.0}]
    for threshold in THRESHOLDS:
        found = both(least_share=threshold)
        fast = seconds(partial(both, least_share=threshold), repeats=3)
        note = f"{sum(view.shaded for view in found):,} shaded"
        if threshold == USUAL:
            ratio = times_faster(partial(both, least_share=threshold), partial(both, cull=False), rounds=3)
            note = f"{ratio:.1f} × as fast, timed in turn; {note}"
        worst = max(_worst(view, of_all) for view, of_all in zip(found, brute, strict=True))
        rows.append(
            {
                "series": f"culled, {number}",
                "parameter": f"{threshold:g}" + (" (usual)" if threshold == USUAL else ""),
                "seconds": fast,
                "error": worst / peak,
                "note": note,
            }
        )
    return rows


def _worst(view: SparkleMap, brute: NDArray[np.float32]) -> float:
    return float(np.abs(view.luminance_cd_m2 - brute).max())


if __name__ == "__main__":
    result = run()
    write("sparkle_culling", result["title"], result["rows"])
