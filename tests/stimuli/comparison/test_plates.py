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
    sparkle = sparkle_map(plate, RECIPE.lamp, RECIPE.camera, "center", flakes, cull=cull).luminance_cd_m2
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


@pytest.mark.nightly
def test_brute_force_and_culled(tmp_path: Path, cyclopean: Cyclopean) -> None:
    files = [
        written(tmp_path / f"{name}.exr", rendered(100.0, 9, cull=cull))
        for name, cull in (("brute", False), ("fast", True))
    ]
    found = compared(cyclopean, *files, "--regions", PLATE, "--rig", RIG)
    assert found["decision"] == "validated"
    (area,) = found["eyes"]["both"]["sparkle"]
    assert area["in_both"] == area["photograph"]["count"]["value"] > 100
    sums = found["eyes"]["both"]["per_pixel"]
    assert sums["mean"] < 0.01
    assert sums["largest"] < 0.5  # half floats round X, Y and Z apart, by 1/2048 each


@pytest.mark.nightly
def test_another_plate_of_the_same_paint(tmp_path: Path, cyclopean: Cyclopean) -> None:
    """Other flakes of one density differ by chance, and single pixels by where the flakes lie."""
    files = [written(tmp_path / f"{seed}.exr", rendered(100.0, seed, cull=True)) for seed in (9, 10)]
    found = compared(cyclopean, *files, "--regions", PLATE, "--register", "none", "--rig", RIG, expect=None)
    assert said(found, "fails") == []
    assert any("flakes lie elsewhere" in line for line in said(found, "noted"))
    assert found["eyes"]["both"]["registration"]["residual_px"] is None
    assert found["eyes"]["both"]["as_seen"]["mean"] > 1.4  # and yet it is told


@pytest.mark.nightly
def test_single_pixels_count_where_flakes_do_not(tmp_path: Path, cyclopean: Cyclopean) -> None:
    """A plate of other flakes beside a table: the table's pixels are judged, and the plate's are not."""
    pictures = []
    for seed, stain in ((9, 1.0), (10, 1.3)):
        picture = rendered(100.0, seed, cull=True)
        picture[:, :60] = [4.4, 4.5, 3.7]
        picture[:100, :60] *= np.float32(stain)
        picture[100:120, :60] /= np.float32(stain)
        pictures.append(written(tmp_path / f"{seed}.exr", picture))
    height, width, _ = picture.shape
    regions = tmp_path / "r.yaml"
    plate = f"{{kind: plate, corners: [[60, 0], [{width}, 0], [{width}, {height}], [60, {height}]]}}"
    table = f"{{kind: rectangle, name: table, box: [0, 0, 60, {height}]}}"
    regions.write_text(f"schema_version: 1\nregions:\n  - {plate}\n  - {table}\n", encoding="utf-8")
    words = (*pictures, "--regions", regions, "--register", "none", "--rig", RIG)
    found = compared(cyclopean, *words, expect=1)
    one = found["eyes"]["both"]
    assert one["per_pixel"]["pixels"] == 60 * height
    assert any("single pixels of 'plate' are left out" in line for line in one["said"])
    assert any(line.startswith("pixels differ by") for line in said(found, "fails"))
