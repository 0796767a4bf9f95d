"""One eye's view of the sparkle plate: culled against brute force, run time against error."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from curves import seconds, write

from stimuli.recipe import read_recipe
from stimuli.sparkle.flakes import scatter_flakes
from stimuli.sparkle.photograph import sparkle_map

RECIPE = Path(__file__).parents[1] / "configs/stimuli/manitoba_gray.yaml"
FLAKES_PER_MM2 = (10, 40, 100)


def run() -> dict[str, object]:
    """Render the shipped plate with other numbers of flakes; the error is a share of the view's largest luminance."""
    recipe, _ = read_recipe(RECIPE)
    plate, lamp, camera = recipe.plate.plate(), recipe.lamp.lamp(), recipe.camera.camera()
    rows = []
    for density in FLAKES_PER_MM2:
        dense = replace(plate, flakes_per_mm2=density)
        flakes = scatter_flakes(dense, recipe.seed)
        brute = sparkle_map(dense, lamp, camera, "left", flakes, cull=False)
        culled = sparkle_map(dense, lamp, camera, "left", flakes)
        view = partial(sparkle_map, dense, lamp, camera, "left", flakes)
        slow, fast = (seconds(partial(view, cull=cull), repeats=3) for cull in (False, True))
        peak = float(brute.luminance_cd_m2.max())
        error = float(np.abs(culled.luminance_cd_m2 - brute.luminance_cd_m2).max()) / peak
        name = f"{len(flakes):,} flakes"
        note = f"{slow / fast:.1f} × as fast; {culled.shaded:,} of {culled.flakes:,} flakes shaded"
        rows.append({"series": "brute force", "parameter": name, "seconds": slow, "error": 0.0})
        rows.append({"series": "culled", "parameter": name, "seconds": fast, "error": error, "note": note})
    return {"title": "Sparkle plate, one view", "rows": rows}


if __name__ == "__main__":
    result = run()
    write("sparkle_culling", str(result["title"]), result["rows"])
