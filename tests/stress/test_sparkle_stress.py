"""The sparkle plate at full size and at its edges: culled as brute force, and pictures that are light."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path
from time import process_time

import numpy as np
import pytest

from stimuli.recipes import read_recipe
from stimuli.recipes.sparkle_plate import SparklePlateRecipe
from stimuli.sparkle import plate_light, scatter_flakes
from stimuli.sparkle.cull import that_matter, tiles_of
from stimuli.sparkle.lamplight import illuminance_lx
from stimuli.sparkle.optics import shade
from stimuli.sparkle.scene import Noise
from stimuli.sparkle.studio import photograph, sparkle_map

pytestmark = pytest.mark.stress
CONFIGS = Path(__file__).parents[2] / "configs" / "stimuli"


def recipe_of(name: str) -> SparklePlateRecipe:
    recipe, _ = read_recipe(CONFIGS / f"{name}.yaml")
    assert isinstance(recipe, SparklePlateRecipe)
    return recipe


def test_the_default_plate_culled_and_by_brute_force() -> None:
    """1.5 million flakes, 1024 × 683 pixels, two eyes: within 0.1 % of the maximum, at least 10 × as fast."""
    recipe = recipe_of("manitoba_gray")
    plate, lamp = recipe.plate.plate(), recipe.lamp
    camera = recipe.camera.model_copy(update={"resolution_px_per_mm": 1024 / 150})
    assert camera.grid_px(plate) == (1024, 683)
    flakes = scatter_flakes(plate, recipe.seed)
    assert len(flakes) == pytest.approx(1.5e6, rel=0.01)
    ratios = []
    for eye in ("left", "right"):
        times = []
        for cull in (True, False):
            start = process_time()
            found = sparkle_map(plate, lamp, camera, eye, flakes, cull=cull)
            times.append(process_time() - start)
            if cull:
                fast = found
        assert fast.shaded < 0.1 * len(flakes)
        assert np.abs(fast.luminance_cd_m2 - found.luminance_cd_m2).max() <= 1e-3 * float(found.luminance_cd_m2.max())
        ratios.append(times[1] / times[0])
    assert max(ratios) > 10


def test_no_flake_that_matters_is_dropped_in_ten_thousand_scenes() -> None:
    recipe = recipe_of("manitoba_gray")
    random = np.random.default_rng(7)
    kept_of, flakes_of, dark_of = 0, 0, 0
    for _ in range(10_000):
        width = float(np.exp(random.uniform(np.log(0.5), np.log(600))))
        plate = replace(
            recipe.plate.plate(),
            width_mm=width,
            height_mm=width * float(random.uniform(0.2, 2)),
            lobe_sd_deg=float(np.exp(random.uniform(np.log(0.02), np.log(15)))),
            coat_refractive_index=float(random.uniform(1, 4)),
            tilt_sd_deg=float(random.uniform(1, 40)),
            diffraction_nm=555.0 if random.random() < 0.5 else None,
        )
        plate = replace(plate, flakes_per_mm2=500 / (plate.width_mm * plate.height_mm))
        lamp = recipe.lamp.model_copy(
            update={
                "zenith_deg": float(random.uniform(0, 89.9)),
                "azimuth_deg": float(random.uniform(0, 360)),
                "angular_radius_deg": float(random.uniform(0, 20)),
                "distance_mm": float(np.exp(random.uniform(np.log(10), np.log(5000))))
                if random.random() < 0.6
                else None,
                "beam_angle_deg": float(random.uniform(2, 120)) if random.random() < 0.5 else None,
            }
        )
        eye = np.array([random.uniform(-500, 500), random.uniform(-500, 500), np.exp(random.uniform(2, 8))])
        camera = recipe.camera.model_copy(update={"resolution_px_per_mm": 300 / width})
        flakes = scatter_flakes(plate, int(random.integers(1 << 30)))
        least_share = float(10.0 ** -random.uniform(1, 9))
        tiles = tiles_of(plate, camera, int(random.choice([8, 50, 256])))
        kept = that_matter(flakes, plate, lamp, eye, tiles, least_share)
        dropped = flakes.chosen(np.setdiff1d(np.arange(len(flakes)), kept))
        shares = shade(dropped, plate, lamp, eye).lobe_share
        # In tiles that a near lamp hardly lights, flakes are dropped for that: none gets that share of its light.
        x, y = dropped.x_mm.astype(np.float64), dropped.y_mm.astype(np.float64)
        light = np.broadcast_to(illuminance_lx(lamp, x, y), shares.shape) / lamp.illuminance_lx
        assert shares.size == 0 or np.minimum(shares, light).max() < least_share, (plate, lamp, eye)
        dark_of += int((shares >= least_share).sum())
        kept_of, flakes_of = kept_of + len(kept), flakes_of + len(flakes)
    assert 0.05 < kept_of / flakes_of < 0.9
    assert 0 < dark_of < kept_of


def test_pictures_of_extreme_plates_are_light() -> None:
    recipe = recipe_of("solux_cabin")
    sizes = ((0.05, 0.05), (150.0, 0.1), (0.1, 150.0), (400.0, 300.0))
    for (width, height), zenith, distance in product(sizes, (0.0, 89.9), (10.0, 1e6, None)):
        plate = replace(
            recipe.plate.plate(), width_mm=width, height_mm=height, flakes_per_mm2=min(200.0, 3000 / (width * height))
        )
        lamp = recipe.lamp.model_copy(update={"zenith_deg": zenith, "distance_mm": distance, "beam_angle_deg": None})
        camera = recipe.camera.model_copy(
            update={
                "resolution_px_per_mm": 2.0,
                "pupil_mm": 3.0,
                "noise": Noise(full_well_electrons=1000.0, read_noise_electrons=20.0),
            }
        )
        light = plate_light(plate, [lamp], camera, "left", scatter_flakes(plate, 1))
        for exposure_s in (1e-6, 1.0, 1e5):
            picture = photograph(light, camera, exposure_s, 0.3)
            assert np.isfinite(picture.xyz_cd_m2).all()
            assert picture.xyz_cd_m2.min() >= 0
        assert np.isfinite(light.spectral(0.3)).all()
