"""Wrong input to `cyclopean stimuli build`: each is reported with its file and reason; the cache stays as it was."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from click.testing import CliRunner

from devices.camera import CameraModel, Exposure, write_camera
from documents import InputError
from runner.cli.main import group
from stimuli.pictures import StereoImage, write_exr
from tests.stimuli.develop.dng import exposure_tags, write_dng
from tests.stimuli.photographs.raw_pair import MATRIX, write_recipe

XYZ_CHROMATICITIES = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0)
XYZ = np.random.default_rng(1).uniform(5, 60, (40, 48, 3))
Recipe = dict[str, Any]


def raw(path: Path, rgb: Any = None) -> Path:
    rgb = XYZ @ np.linalg.inv(MATRIX).T if rgb is None else rgb
    return write_dng(path, np.clip(rgb, 0, 1), black=(600,), white=65000, tags=exposure_tags((1, 15), (8, 1), 800))


def exr(path: Path, views: dict[str, Any]) -> Path:
    """Write whatever the arrays hold, which `write_exr` would refuse."""
    pixels = np.concatenate([np.asarray(one, np.float32) for one in views.values()], axis=-1)
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "float")
    others = list(views)[1:]
    spec.channelnames = tuple([*"RGB", *(f"{view}.{channel}" for view in others for channel in "RGB")])
    spec.attribute("multiView", f"string[{len(views)}]", tuple(views))
    spec.attribute("chromaticities", "float[8]", XYZ_CHROMATICITIES)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec)
    assert output.write_image(pixels)
    assert output.close()
    return path


def camera(folder: Path) -> None:
    model = CameraModel(MATRIX, np.zeros(3), np.zeros(3), Exposure(1 / 15, 8.0, 800.0), name="test")
    write_camera(model, folder / "camera.yaml")


def photographs(*stimuli: Recipe, **more: Any) -> Recipe:
    return {"schema_version": 1, "kind": "photographs", "camera": "camera.yaml", **more, "stimuli": list(stimuli)}


def pictures(*stimuli: Recipe, **more: Any) -> Recipe:
    return {"schema_version": 1, "kind": "pictures", **more, "stimuli": list(stimuli)}


def pixels_that_are_not_square(folder: Path) -> Recipe:
    write_exr(folder / "one.exr", StereoImage.flat(XYZ.astype(np.float32)))
    spec = oiio.ImageSpec(48, 40, 3, "half")
    spec.attribute("chromaticities", "float[8]", XYZ_CHROMATICITIES)
    spec.attribute("PixelAspectRatio", 1.5)
    output = oiio.ImageOutput.create(str(folder / "pair.exr"))
    assert output is not None
    assert output.open(str(folder / "pair.exr"), spec)
    assert output.write_image(XYZ.astype(np.float32))
    assert output.close()
    return pictures({"name": "good", "file": "one.exr"}, {"name": "bad", "file": "pair.exr"})


def no_right_file(folder: Path) -> Recipe:
    raw(folder / "left.dng")
    return photographs({"name": "bad", "left": "left.dng"}, views=["stereo"])


def negative_from_the_camera(folder: Path) -> Recipe:
    rgb = XYZ @ np.linalg.inv(MATRIX).T
    rgb[5:9, 5:9] = (0.0, 0.0, 0.5)
    raw(folder / "left.dng", rgb)
    stimulus = {"name": "bad", "left": "left.dng", "flat_eye": "left"}
    return photographs(stimulus, views=["flat"], develop={"negative": "refuse"})


def cut_short(folder: Path) -> Recipe:
    raw(folder / "left.dng")
    whole = raw(folder / "right.dng").read_bytes()
    (folder / "right.dng").write_bytes(whole[: len(whole) // 2])
    return photographs({"name": "bad", "left": "left.dng", "right": "right.dng"})


def noise_to_align(folder: Path) -> Recipe:
    random_ = np.random.default_rng(3)
    exr(folder / "pair.exr", {view: random_.uniform(5, 10, (96, 96, 3)) for view in ("left", "right")})
    return pictures({"name": "bad", "file": "pair.exr"}, align={"method": "correlation"})


def crop_beyond(folder: Path) -> Recipe:
    exr(folder / "one.exr", {"center": XYZ})
    return pictures(
        {"name": "bad", "file": "one.exr", "crop": {"left_px": 40, "top_px": 0, "width_px": 9, "height_px": 9}}
    )


def upwards(folder: Path) -> Recipe:
    return photographs({"name": "bad", "left": "../left.dng", "right": "right.dng"})


def one_view_to_align(folder: Path) -> Recipe:
    raw(folder / "center.dng")
    return photographs({"name": "bad", "center": "center.dng"}, views=["flat"], align={"method": "correlation"})


def raw_without_a_camera(folder: Path) -> Recipe:
    raw(folder / "left.dng")
    recipe = photographs({"name": "bad", "left": "left.dng", "flat_eye": "left"}, views=["flat"])
    del recipe["camera"]
    return recipe


def white_beyond(folder: Path) -> Recipe:
    exr(folder / "one.exr", {"center": XYZ})
    luminance = {"white_cd_m2": 50, "white_box": [45, 0, 9, 9]}
    return pictures({"name": "bad", "file": "one.exr", "luminance": luminance})


WRONG: dict[str, tuple[Callable[[Path], Recipe], str, str]] = {
    "wide pixels": (pixels_that_are_not_square, "pair.exr", r"its pixels are 1\.5 times as wide as high"),
    "a missing file": (no_right_file, "recipe.yaml", "'bad' has no view 'right'"),
    "negative by the camera": (negative_from_the_camera, "left.dng", "pixels have negative XYZ"),
    "cut short": (cut_short, "right.dng", "cut short or damaged"),
    "noise": (noise_to_align, "recipe.yaml", "stimulus 'bad'"),
    "one view to align": (one_view_to_align, "recipe.yaml", "'bad' is to be aligned, and has no view 'left'"),
    "no camera": (raw_without_a_camera, "left.dng", "no OpenEXR picture, and the recipe names no camera"),
    "a white beyond": (white_beyond, "recipe.yaml", "'bad': the white_box reaches to column 54 and row 9; .* 48 × 40"),
    "a crop beyond": (crop_beyond, "recipe.yaml", "'bad': the crop reaches to column 49"),
    "a path upwards": (upwards, "recipe.yaml", "'stimuli.1.left' is '../left.dng'"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_input_is_told_and_leaves_the_cache_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    good = tmp_path / "good"
    good.mkdir()
    exr(good / "one.exr", {"center": XYZ})
    build(write_recipe(good, pictures({"name": "one", "file": "one.exr"})))
    before = tree(tmp_path / "cache")
    make, file, reason = WRONG[name]
    folder = tmp_path / "mine"
    folder.mkdir()
    camera(folder)
    recipe = make(folder)
    if name == "wide pixels":
        # A stimulus was made before the wrong one is met, and one is taken from the other set.
        recipe["stimuli"].insert(0, {"name": "other", "file": "one.exr", "luminance": {"scale": 0.5}})
    result = CliRunner().invoke(
        group, ["stimuli", "build", str(write_recipe(folder, recipe)), "--pixel-pitch-mm", "0.3"]
    )
    assert isinstance(result.exception, InputError), result.output
    *_, finding = result.exception.findings
    assert Path(str(finding.file)).name == file
    assert re.search(reason, finding.message), finding
    assert tree(tmp_path / "cache") == before


def build(recipe: Path, *words: str) -> Any:
    result = CliRunner().invoke(
        group, ["stimuli", "build", str(recipe), "--pixel-pitch-mm", "0.3", "--json", *words], catch_exceptions=False
    )
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def tree(folder: Path) -> dict[str, bytes | None]:
    """Return all files and folders, but for records of hashes, which say nothing new."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
        if not path.name.endswith("-hashes.json")
    }


def test_what_the_command_asks_for_first(tmp_path: Path) -> None:
    recipe = write_recipe(tmp_path, pictures({"name": "one", "file": "one.exr"}))
    for words in ([], ["--rig", "a.yaml", "--pixel-pitch-mm", "0.3"]):
        result = CliRunner().invoke(group, ["stimuli", "build", str(recipe), *words])
        assert "name the display" in str(result.exception)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("keep")
    words = ["stimuli", "build", str(recipe), "--pixel-pitch-mm", "0.3", "-o", str(tmp_path / "out")]
    result = CliRunner().invoke(group, words)
    assert "there is something already" in str(result.exception)
    assert (tmp_path / "out" / "mine.txt").read_text() == "keep"


def test_sets_are_listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    exr(tmp_path / "one.exr", {"center": XYZ})
    made = build(write_recipe(tmp_path, pictures({"name": "one", "file": "one.exr"})))
    result = CliRunner().invoke(group, ["stimuli", "list", "--json"], catch_exceptions=False)
    (told,) = json.loads(result.stdout)
    assert (told["folder"], told["digest"], told["stimuli"]) == (made["folder"], made["digest"], ["one"])
    assert "one" in CliRunner().invoke(group, ["stimuli", "list"], catch_exceptions=False).stdout
