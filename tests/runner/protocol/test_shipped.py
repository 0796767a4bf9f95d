"""The experiments that come with cyclopean, and copies with everything that an experiment names."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from documents import InputError
from runner.protocol import (
    copy_experiment,
    read_experiment,
    shipped_experiment,
    shipped_experiments,
    shipped_folder,
)
from stimuli.pictures import StereoImage, write_exr


@pytest.mark.parametrize("name", shipped_experiments())
def test_a_copy_says_the_same_and_names_only_its_own_files(name: str, tmp_path: Path) -> None:
    copied = copy_experiment(shipped_experiment(name), tmp_path / "study")
    copy, original = read_experiment(copied.experiment), read_experiment(shipped_experiment(name))
    assert copy.digest == original.digest
    assert copy.stimulus_names == original.stimulus_names
    named = [Path(copy.rig.file), Path(copy.rig.display.file), copy.recipe_file]
    assert all(file.resolve().is_relative_to(tmp_path / "study") for file in named)
    assert {copied.rig, copied.recipe, copied.experiment, *copied.observers} <= set(copied.files)
    assert {path for path in (tmp_path / "study").rglob("*") if path.is_file()} == set(copied.files)


def test_the_simulated_observers_are_those_who_can_answer(tmp_path: Path) -> None:
    copied = copy_experiment(shipped_experiment("paints"), tmp_path / "study")
    assert [file.stem for file in copied.observers] == ["figure_4_14", "paints"]


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="there already"):
        copy_experiment(shipped_experiment("paints"), tmp_path)
    with pytest.raises(InputError, match="there already"):
        copy_experiment(shipped_experiment("paints"), tmp_path / "notes.txt")
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
    assert (tmp_path / "notes.txt").read_text(encoding="utf-8") == "mine"


def test_a_misspelt_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean 'dynamic_range'"):
        shipped_experiment("dynamic-range")


def study(folder: Path) -> Path:
    """Write a study of one's own: pictures below the recipe, the camera and the rig far from it."""
    shipped = shipped_folder() / "configs"
    recipe = folder / "mine" / "recipes" / "photos"
    (recipe / "day 1").mkdir(parents=True)
    (folder / "lab").mkdir()
    shutil.copyfile(shipped / "cameras" / "nikon_d800.yaml", folder / "lab" / "camera.yaml")
    shutil.copyfile(shipped / "displays" / "asus_vg248qe.yaml", folder / "lab" / "display.yaml")
    rig = {"schema_version": 1, "display": "display.yaml", "mode": "side-by-side", "distance_mm": 700}
    (folder / "lab" / "rig.yaml").write_text(json.dumps(rig), encoding="utf-8")
    grey = StereoImage.flat(np.full((8, 8, 3), 10, np.float32))
    stimuli = []
    for name in ("a", "b"):
        for eye in ("left", "right"):
            write_exr(recipe / "day 1" / f"{name}-{eye}.exr", grey)
        stimuli.append({"name": name, **{eye: f"day 1/{name}-{eye}.exr" for eye in ("left", "right")}})
    text = {"schema_version": 1, "kind": "photographs", "camera": "../../../lab/camera.yaml", "stimuli": stimuli}
    (recipe / "recipe.yaml").write_text(json.dumps(text), encoding="utf-8")
    experiment = {
        "schema_version": 1,
        "name": "mine",
        "rig": "../lab/rig.yaml",
        "stimuli": "recipes/photos/recipe.yaml",
        "question": "Which?",
        "layout": {"arrangement": "vertical", "size_mm": [2, 2]},
        "blocks": [{"kind": "all_pairs"}],
    }
    (folder / "mine" / "study.yaml").write_text(json.dumps(experiment), encoding="utf-8")
    return folder / "mine" / "study.yaml"


def test_pictures_and_camera_come_with_a_study_of_ones_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the experiment is named by a relative path, and the files lie in folders beside its own."""
    study(tmp_path / "one")
    monkeypatch.chdir(tmp_path / "one" / "mine")
    copied = copy_experiment("study.yaml", tmp_path / "two")
    shutil.rmtree(tmp_path / "one" / "lab")
    read_experiment(copied.experiment)
    names = {file.relative_to(tmp_path / "two").as_posix() for file in copied.files}
    pictures = {f"mine/recipes/photos/day 1/{name}-{eye}.exr" for name in "ab" for eye in ("left", "right")}
    others = {"mine/study.yaml", "mine/recipes/photos/recipe.yaml", "lab/rig.yaml", "lab/display.yaml"}
    assert names == pictures | others | {"lab/camera.yaml"}
    assert copied.observers == ()


def test_what_is_missing_is_named_before_anything_is_written(tmp_path: Path) -> None:
    experiment = study(tmp_path / "one")
    (tmp_path / "one" / "mine" / "recipes" / "photos" / "day 1" / "b-left.exr").unlink()
    with pytest.raises(InputError, match=r"b-left\.exr: there is no such file"):
        copy_experiment(experiment, tmp_path / "two")
    assert not (tmp_path / "two").exists()


def test_a_file_named_by_an_absolute_path_stays_where_it_is(tmp_path: Path) -> None:
    experiment = study(tmp_path / "one")
    rig = tmp_path / "one" / "lab" / "rig.yaml"
    text = experiment.read_text(encoding="utf-8").replace("../lab/rig.yaml", rig.as_posix())
    experiment.write_text(text, encoding="utf-8")
    copied = copy_experiment(experiment, tmp_path / "two")
    assert copied.rig == rig
    assert "rig.yaml" not in {file.name for file in copied.files}
    read_experiment(copied.experiment)


def test_settings_that_led_and_now_stand_beside_are_the_same_experiment_to_its_sessions(tmp_path: Path) -> None:
    file = copy_experiment(shipped_experiment("dynamic_range"), tmp_path / "study").experiment
    now = read_experiment(file)
    assert now.spec.analysis.beside is not None
    text, led = file.read_text(encoding="utf-8"), "{alpha: 0.045, adjust: none, covariance: model}"
    assert f"analysis: {{beside: {led}}}" in text
    file.write_text(text.replace(f"{{beside: {led}}}", led), encoding="utf-8")
    assert read_experiment(file).digest == now.digest
    file.write_text(text.replace(f"{{beside: {led}}}", "{alpha: 0.01}"), encoding="utf-8")
    assert read_experiment(file).digest != now.digest
