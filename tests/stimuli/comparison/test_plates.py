"""A sparkling plate rendered twice passes; one of other flakes fails on sparkle although its mean colour is right."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stimuli.recipes import read_recipe
from stimuli.recipes.sparkle_plate import SparklePlateRecipe
from stimuli.sparkle import scatter_flakes
from stimuli.sparkle.studio import sparkle_map
from tests.stimuli.comparison.scenes import PLATE, RIG, ROOT, Cyclopean, coloured, compared, said, written

RECIPE, _ = read_recipe(ROOT / "configs" / "stimuli" / "manitoba_gray.yaml")
assert isinstance(RECIPE, SparklePlateRecipe)
PAINT = replace(RECIPE.plate.plate(), width_mm=30.0, height_mm=20.0)


def rendered(per_mm2: float, seed: int, *, cull: bool, mean_cd_m2: float = 4.5) -> NDArray[np.float32]:
    """Render a plate whose base is such that its mean luminance is given."""
    plate = replace(PAINT, flakes_per_mm2=per_mm2)
    assert isinstance(RECIPE, SparklePlateRecipe)
    flakes = scatter_flakes(plate, seed)
    sparkle = sparkle_map(
        plate, RECIPE.lamp.lamp(), RECIPE.camera.camera(), "center", flakes, cull=cull
    ).luminance_cd_m2
    base = mean_cd_m2 - float(sparkle.mean())
    assert base > 0
    return coloured(sparkle + base)


@pytest.mark.nightly
def test_another_flake_density(tmp_path: Path, cyclopean: Cyclopean) -> None:
    files = [written(tmp_path / f"{density:g}.exr", rendered(density, 9, cull=True)) for density in (100.0, 150.0)]
    found = compared(cyclopean, *files, "--regions", PLATE, "--rig", RIG, "--register", "none", expect=1)
    assert found["decision"] == "not validated"
    one = found["eyes"]["both"]
    assert one["regions"]["mean_delta_e"] < 0.1
    assert any(line.startswith("one region differs by ΔE00 0.0") for line in said(found, "passes"))
    density = one["sparkle"][0]["pairs"][0]
    assert one["sparkle"][0]["in_both"] is None
    assert 0.3 < density["relative"] < 0.7
    assert any(line.startswith("sparkle density on 'plate'") for line in said(found, "fails"))
    assert all(line.startswith("sparkle ") for line in said(found, "fails"))
