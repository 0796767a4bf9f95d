"""What a recipe may say, and how it is told what it may not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from documents import InputError
from stimuli.recipes import Recipe, read_recipe
from stimuli.recipes.pictures import PicturesRecipe
from stimuli.recipes.sparkle_plate import SparklePlateRecipe

ROOT = Path(__file__).parents[3]
STIMULI = ROOT / "configs" / "stimuli"
GRAY = STIMULI / "manitoba_gray.yaml"


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


def pictures(tmp_path: Path, body: str) -> Path:
    file = tmp_path / "recipe.yaml"
    file.write_text(f"schema_version: 1\nkind: pictures\n{body}")
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


@pytest.mark.parametrize("file", ["/tmp/a.exr", "../a.exr", "a/../../b.exr", "C:/a.exr", "..\\a.exr", "''"])
def test_pictures_stay_in_the_recipe_s_folder(tmp_path: Path, file: str) -> None:
    with pytest.raises(InputError, match=r"recipe\.yaml:4:23: .*the recipe's own folder"):
        read_recipe(pictures(tmp_path, f"stimuli:\n  - {{name: one, file: {file}}}\n"))


def test_names_that_differ_only_in_case_are_one_file_on_some_disks(tmp_path: Path) -> None:
    body = "stimuli:\n  - {name: one, file: a.exr}\n  - {name: One, file: b.exr}\n"
    with pytest.raises(InputError, match=r"recipe\.yaml:5:.*'One' stands twice"):
        read_recipe(pictures(tmp_path, body))


def test_views_are_said_once(tmp_path: Path) -> None:
    body = "views: [flat]\nstimuli:\n  - {name: one, file: a.exr, view: flat}\n"
    with pytest.raises(InputError, match="keep one of the two"):
        read_recipe(pictures(tmp_path, body))


def test_a_picture_s_defaults(tmp_path: Path) -> None:
    recipe, _ = read_recipe(pictures(tmp_path, "stimuli:\n  - {name: one, file: sub/a.exr}\n"))
    assert isinstance(recipe, PicturesRecipe)
    picture = recipe.stimuli[0]
    assert (picture.view, picture.colour_space, picture.negative) == (None, "declared", "refuse")


def test_editors_are_told_that_an_exposure_may_be_a_fraction() -> None:
    exposure = Recipe.model_json_schema()["$defs"]["ExposureSpec"]["properties"]["exposure_s"]
    assert [option["type"] for option in exposure["anyOf"]] == ["number", "string"]
