"""The steps of a recipe, on pictures: aligned, cropped, brought to a luminance, resampled; stereo and flat."""

from __future__ import annotations

import inspect
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import stimuli.recipes.view_sources
from documents import InputError
from stimuli.build import StimulusSet, build_set
from stimuli.develop import read_camera_image
from stimuli.errors import StimulusError
from stimuli.pictures import Decoding, StereoImage, read_exr, read_exr_counted, resample_picture, write_exr
from stimuli.recipes import read_recipe
from stimuli.recipes.photographs import PhotographsRecipe
from stimuli.recipes.picture_steps import _within
from stimuli.recipes.values import DevelopSpec
from tests.runner.cli.stimuli.test_wrong_input import exr
from tests.stimuli.photographs.raw_pair import ROOT, write_recipe
from tests.stimuli.spectral.pictures import save_exr
from tests.stimuli.test_align import view

PITCH_MM = 0.2768


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def texture(shape: tuple[int, int] = (140, 180), seed: int = 2) -> Any:
    random_ = np.random.default_rng(seed)
    light = 8 + 3 * gaussian_filter(random_.standard_normal(shape), 1.2) + 60 * (random_.random(shape) > 0.995)
    return (light[..., None] * np.array([0.95, 1.0, 1.08])).astype(np.float32)


def multi_view(path: Path, shift: tuple[int, int] = (7, 2)) -> Any:
    """Write a scene as left, centre and right see it, each ``shift`` further; return the scene."""
    scene = texture()
    views = {}
    for place, name in enumerate(("left", "center", "right")):
        down, across = 20 - place * shift[1], 30 - place * shift[0]
        views[name] = scene[down : down + 96, across : across + 128]
    exr(path, views)
    return scene


def made(folder: Path, *stimuli: dict[str, Any], **more: Any) -> StimulusSet:
    recipe = {"schema_version": 1, "kind": "pictures", **more, "stimuli": list(stimuli)}
    return build_set(write_recipe(folder, recipe), PITCH_MM)


def step(entry: Any, name: str) -> Any:
    (found,) = [one for one in entry["steps"] if one["step"] == name]
    return found


@pytest.mark.parametrize(
    "align",
    [
        {"method": "correlation", "whole_pixels": True},
        {"method": "points", "points": {"left": [[60, 40], [80, 60]], "right": [[74, 44], [94, 64]]}},
    ],
)
def test_a_multi_view_file_is_aligned_and_its_centre_shows_the_same_part(tmp_path: Path, align: dict[str, Any]) -> None:
    scene = multi_view(tmp_path / "pair.exr")
    sets = made(tmp_path, {"name": "a", "file": "pair.exr"}, align=align, views=["stereo", "flat"])
    stereo, flat = sets.load("a-stereo"), sets.load("a-flat")
    np.testing.assert_array_equal(stereo.left, stereo.right)
    assert flat.is_flat
    np.testing.assert_allclose(flat.left, stereo.left, rtol=2e-3)
    there = scene[20 : 20 + stereo.height_px, 30 : 30 + stereo.width_px]
    np.testing.assert_allclose(stereo.left, there, rtol=1e-3)
    assert step(sets.entry("a-stereo"), "align")["shift_px"] == pytest.approx(14, abs=0.05)
    assert step(sets.entry("a-flat"), "flat")["view"] == "center"


def test_without_a_centre_the_named_eye_is_the_flat_version(tmp_path: Path) -> None:
    scene = texture()
    write_exr(tmp_path / "pair.exr", StereoImage(scene[10:100, 20:140], scene[10:100, 14:134]))
    align = {"method": "offset", "offset_px": [6, 0]}
    sets = made(tmp_path, {"name": "a", "file": "pair.exr", "flat_eye": "right"}, align=align, views=["stereo", "flat"])
    np.testing.assert_array_equal(sets.load("a-flat").left, sets.load("a-stereo").right)
    with pytest.raises(StimulusError, match="no centre view"):
        made(tmp_path, {"name": "a", "file": "pair.exr"}, align=align, views=["stereo", "flat"])


