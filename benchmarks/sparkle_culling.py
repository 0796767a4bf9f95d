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
from curves import program, seconds, sized, times_faster
from numpy.typing import NDArray
from promises import Promise, worst

from extensions.sparkle import SparklePlateRecipe
from extensions.sparkle.cull import LEAST_LOBE_SHARE as USUAL
from extensions.sparkle.flakes import Flakes, scatter_flakes
from extensions.sparkle.scene import Camera, Lamp, Plate
from extensions.sparkle.studio import SparkleMap, sparkle_map
from stimuli.recipes.recipe import read_recipe

RECIPE = Path(__file__).parents[1] / "configs/stimuli/manitoba_gray.yaml"
FLAKES_PER_MM2 = sized((10, 100), (1,))
THRESHOLDS = sized((1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8), (1e-3, 1e-6))
WIDTH_PX = sized(1024, 128)


def run() -> dict[str, Any]:
    """Render the shipped plate; the error is that of the worst pixel, as a share of the largest luminance."""
    recipe, _ = read_recipe(RECIPE)
    assert isinstance(recipe, SparklePlateRecipe)
    plate, lamp = recipe.plate.plate(), recipe.lamp
    camera = recipe.camera.model_copy(update={"resolution_px_per_mm": WIDTH_PX / plate.width_mm})
    rows: list[dict[str, Any]] = []
    for density in FLAKES_PER_MM2:
        dense = replace(plate, flakes_per_mm2=float(density))
        rows += _series(dense, lamp, camera, scatter_flakes(dense, recipe.seed))
    wide = camera.model_copy(update={"resolution_px_per_mm": recipe.camera.resolution_px_per_mm / sized(1, 4)})
    rows += _spot(replace(plate, width_mm=300.0, height_mm=200.0), lamp, wide, recipe.seed)
    return {"title": "Sparkle plate, two eyes", "rows": rows, "promises": _promises(rows)}


def _promises(rows: list[dict[str, Any]]) -> list[Promise]:
    usual = [row for row in rows if "ratio" in row]
    error, tiles = worst(usual), worst(rows, "tiles", series="spot, culled")
    return [
        Promise("worst pixel of the culled plate, share of the largest luminance", error, 1e-3, "error"),
        Promise("beside brute force, 1.5 million flakes", float(usual[-1]["ratio"]), 10.0, "ratio", "at least", "×"),
        Promise("tiles visited of 216 for a spot of 10°", tiles, None, "count"),
    ]


def _spot(plate: Plate, lamp: Lamp, camera: Camera, seed: int) -> list[dict[str, Any]]:
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
        error = _worst(found, brute.luminance_cd_m2) / float(brute.luminance_cd_m2.max())
        row: dict[str, Any] = {
            "series": series,
            "parameter": "one eye",
            "seconds": seconds(draw, repeats=2),
            "error": error,
        }
        rows.append({**row, "note": note, "tiles": found.tiles_visited})
    return rows


def _series(plate: Plate, lamp: Lamp, camera: Camera, flakes: Flakes) -> list[dict[str, Any]]:
    def both(*, cull: bool = True, least_share: float = USUAL) -> list[SparkleMap]:
        return [
            sparkle_map(plate, lamp, camera, eye, flakes, cull=cull, least_share=least_share)
            for eye in ("left", "right")
        ]

    brute = [view.luminance_cd_m2 for view in both(cull=False)]
    peak = max(float(view.max()) for view in brute)
    slow = seconds(partial(both, cull=False), repeats=3)
    number = f"{len(flakes):,} flakes"
    rows: list[dict[str, Any]] = [
        {"series": f"brute force, {number}", "parameter": "all", "seconds": slow, "error": 0.0}
    ]
    for threshold in THRESHOLDS:
        found = both(least_share=threshold)
        fast = seconds(partial(both, least_share=threshold), repeats=3)
        note = f"{sum(view.shaded for view in found):,} shaded"
        if threshold == USUAL:
            ratio = times_faster(partial(both, least_share=threshold), partial(both, cull=False), rounds=3)
            note = f"{ratio:.1f} × as fast, timed in turn; {note}"
        off = max(_worst(view, of_all) for view, of_all in zip(found, brute, strict=True))
        row: dict[str, Any] = {"series": f"culled, {number}", "parameter": f"{threshold:g}", "seconds": fast}
        row |= {"error": off / peak, "note": note}
        rows.append(row | ({"parameter": f"{threshold:g} (usual)", "ratio": ratio} if threshold == USUAL else {}))
    return rows


def _worst(view: SparkleMap, brute: NDArray[np.float32]) -> float:
    return float(np.abs(view.luminance_cd_m2 - brute).max())


if __name__ == "__main__":
    program("sparkle_culling", run)
