"""Building a stimulus set: what is made, made once, and made whole or not at all."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import stimuli.build.recipe_to_set
from stimuli.build import build_set, cache_folder
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage, write_exr

ROOT = Path(__file__).parents[3]
PLATE: dict[str, Any] = yaml.safe_load((ROOT / "configs/stimuli/manitoba_gray.yaml").read_text())
PLATE["plate"]["size_mm"] = [12, 8]
PLATE["plate"]["flakes"]["per_mm2"] = 40
PLATE["stimuli"] = [{"name": "short", "exposure_s": "1/15"}, {"name": "long", "exposure_s": 1, "luminance_scale": 1.78}]


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def recipe_file(tmp_path: Path, recipe: dict[str, Any]) -> Path:
    path = tmp_path / "recipe.yaml"
    path.write_text(yaml.safe_dump(recipe, sort_keys=False))
    return path


def pictures_recipe(tmp_path: Path, *stimuli: dict[str, Any], **more: Any) -> Path:
    return recipe_file(tmp_path, {"schema_version": 1, "kind": "pictures", **more, "stimuli": list(stimuli)})


def noise(seed: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    return np.random.default_rng(seed).uniform(0, 30, (4, 6, 3)).astype(np.float32)


def test_each_exposure_makes_a_stereo_and_a_flat_stimulus_in_order(tmp_path: Path) -> None:
    made = build_set(recipe_file(tmp_path, PLATE), 0.2768)
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
def test_a_set_that_is_found_loads_nothing_that_makes_pictures(tmp_path: Path) -> None:
    recipe = recipe_file(tmp_path, PLATE)
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
        "stimuli.build.recipe_to_seter",
        "stimuli.sparkle.studio",
        "stimuli.align.pair",
        "stimuli.luminance.statistics",
    }
    assert not loaded & (makers | {"scipy", "OpenImageIO", "rawpy", "filelock"})


@pytest.mark.parametrize("change", ["seed", "pitch", "comment"])
def test_what_pictures_depend_on_is_the_key(tmp_path: Path, change: str) -> None:
    path = recipe_file(tmp_path, PLATE)
    first = build_set(path, 0.2768)
    if change == "seed":
        recipe_file(tmp_path, {**PLATE, "seed": 8})
    if change == "comment":
        path.write_text("# another word\n" + path.read_text())
    second = build_set(path, 0.3 if change == "pitch" else 0.2768)
    assert (second.rendered == 0) == (change == "comment")
    assert (second.digest == first.digest) == (change == "comment")


def test_the_manifest_records_steps_statistics_and_files(tmp_path: Path) -> None:
    made = build_set(recipe_file(tmp_path, {**PLATE, "sparkles": {"times": 1.2}}), 0.2768)
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


@pytest.mark.parametrize(("damage", "pictures"), [("cut", 1), ("gone", 1), ("other", 1), ("unreadable manifest", 4)])
def test_what_is_damaged_in_the_cache_is_built_again(tmp_path: Path, damage: str, pictures: int) -> None:
    path = recipe_file(tmp_path, PLATE)
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
    path = recipe_file(tmp_path, PLATE)

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
    assert [what for what in told if what[1] == 2][-1] == ("rendering long-stereo", 2, 4)
    assert list(cache.glob(".*/")) == []
    whole = build_set(path, 0.2768, force=True)
    assert (whole.rendered, whole.digest) == (4, made.digest)


def test_changing_one_stimulus_makes_one_picture(tmp_path: Path) -> None:
    first = build_set(recipe_file(tmp_path, PLATE), 0.2768)
    more = [*PLATE["stimuli"], {"name": "longer", "exposure_s": 2}]
    second = build_set(recipe_file(tmp_path, {**PLATE, "stimuli": more}), 0.2768)
    assert (second.rendered, len(second.names)) == (2, 6)
    renamed = [{**PLATE["stimuli"][0], "name": "quick"}, PLATE["stimuli"][1]]
    third = build_set(recipe_file(tmp_path, {**PLATE, "stimuli": renamed}), 0.2768)
    assert third.rendered == 0
    assert third.names == ("quick-stereo", "quick-flat", "long-stereo", "long-flat")
    assert third.factors("quick-flat")["image"] == "quick"
    assert third.digest != first.digest
    np.testing.assert_array_equal(third.load("quick-stereo").right, first.load("short-stereo").right)
    assert third.entry("quick-stereo")["sha256"] == first.entry("short-stereo")["sha256"]


def test_the_generator_s_version_is_part_of_the_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = recipe_file(tmp_path, PLATE)
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