def test_a_pair_is_read_once_for_both_its_views(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = texture()
    write_exr(tmp_path / "pair.exr", StereoImage(scene[10:100, 20:140], scene[10:100, 14:134]))
    multi_view(tmp_path / "three.exr")
    read: list[str] = []

    def counted(path: Path, *words: Any, **more: Any) -> Any:
        read.append(path.name)
        return read_exr_counted(path, *words, **more)

    monkeypatch.setattr(stimuli.recipes.view_sources, "read_exr_counted", counted)
    offsets = {"pair": [6, 0], "three": [14, 4]}
    stimuli_ = [
        {"name": one, "file": f"{one}.exr", "flat_eye": "left", "align": {"method": "offset", "offset_px": offset}}
        for one, offset in offsets.items()
    ]
    sets = made(tmp_path, *stimuli_, views=["stereo", "flat"])
    assert read == ["pair.exr", "three.exr", "three.exr"]
    assert [step(sets.entry(f"{one}-flat"), "flat")["view"] for one in ("pair", "three")] == ["left", "center"]


@pytest.mark.nightly
def test_a_rolled_camera_is_straightened_before_the_pair_is_aligned(tmp_path: Path) -> None:
    exr(tmp_path / "rolled.exr", {"left": view(), "center": view(shift=(3, 0)), "right": view(0.5, 1.0, (6, 0.5))})
    align = {"method": "correlation", "region": [30, 30, 250, 250]}
    rolled = {"name": "a", "file": "rolled.exr"}
    reach = []
    for more in ({}, {"straighten": True}):
        sets = made(tmp_path, rolled, align=align | more, views=["stereo", "flat"])
        entry = sets.entry("a-stereo")
        found = step(entry, "disparity")["vertical"]["px"]
        reach.append(found["high"] - found["low"])
        assert sets.load("a-flat").left.shape == sets.load("a-stereo").left.shape
        assert step(sets.entry("a-flat"), "flat")["view"] == "center"
    assert reach[0] > 1 > 0.1 > reach[1]
    assert step(entry, "straighten")["roll_deg"] == pytest.approx(0.5, abs=0.01)
    # The region is the original left view's.
    crop = step(entry, "straighten")["crop"]
    assert crop[0] > 0
    assert step(entry, "align")["region"] == [30 - crop[0], 30 - crop[1], 250 - crop[0], 250 - crop[1]]
    assert _within((5, 0, 100, 95), (10, 20, 200, 90)) == (0, 0, 90, 70)
    points = {"left": [[60, 40]], "right": [[74, 44]]}
    with pytest.raises(InputError, match="straighten moves the places"):
        made(tmp_path, rolled, align={"method": "points", "points": points, "straighten": True})


def test_toe_in_is_undone_before_the_pair_is_aligned(tmp_path: Path) -> None:
    scene = texture()[10:120, 20:160]
    write_exr(tmp_path / "pair.exr", StereoImage(scene, scene.copy()))
    sets = made(tmp_path, {"name": "a", "file": "pair.exr"}, toe_in={"toe_in_deg": 2.6, "field_of_view_deg": 20})
    assert max(map(abs, step(sets.entry("a"), "rectify_toe_in")["keystone"]["vertical_px"])) > 0.3
    assert sets.size_px("a")[0] < 140


@pytest.mark.parametrize(
    ("luminance", "measured"),
    [
        ({"mean_cd_m2": 4.0}, lambda one: one.left[..., 1].mean(dtype=np.float64)),
        ({"max_cd_m2": 4.0}, lambda one: one.left[..., 1].max()),
        ({"white_cd_m2": 4.0, "white_box": [5, 9, 20, 10]}, lambda one: np.median(one.left[9:19, 5:25, 1])),
    ],
)
def test_one_factor_brings_the_picture_to_its_luminance(tmp_path: Path, luminance: Any, measured: Any) -> None:
    write_exr(tmp_path / "one.exr", StereoImage.flat(texture()))
    sets = made(tmp_path, {"name": "a", "file": "one.exr"}, luminance=luminance)
    assert measured(sets.load("a")) == pytest.approx(4.0, rel=1e-3)
    entry = sets.entry("a")
    assert entry["statistics"]["luminance_scale"] == pytest.approx(step(entry, "adapt")["luminance_scale"])


@pytest.mark.parametrize("filter_", ["area", "cubic"])
def test_pictures_are_resampled_to_their_true_size(tmp_path: Path, filter_: Any) -> None:
    scene = texture()
    write_exr(tmp_path / "one.exr", StereoImage.flat(scene))
    resample = {"width_mm": 18.0, "filter": filter_}
    sets = made(tmp_path, {"name": "a", "file": "one.exr"}, resample=resample)
    expected = resample_picture(StereoImage.flat(scene), (18.0, 14.0), PITCH_MM, filter_)
    assert sets.size_px("a") == (65, 51) == (expected.width_px, expected.height_px)
    np.testing.assert_allclose(sets.load("a").left, expected.left, rtol=1e-3)
    crop = {"left_px": 10, "top_px": 20, "width_px": 100, "height_px": 60}
    sets = made(tmp_path, {"name": "a", "file": "one.exr"}, resample={"px_per_mm": 10}, crop=crop)
    assert sets.size_px("a") == (36, 22)
    assert [one["step"] for one in sets.entry("a")["steps"]] == ["read", "crop_to_plate", "resample"]


def test_a_stimulus_s_own_step_takes_the_place_of_the_recipe_s_and_changes_no_other(tmp_path: Path) -> None:
    write_exr(tmp_path / "one.exr", StereoImage.flat(texture()))
    first, second = {"name": "a", "file": "one.exr"}, {"name": "b", "file": "one.exr"}
    made(tmp_path, first, second | {"luminance": {"scale": 2.0}}, luminance={"scale": 0.5})
    sets = made(tmp_path, first, second | {"luminance": {"scale": 3.0}}, luminance={"scale": 0.5})
    assert sets.rendered == 1
    np.testing.assert_allclose(sets.load("b").left, 6 * sets.load("a").left, rtol=2e-3)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"align": {"method": "offset"}}, "method offset needs offset_px"),
        ({"luminance": {"scale": 1, "mean_cd_m2": 2}}, "one decides the factor"),
        ({"luminance": {"white_cd_m2": 2}}, "white_box go together"),
        ({"toe_in": {"toe_in_deg": 2}}, "focal_length_px or field_of_view_deg"),
        ({"sparkles": {"times": 0}}, "'times' the background"),
        ({"series": [{"name": "x"}, {"name": "X"}]}, "stands twice"),
    ],
)
def test_steps_that_cannot_be_are_refused(tmp_path: Path, change: dict[str, Any], reason: str) -> None:
    recipe = {
        "schema_version": 1,
        "kind": "pictures",
        "stimuli": [{"name": "a", "file": "one.exr", "colour_space": "xyz"}],
    }
    with pytest.raises(StimulusError if "series" in change else Exception, match=reason):
        read_recipe(write_recipe(tmp_path, {**recipe, **change}))


