"""Sparkling plates for any colorimetric observer: one scene, whose spectra are summed by that observer's functions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from devices.colour import XYZ_from_xyY
from devices.readings import xyz_from_spectra
from documents import InputError
from stimuli.build import build_set
from stimuli.pictures import read_exr
from stimuli.recipes import read_recipe
from stimuli.recipes.build_context import BuildContext
from stimuli.recipes.sparkle_plate import SparklePlateRecipe
from stimuli.recipes.sparkle_series import SparkleSeriesRecipe
from stimuli.sparkle import Studio, plate_light, scatter_flakes, wavelengths_nm

ROOT = Path(__file__).parents[2]
PLAIN, TEN, AGED = "CIE 1931 2", "CIE 2015 10", "CIE 2006 4 age 65"
PITCH_MM, SHORT_S = 0.2768, 1e-5
Recipe = SparklePlateRecipe | SparkleSeriesRecipe


def _read(name: str, folder: Path, change: dict[str, Any]) -> Recipe:
    data = yaml.safe_load((ROOT / f"configs/stimuli/{name}.yaml").read_text())
    data["plate"]["size_mm"] = [9, 6]
    data["plate"]["flakes"]["per_mm2"] = 50
    file = folder / f"{name}.yaml"
    file.write_text(yaml.safe_dump(data | change, sort_keys=False))
    recipe, _ = read_recipe(file)
    assert isinstance(recipe, Recipe)
    return recipe


def _cabin(folder: Path, **change: Any) -> SparklePlateRecipe:
    recipe = _read("solux_cabin", folder, change)
    assert isinstance(recipe, SparklePlateRecipe)
    return recipe


def _bands(recipe: SparklePlateRecipe, observer: str) -> NDArray[np.float64]:
    lamps = recipe.lamp, *recipe.further_lamps
    plate = recipe.plate.plate()
    light = plate_light(plate, lamps, recipe.camera, "left", scatter_flakes(plate, recipe.seed), observer)
    return light.spectral(PITCH_MM)


@pytest.mark.parametrize("observer", [AGED, pytest.param(TEN, marks=pytest.mark.nightly)])
def test_a_plate_is_the_sum_of_its_spectra_for_the_observer(tmp_path: Path, observer: str) -> None:
    recipe = _cabin(tmp_path)
    scene = recipe.plate, recipe.lamp, recipe.camera, recipe.seed, PITCH_MM, recipe.further_lamps
    seen = Studio(*scene, observer=observer).photographs("stereo", SHORT_S)[0].xyz_cd_m2
    bands = _bands(recipe, observer)
    np.testing.assert_allclose(bands, _bands(recipe, PLAIN), rtol=1e-12)  # the light does not depend on who looks
    truth = xyz_from_spectra(bands.reshape(-1, 81), wavelengths_nm(), observer).reshape(seen.shape)
    np.testing.assert_allclose(seen, truth, rtol=1e-4, atol=1e-5)
    plain = Studio(*scene).photographs("stereo", SHORT_S)[0].xyz_cd_m2
    assert np.abs(plain / seen - 1).max() > 0.01


def _keys(recipe: Recipe, folder: Path) -> dict[str, str]:
    return {
        name: key for task in recipe.tasks(BuildContext(folder, {}, PITCH_MM, None, 2)) for name, key in task.items()
    }


@pytest.mark.parametrize("name", ["solux_cabin", "exposure_series"])
def test_pictures_in_the_cache_are_kept_apart_by_observer(tmp_path: Path, name: str) -> None:
    plain, same, ten, aged = (
        _keys(_read(name, tmp_path, change), tmp_path)
        for change in ({}, {"observer": "1931_2"}, {"observer": TEN}, {"observer": AGED})
    )
    assert plain == same
    assert len({*plain.values(), *ten.values(), *aged.values()}) == 3 * len(set(plain.values()))


def test_a_recipe_of_plates_is_built_for_its_observer(tmp_path: Path) -> None:
    short = {"stimuli": [{"name": "short", "exposure_s": SHORT_S}], "views": ["flat"]}
    recipe = _cabin(tmp_path, observer=TEN, **short)
    built = build_set(tmp_path / "solux_cabin.yaml", PITCH_MM)
    first = built.manifest["stimuli"][0]
    assert first["steps"][0]["observer"] == TEN
    seen = read_exr(built.path(built.names[0]), observer=TEN).left
    scene = recipe.plate, recipe.lamp, recipe.camera, recipe.seed, PITCH_MM, recipe.further_lamps
    alone = Studio(*scene, observer=TEN).photographs("flat", SHORT_S)[0].xyz_cd_m2
    np.testing.assert_allclose(seen, alone, rtol=1e-3, atol=1e-4)
    with pytest.raises(InputError, match="CIE 2015 10; CIE 1931 2 is wanted"):
        read_exr(built.path(built.names[0]))


def test_chromaticities_of_a_recipe_are_its_observers(tmp_path: Path) -> None:
    recipe = _read("manitoba_gray", tmp_path, {})
    assert isinstance(recipe, SparklePlateRecipe)
    scene = recipe.plate, recipe.lamp, recipe.camera, recipe.seed, PITCH_MM, recipe.further_lamps
    plain, ten = (Studio(*scene, observer=one).photographs("flat", 0.1)[0].xyz_cd_m2 for one in (PLAIN, TEN))
    np.testing.assert_array_equal(plain, ten)


def test_a_base_with_a_chromaticity_in_a_spectral_lamp_is_as_bright_as_that_lamp_to_the_observer(
    tmp_path: Path,
) -> None:
    recipe = _cabin(tmp_path, further_lamps=[])
    bare = replace(recipe.plate.plate(), base_chromaticity_xy=(0.4, 0.35), base_spectrum=None, flop_reflectance=0.0)
    flakes = scatter_flakes(bare, 1).chosen(np.zeros(0, np.int64))
    (term,) = plate_light(bare, [recipe.lamp], recipe.camera, "left", flakes, TEN).terms
    emitted = np.array(recipe.lamp.emitted)
    own = xyz_from_spectra(emitted, wavelengths_nm(), TEN)[0]
    brightness = own[1] / xyz_from_spectra(emitted, wavelengths_nm())[0, 1]
    np.testing.assert_allclose(term.colour.XYZ, XYZ_from_xyY([0.4, 0.35, brightness]), rtol=1e-12)
    plain = replace(bare, base_chromaticity_xy=None)
    (as_lit,) = plate_light(plain, [recipe.lamp], recipe.camera, "left", flakes, TEN).terms
    seen = np.array(as_lit.colour.XYZ)
    np.testing.assert_allclose(seen[:2] / seen.sum(), own[:2] / own.sum(), rtol=1e-12)
