"""Recipes of plates: what they may say, and how they are told what they may not."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from documents import InputError
from extensions.sparkle import SparklePlateRecipe
from stimuli.build import StimulusSet, build_set
from stimuli.recipes import Recipe, read_recipe

STIMULI = Path(__file__).parents[3] / "configs" / "stimuli"
GRAY = STIMULI / "manitoba_gray.yaml"
PLATE: dict[str, Any] = yaml.safe_load(GRAY.read_text())
PLATE["plate"]["size_mm"] = [12, 8]
PLATE["plate"]["flakes"]["per_mm2"] = 40
PLATE["stimuli"] = [{"name": "short", "exposure_s": "1/15"}, {"name": "long", "exposure_s": 1, "luminance_scale": 1.78}]


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))


def built(tmp_path: Path, **changes: Any) -> StimulusSet:
    path = tmp_path / "recipe.yaml"
    path.write_text(yaml.safe_dump({**PLATE, **changes}, sort_keys=False))
    return build_set(path, 0.2768)


def changed(tmp_path: Path, name: str, *path: str | int, value: object) -> Path:
    """Write a shipped recipe with one value changed."""
    data: Any = yaml.safe_load((STIMULI / f"{name}.yaml").read_text())
    here = data
    for part in path[:-1]:
        here = here[part]
    here[path[-1]] = value
    file = tmp_path / "recipe.yaml"
    file.write_text(yaml.safe_dump(data, sort_keys=False))
    return file


def test_the_recipe_of_table_4_3() -> None:
    recipe, _ = read_recipe(GRAY)
    assert isinstance(recipe, SparklePlateRecipe)
    table = [(s.name, round(s.exposure_s, 6), s.luminance_scale) for s in recipe.stimuli]
    assert table == [
        ("1.1", round(1 / 15, 6), 1.0),
        ("1.2", round(1 / 15, 6), 0.51),
        ("2.1", 0.125, 1.0),
        ("3.1", 1.0, 1.0),
        ("3.2", 1.0, 1.78),
    ]
    assert recipe.views == ("stereo", "flat")


WRONG: dict[str, list[tuple[tuple[str | int, ...], object, str]]] = {
    "manitoba_gray": [
        (("stimuli", 0, "name"), 1.1, "put quotes around it, '1.1'"),
        (("stimuli", 0, "name"), "../up", "1 to 60 letters"),
        (("stimuli", 1, "name"), "1.1", "stands twice"),
        (("stimuli", 0, "exposure_s"), "1/0", "expected seconds"),
        (("stimuli", 0, "exposure_s"), "1e999999999/3", "expected seconds"),
        (("stimuli", 0, "luminance"), 1, "did you mean 'luminance_scale'"),
        (("plate", "flakes", "diameter_range_um"), [20, 30], "median diameter must lie within"),
        (("plate", "flakes", "per_mm2"), 1e6, "50 million flakes"),
        (("plate", "base", "chromaticity_xy"), [0.7, 0.7], "x \\+ y ≤ 1"),
        (("camera", "resolution_px_per_mm"), 1000, "100 million camera pixels"),
        (("camera", "raw_from_XYZ"), [[1, 0, 0], [1, 0, 0], [0, 0, 1]], "invertible"),
        (("lamp", "zenith_deg"), 90, "from 0 to below 90"),
        (("kind",), "sparkle-plate", "did you mean 'sparkle_plate'"),
    ],
    "solux_cabin": [
        (("lamp", "chromaticity_xy"), [0.3, 0.3], "a temperature_K or a spectrum"),
        (("lamp", "distance_mm"), None, "a beam needs the lamp's distance_mm"),
        (("plate", "flakes", "chromaticity_xy"), [0.3, 0.3], "or a spectrum, not both"),
        (("plate", "base", "spectrum", "values"), [1, 2], "9 wavelengths and 2 values"),
        (("plate", "base", "spectrum", "nm"), [400, 450, 480, 510, 500, 580, 620, 680, 760], "wavelengths must rise"),
        (("plate", "base", "spectrum", "values"), [0, 0, 0, 0, 2, 0, 0, 0, 0], "no reflectance is above 1"),
    ],
    "exposure_series": [
        (("plates", 1, "name"), "gm1", "the name 'gm1' stands twice"),
        (("plates", 1, "name"), "GM 1", "1 to 60 letters"),
        (("plates", 1, "flakes", "diameter_median_um"), 60, "'GM2' and 'plate' do not fit"),
        (("plates", 1, "flakes", "per_mm2"), 1e6, "50 million flakes"),
        (("series", 1, "name"), "base", "the name 'base' stands twice"),
        (("series", 2, "grayscale_white_xy"), [0.3, 0.3], "did you mean 'greyscale_white_xy'"),
        (("exposures_s",), [1.3, 1.3000001], "the exposure 1.3 s stands twice"),
    ],
}


@pytest.mark.parametrize(
    ("name", "path", "value", "message"), [(name, *row) for name, rows in WRONG.items() for row in rows]
)
def test_what_cannot_be_is_refused_with_its_place(
    tmp_path: Path, name: str, path: tuple[str | int, ...], value: object, message: str
) -> None:
    with pytest.raises(InputError, match=rf"recipe\.yaml:\d+:\d+: .*{message}") as refused:
        read_recipe(changed(tmp_path, name, *path, value=value))
    assert len(refused.value.findings) == 1


def test_editors_are_told_that_an_exposure_may_be_a_fraction() -> None:
    exposure = Recipe.model_json_schema()["$defs"]["ShotSpec"]["properties"]["exposure_s"]
    assert [option["type"] for option in exposure["anyOf"]] == ["number", "string"]


def test_editors_know_the_kind() -> None:
    schema = Recipe.model_json_schema()
    assert schema["discriminator"]["mapping"]["sparkle_series"] == "#/$defs/SparkleSeriesRecipe"
    assert "target_mean_luminance_cd_m2" in schema["$defs"]["SparkleSeriesRecipe"]["required"]


# What is built of them.


def test_each_exposure_makes_a_stereo_and_a_flat_stimulus_in_order(tmp_path: Path) -> None:
    made = built(tmp_path)
    assert made.names == ("short-stereo", "short-flat", "long-stereo", "long-flat")
    assert [made.load(name).is_flat for name in made.names] == [False, True, False, True]
    assert made.factors("short-flat") == {
        "image": "short",
        "view": "flat",
        "exposure_s": pytest.approx(1 / 15),
        "luminance_scale": 1.0,
    }
    image = made.load("long-stereo")
    assert (image.width_px, image.height_px) == (43, 29)
    assert not np.array_equal(image.left, image.right)
    assert np.array_equal(image.left, made.load("long-stereo").left)


@pytest.mark.nightly
def test_a_set_that_is_found_loads_no_renderer(tmp_path: Path) -> None:
    built(tmp_path)
    code = (
        "import sys; from pathlib import Path; from stimuli.build import build_set\n"
        f"assert build_set(Path({str(tmp_path / 'recipe.yaml')!r}), 0.2768).rendered == 0\n"
        "print(*sys.modules)"
    )
    ran = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    loaded = set(ran.stdout.split())
    assert "extensions.sparkle.plate_recipe" in loaded
    assert not loaded & {"extensions.sparkle.studio", "extensions.sparkle.light", "stimuli.build.builder", "scipy"}


def test_the_manifest_records_steps_statistics_and_files(tmp_path: Path) -> None:
    made = built(tmp_path, sparkles={"times": 1.2})
    manifest = json.loads(made.manifest_path.read_text())
    assert manifest["recipe"]["lamp"]["azimuth_deg"] == 90.0
    entry = manifest["stimuli"][2]
    assert [step["step"] for step in entry["steps"]] == ["render", "expose", "resample", "scale"]
    assert 0 <= entry["steps"][1]["saturated_percent"]["left"]["green"] < 100
    counts = entry["steps"][0]["views"]["left"]
    assert counts["splatted"] <= counts["shaded"] <= counts["flakes"]
    image = made.load(entry["name"])
    assert entry["steps"][2]["resolution"]["picture_px"] == [175, 117]
    assert "cycles per degree" in entry["steps"][2]["said"][0]
    told = entry["statistics"]
    assert (told["exposure_s"], told["luminance_scale"]) == (1.0, 1.78)
    luminance = image.left[..., 1].astype(np.float64)
    left = told["eyes"]["left"]
    assert left["max_luminance_cd_m2"] == pytest.approx(luminance.max(), rel=1e-3)
    assert left["mean_luminance_cd_m2"] == pytest.approx(luminance.mean(), rel=1e-3)
    assert left["rms_contrast"] == pytest.approx(luminance.std() / luminance.mean(), rel=1e-2)
    assert left["sparkles"]["count"]["value"] > 0
    assert {"python", "numpy", "OpenImageIO"} <= manifest["versions"].keys()


def test_luminance_scale_multiplies_xyz_after_the_sensor(tmp_path: Path) -> None:
    made = built(
        tmp_path, stimuli=[{"name": "a", "exposure_s": 1}, {"name": "b", "exposure_s": 1, "luminance_scale": 2}]
    )
    np.testing.assert_allclose(made.load("b-stereo").left, 2 * made.load("a-stereo").left, rtol=2e-3)