def test_spectral_views_become_xyz_in_their_light(tmp_path: Path) -> None:
    waves = np.arange(400.0, 701.0, 10.0)
    for name, share in (("left", 0.5), ("right", 0.25)):
        save_exr(tmp_path / f"{name}.exr", np.full((40, 48, len(waves)), share), waves, "{}nm")
    recipe: dict[str, Any] = {
        "schema_version": 1,
        "kind": "photographs",
        "spectral": {"quantity": "reflectance", "illuminant": "D65", "white_luminance_cd_m2": 40},
        "stimuli": [{"name": "a", "left": "left.exr", "right": "right.exr"}],
    }
    sets = build_set(write_recipe(tmp_path, recipe), PITCH_MM)
    image = sets.load("a")
    assert image.left[..., 1].mean() == pytest.approx(20, rel=1e-3)
    assert image.right[..., 1].mean() == pytest.approx(10, rel=1e-3)
    (first, second) = sets.entry("a")["steps"]
    assert (first["step"], first["illuminant"], first["view"], second["view"]) == (
        "spectra_to_xyz",
        "D65",
        "left",
        "right",
    )
    with pytest.raises(StimulusError, match=r"left\.exr"):
        build_set(
            write_recipe(tmp_path, {**recipe, "spectral": {"quantity": "radiance", "illuminant": "D65"}}), PITCH_MM
        )


def test_photographs_in_xyz_and_spectra_need_no_camera(tmp_path: Path) -> None:
    scene = texture()
    for name in ("left", "right"):
        write_exr(tmp_path / f"{name}.exr", StereoImage.flat(scene * (1 if name == "left" else 2)))
    recipe: dict[str, Any] = {
        "schema_version": 1,
        "kind": "photographs",
        "stimuli": [{"name": "a", "left": "left.exr", "right": "right.exr"}],
    }
    sets = build_set(write_recipe(tmp_path, recipe), PITCH_MM)
    np.testing.assert_allclose(sets.load("a").right, 2 * sets.load("a").left, rtol=1e-3)
    assert [(one["step"], one["view"]) for one in sets.entry("a")["steps"]] == [("read", "left"), ("read", "right")]


def test_recipes_demosaic_as_camera_develop_does_unless_told() -> None:
    assert DevelopSpec().demosaic == inspect.signature(read_camera_image).parameters["demosaic"].default


def test_the_shipped_recipe_of_photographs_says_which_files_it_lacks() -> None:
    path = ROOT / "configs/stimuli/photographs/recipe.yaml"
    recipe, _ = read_recipe(path)
    assert isinstance(recipe, PhotographsRecipe)
    with pytest.raises(StimulusError) as error:
        build_set(path, PITCH_MM)
    assert all("cannot be read" in finding.message for finding in error.value.findings)
    assert len(error.value.findings) == sum(len(one.files) for one in recipe.stimuli)


@pytest.mark.shared_data
def test_a_real_stereo_file_becomes_a_stereo_and_a_flat_stimulus(shared_data: Path, tmp_path: Path) -> None:
    shutil.copyfile(shared_data / "data/stereo/Adjuster.exr", tmp_path / "Adjuster.exr")
    blade = {"name": "blade", "file": "Adjuster.exr", "colour_space": "rec709", "white_luminance_cd_m2": 20}
    sets = made(tmp_path, blade, views=["stereo", "flat"], resample={"width_mm": 150})
    assert sets.size_px("blade-stereo")[0] == 542
    stereo, flat = sets.load("blade-stereo"), sets.load("blade-flat")
    assert not np.array_equal(stereo.left, stereo.right)
    assert flat.is_flat
    source = read_exr(shared_data / "data/stereo/Adjuster.exr", Decoding("rec709", 20))
    assert stereo.left[..., 1].mean(dtype=np.float64) == pytest.approx(
        source.left[..., 1].mean(dtype=np.float64), rel=5e-3
    )
