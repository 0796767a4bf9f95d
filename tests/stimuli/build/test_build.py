"""Building a stimulus set: what is made, made once, and made whole or not at all."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
import yaml

import stimuli.build.recipe_to_set
from documents import InputError
from stimuli.build import build_set, cache_folder
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage, write_exr

LONG = {"name": "long", "file": "long.exr", "flat_eye": "left"}
PAIRS: dict[str, Any] = {
    "schema_version": 1,
    "kind": "pictures",
    "views": ["stereo", "flat"],
    "resample": {"width_mm": 12},
    "stimuli": [
        {"name": "short", "file": "short.exr", "flat_eye": "right"},
        {**LONG, "luminance": {"scale": 1.78}},
    ],
}


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture(autouse=True)
def pairs(tmp_path: Path) -> None:
    """Pairs of 12 × 8 mm, whose right view is not the left one."""
    for seed, name in enumerate(("short", "long")):
        light = np.random.default_rng(seed).uniform(1, 30, (2, 117, 175, 3)).astype(np.float32)
        write_exr(tmp_path / f"{name}.exr", StereoImage(*light))


def recipe_file(tmp_path: Path, recipe: dict[str, Any]) -> Path:
    path = tmp_path / "recipe.yaml"
    path.write_text(yaml.safe_dump(recipe, sort_keys=False))
    return path


def pictures_recipe(tmp_path: Path, *stimuli: dict[str, Any], **more: Any) -> Path:
    return recipe_file(tmp_path, {"schema_version": 1, "kind": "pictures", **more, "stimuli": list(stimuli)})


def noise(seed: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    return np.random.default_rng(seed).uniform(0, 30, (4, 6, 3)).astype(np.float32)


def test_each_pair_makes_a_stereo_and_a_flat_stimulus_in_order(tmp_path: Path) -> None:
    made = build_set(recipe_file(tmp_path, PAIRS), 0.2768)
    assert made.names == ("short-stereo", "short-flat", "long-stereo", "long-flat")
    assert [made.load(name).is_flat for name in made.names] == [False, True, False, True]
    assert made.factors("short-flat") == {"image": "short", "view": "flat"}
    image = made.load("long-stereo")
    assert (image.width_px, image.height_px) == (43, 29)
    assert not np.array_equal(image.left, image.right)
    assert np.array_equal(image.left, made.load("long-stereo").left)


@pytest.mark.nightly
def test_a_set_that_is_found_loads_nothing_that_makes_pictures(tmp_path: Path) -> None:
    recipe = recipe_file(tmp_path, PAIRS)
    build_set(recipe, 0.2768)
    code = (
        "import sys; from pathlib import Path; from stimuli.build.recipe_to_set import build_set\n"
        f"assert build_set(Path({str(recipe)!r}), 0.2768).rendered == 0\n"
        "print(*sys.modules)"
    )
    ran = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    loaded = set(ran.stdout.split())
    assert "stimuli.recipes.recipe" in loaded
    makers = {
        "stimuli.build.builder",
        "stimuli.recipes.picture_steps",
        "stimuli.align.pair",
        "stimuli.luminance.statistics",
    }
    assert not loaded & (makers | {"scipy", "OpenImageIO", "rawpy", "filelock"})


@pytest.mark.parametrize("change", ["picture", "pitch", "comment"])
def test_what_pictures_depend_on_is_the_key(tmp_path: Path, change: str) -> None:
    path = recipe_file(tmp_path, PAIRS)
    first = build_set(path, 0.2768)
    if change == "picture":
        recipe_file(tmp_path, {**PAIRS, "resample": {"width_mm": 12, "filter": "linear"}})
    if change == "comment":
        path.write_text("# another word\n" + path.read_text())
    second = build_set(path, 0.3 if change == "pitch" else 0.2768)
    assert (second.rendered == 0) == (change == "comment")
    assert (second.digest == first.digest) == (change == "comment")


def test_the_manifest_records_steps_statistics_and_files(tmp_path: Path) -> None:
    made = build_set(recipe_file(tmp_path, {**PAIRS, "sparkles": {"times": 1.2}}), 0.2768)
    manifest = json.loads(made.manifest_path.read_text())
    assert manifest["recipe"]["resample"] == {"filter": "area", "px_per_mm": None, "width_mm": 12.0}
    entry = manifest["stimuli"][2]
    assert [step["step"] for step in entry["steps"]] == ["read", "scale", "resample"]
    image = made.load(entry["name"])
    told = entry["statistics"]
    luminance = image.left[..., 1].astype(np.float64)
    left = told["eyes"]["left"]
    assert left["max_luminance_cd_m2"] == pytest.approx(luminance.max(), rel=1e-3)
    assert left["mean_luminance_cd_m2"] == pytest.approx(luminance.mean(), rel=1e-3)
    assert left["rms_contrast"] == pytest.approx(luminance.std() / luminance.mean(), rel=1e-2)
    assert left["sparkles"]["count"]["value"] > 0
    assert {"python", "numpy", "OpenImageIO"} <= manifest["versions"].keys()


@pytest.mark.parametrize(("damage", "pictures"), [("cut", 1), ("gone", 1), ("other", 1), ("unreadable manifest", 4)])
def test_what_is_damaged_in_the_cache_is_built_again(tmp_path: Path, damage: str, pictures: int) -> None:
    path = recipe_file(tmp_path, PAIRS)
    made = build_set(path, 0.2768)
    victim = made.path("short-stereo")
    if damage == "cut":
        victim.write_bytes(victim.read_bytes()[:-100])
    elif damage == "gone":
        victim.unlink()
    elif damage == "other":
        write_exr(victim, made.load("long-stereo"))
    else:
        made.manifest_path.write_text("{")
    again = build_set(path, 0.2768)
    assert again.rendered == pictures
    assert again.digest == made.digest
    assert build_set(path, 0.2768).rendered == 0


def test_an_interrupted_build_leaves_no_set_and_the_next_one_goes_on_where_it_was(tmp_path: Path, cache: Path) -> None:
    path = recipe_file(tmp_path, PAIRS)

    def stop(doing: str, done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build_set(path, 0.2768, stop)
    assert [entry.name for entry in cache.glob("[!.]*/")] == []
    (workshop,) = cache.glob(".*/")
    # A killed process leaves half a picture, too, and half of a record.
    (workshop / ".half-picture.exr").write_bytes(b"")
    (workshop / "half.part").write_bytes(b"{")
    told: list[tuple[str, int, int]] = []
    made = build_set(path, 0.2768, lambda *what: told.append(what))
    assert made.rendered == 2
    assert [what for what in told if what[1] == 2][-1] == ("making long-stereo", 2, 4)
    assert list(cache.glob(".*/")) == []
    whole = build_set(path, 0.2768, force=True)
    assert (whole.rendered, whole.digest) == (4, made.digest)


def test_changing_one_stimulus_makes_one_picture(tmp_path: Path) -> None:
    first = build_set(recipe_file(tmp_path, PAIRS), 0.2768)
    more = [*PAIRS["stimuli"], {**LONG, "name": "longer"}]
    second = build_set(recipe_file(tmp_path, {**PAIRS, "stimuli": more}), 0.2768)
    assert (second.rendered, len(second.names)) == (2, 6)
    renamed = [{**PAIRS["stimuli"][0], "name": "quick"}, PAIRS["stimuli"][1]]
    third = build_set(recipe_file(tmp_path, {**PAIRS, "stimuli": renamed}), 0.2768)
    assert third.rendered == 0
    assert third.names == ("quick-stereo", "quick-flat", "long-stereo", "long-flat")
    assert third.factors("quick-flat")["image"] == "quick"
    assert third.digest != first.digest
    np.testing.assert_array_equal(third.load("quick-stereo").right, first.load("short-stereo").right)
    assert third.entry("quick-stereo")["sha256"] == first.entry("short-stereo")["sha256"]


def test_the_generator_s_version_is_part_of_the_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = recipe_file(tmp_path, PAIRS)
    build_set(path, 0.2768)
    monkeypatch.setattr(stimuli.build.recipe_to_set, "GENERATOR_VERSION", -1)
    assert build_set(path, 0.2768).rendered == 4


def test_pictures_stereo_and_flat(tmp_path: Path) -> None:
    write_exr(tmp_path / "pair.exr", StereoImage(noise(1), noise(2)))
    write_exr(tmp_path / "one.exr", StereoImage.flat(noise(3)))
    path = pictures_recipe(
        tmp_path,
        {"name": "pair", "file": "pair.exr"},
        {"name": "one", "file": "one.exr"},
        {"name": "left", "file": "pair.exr", "view": "flat", "flat_eye": "left"},
        {"name": "brighter", "file": "one.exr", "white_luminance_cd_m2": 2},
    )
    made = build_set(path, 0.2768)
    assert [made.factors(name)["view"] for name in made.names] == ["stereo", "flat", "flat", "flat"]
    np.testing.assert_array_equal(made.load("left").left, made.load("pair").left)
    np.testing.assert_allclose(made.load("brighter").left, 2 * made.load("one").left, rtol=1e-3)


def test_a_missing_picture_is_named_with_its_line(tmp_path: Path) -> None:
    path = pictures_recipe(tmp_path, {"name": "one", "file": "gone.exr"})
    with pytest.raises(StimulusError, match=r"recipe\.yaml:5:9: the picture 'gone\.exr' cannot be read"):
        build_set(path, 0.2768)


def test_where_the_cache_lies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert cache_folder() == tmp_path / "cache"
    monkeypatch.delenv("CYCLOPEAN_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "cyclopean" / "stimuli"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert cache_folder() == Path.home() / ".cache" / "cyclopean" / "stimuli"


def test_the_same_recipe_elsewhere_makes_the_same_pictures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = recipe_file(tmp_path, PAIRS)
    first = build_set(path, 0.2768)
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "other"))
    second = build_set(path, 0.2768)
    assert second.rendered == 4
    assert first.digest == second.digest


def test_progress_counts_up_to_the_number_of_pictures(tmp_path: Path) -> None:
    calls: list[tuple[str, int, int]] = []
    build_set(recipe_file(tmp_path, PAIRS), 0.2768, lambda doing, done, total: calls.append((doing, done, total)))
    assert [(done, total) for _, done, total in calls] == [(0, 4), (1, 4), (2, 4), (3, 4), (4, 4)]
    assert calls[1][0] == "making short-flat"


def test_a_half_done_picture_is_made_again(tmp_path: Path, cache: Path) -> None:
    path = recipe_file(tmp_path, PAIRS)

    def stop(doing: str, done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build_set(path, 0.2768, stop)
    (workshop,) = cache.glob(".*/")
    first, second, third = sorted(workshop.glob("*.exr"))
    first.write_bytes(first.read_bytes()[:-50])
    second.with_suffix(".json").write_text("{")
    made = build_set(path, 0.2768)
    assert made.rendered == 3
    assert third.name not in [file.name for file in made.folder.iterdir()]
    assert made.digest == build_set(path, 0.2768, force=True).digest


def test_two_names_of_one_picture_are_made_once(tmp_path: Path) -> None:
    twice = [{**LONG, "name": "a"}, {**LONG, "name": "b"}]
    made = build_set(recipe_file(tmp_path, {**PAIRS, "stimuli": twice}), 0.2768)
    assert made.rendered == 2
    assert made.names == ("a-stereo", "a-flat", "b-stereo", "b-flat")
    np.testing.assert_array_equal(made.load("a-flat").left, made.load("b-flat").left)


def test_a_changed_picture_is_built_again(tmp_path: Path) -> None:
    write_exr(tmp_path / "one.exr", StereoImage.flat(noise(3)))
    path = pictures_recipe(tmp_path, {"name": "one", "file": "one.exr"})
    first = build_set(path, 0.2768)
    write_exr(tmp_path / "one.exr", StereoImage.flat(noise(4)))
    second = build_set(path, 0.2768)
    assert second.rendered == 1
    assert second.digest != first.digest


def test_a_flat_view_of_a_pair_needs_an_eye(tmp_path: Path) -> None:
    write_exr(tmp_path / "pair.exr", StereoImage(noise(1), noise(2)))
    path = pictures_recipe(tmp_path, {"name": "pair", "file": "pair.exr"}, views=["stereo", "flat"])
    with pytest.raises(StimulusError, match="no centre view"):
        build_set(path, 0.2768)
    path = pictures_recipe(
        tmp_path, {"name": "pair", "file": "pair.exr", "flat_eye": "right"}, views=["stereo", "flat"]
    )
    assert build_set(path, 0.2768).names == ("pair-stereo", "pair-flat")


def test_an_unknown_stimulus_gets_the_nearest_spelling(tmp_path: Path) -> None:
    made = build_set(recipe_file(tmp_path, PAIRS), 0.2768)
    with pytest.raises(StimulusError, match="did you mean 'short-stereo'"):
        made.load("short-sterio")


def test_a_cache_that_cannot_be_written_is_one_clear_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "file"))
    with pytest.raises(InputError, match="the cache of stimuli cannot be written"):
        build_set(recipe_file(tmp_path, PAIRS), 0.2768)


@pytest.mark.shared_data
def test_real_pictures_in_a_recipe(shared_data: Path, tmp_path: Path) -> None:
    for name in ("Adjuster.exr", "chromaticities_XYZ.exr"):
        shutil.copyfile(shared_data / "data/stereo" / name, tmp_path / name)
    blade = {"name": "blade", "file": "Adjuster.exr", "colour_space": "rec709"}
    path = pictures_recipe(tmp_path, blade, views=["stereo", "flat"])
    made = build_set(path, 0.2768)
    assert [made.load(name).is_flat for name in ("blade-stereo", "blade-flat")] == [False, True]
    assert made.entry("blade-flat")["steps"][0]["views"] == ["center"]
    made = build_set(pictures_recipe(tmp_path, {"name": "room", "file": "chromaticities_XYZ.exr"}), 0.2768)
    assert made.factors("room") == {"image": "room", "view": "flat"}
    with pytest.raises(StimulusError, match="does not declare its chromaticities"):
        build_set(pictures_recipe(tmp_path, {"name": "blade", "file": "Adjuster.exr"}), 0.2768)


@pytest.mark.parametrize(("negative", "clipped"), [("refuse", None), ("clip", 2)])
def test_what_was_clipped_stands_in_the_manifest(tmp_path: Path, negative: str, clipped: int | None) -> None:
    pixels = noise(1)
    pixels[0, :2, 1] = -0.5
    picture = oiio.ImageBuf(pixels)
    picture.specmod().attribute("chromaticities", "float[8]", (1, 0, 0, 1, 0, 0, 1 / 3, 1 / 3))
    assert picture.write(str(tmp_path / "one.exr"))
    path = pictures_recipe(tmp_path, {"name": "one", "file": "one.exr", "negative": negative})
    if clipped is None:
        with pytest.raises(StimulusError, match="2 pixels have negative XYZ"):
            build_set(path, 0.2768)
    else:
        assert build_set(path, 0.2768).entry("one")["steps"][0]["clipped_pixels"] == clipped
