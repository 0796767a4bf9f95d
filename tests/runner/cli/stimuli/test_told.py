"""What `cyclopean stimuli` tells of what it built, and of what killed builds left."""

from __future__ import annotations

import json
import os
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from stimuli.build import BuiltStimulus
from stimuli.build import notes_on as notes
from stimuli.build.cache import locked
from stimuli.pictures import StereoImage, write_exr
from tests.invoked import printed
from tests.stimuli.photographs.raw_pair import ROOT, write_recipe

RIG = ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml"
NAMES = [f"a-plate-with-a-long-name-{number}" for number in range(5)]


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


told = partial(printed, "stimuli")


def five_pictures(folder: Path) -> Path:
    """Write a recipe of five pictures, the last of another size."""
    recipe = {"schema_version": 1, "kind": "pictures", "resample": {"px_per_mm": 30}, "stimuli": []}
    for name in NAMES:
        xyz = np.full((90, 120 if name == NAMES[-1] else 150, 3), 5, np.float32)
        write_exr(folder / f"{name}.exr", StereoImage(xyz, 2 * xyz))
        recipe["stimuli"].append({"name": name, "file": f"{name}.exr"})  # type: ignore[attr-defined]  # the test knows its kind
    return write_recipe(folder, recipe)


def test_names_are_whole_in_a_pipe_and_each_note_is_said_once(tmp_path: Path) -> None:
    output = told("build", str(five_pictures(tmp_path)), "--rig", str(RIG))
    assert all(sum(line.startswith(f" {name} ") for line in output.splitlines()) == 1 for name in NAMES)
    said = [line for line in output.splitlines() if line.startswith("Note: ")]
    assert len(said) == 3
    assert said[0].startswith(f"Note: {NAMES[0]} and 3 others of the 5 pictures: 18 pixels across")
    assert said[1].startswith("Note: every picture: the picture's detail")
    assert said[2].startswith(f"Note: {NAMES[-1]}: 14 pixels across")
    assert "…" not in told("list")


def test_on_a_terminal_of_eighty_columns_numbers_are_whole(
    tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told("build", str(five_pictures(tmp_path)), "--pixel-pitch-mm", "0.27681234")
    (manifest,) = cache.glob("*/manifest.json")
    text = manifest.read_text()
    known = json.loads(text)
    known["stimuli"][0]["name"] = "a-plate-with-a-name-that-leaves-no-room-for-numbers"
    known["recipe"]["kind"] = "photographs"
    manifest.write_text(json.dumps(known))
    for name, value in (("FORCE_COLOR", "1"), ("TERM", "dumb"), ("COLUMNS", "80")):
        monkeypatch.setenv(name, value)
    lines = told("list").splitlines()
    assert max(len(line) for line in lines if not line.startswith("In ")) <= 80
    row = lines[1].split()
    assert row[1] == "5"
    assert row[3] == "0.276812"
    assert float(row[4]) >= 0
    assert row[5] == manifest.parent.name
    # On a narrower one the folder has a table of its own, and nothing is lost.
    monkeypatch.setenv("COLUMNS", "60")
    lines = told("list").splitlines()
    assert lines[1].split()[3] == "0.276812"
    assert manifest.parent.name in {line.split()[-1] for line in lines}


def test_a_note_names_one_picture_of_one_or_a_few_of_many() -> None:
    def stimulus(name: str, *notes: str) -> BuiltStimulus:
        return BuiltStimulus(name, {}, True, (1, 1), {}, notes, None)

    assert list(notes([stimulus("a", "x", "x")])) == ["a: x."]
    assert list(notes([stimulus("a", "x"), stimulus("b", "x"), stimulus("c")])) == ["a, b: x."]


def killed(cache: Path, digit: str, age_h: float, suffix: str = "") -> Path:
    """Leave what a killed build leaves."""
    folder = cache / f".{digit * 32}{suffix}"
    folder.mkdir(parents=True)
    (folder / "one.exr").write_bytes(b"1" * 1000)
    (folder / "one.json").write_text("{}")
    for path in (*folder.iterdir(), folder):
        os.utime(path, (time.time() - age_h * 3600,) * 2)
    return folder


def test_what_killed_builds_left_is_named_and_removed_after_a_day(tmp_path: Path, cache: Path) -> None:
    told("build", str(five_pictures(tmp_path)), "--pixel-pitch-mm", "0.3")
    whole = set(cache.rglob("*"))
    old, draft, fresh, at_work = (
        killed(cache, "a", 30),
        killed(cache, "b", 25, "-new"),
        killed(cache, "c", 23),
        killed(cache, "d", 30),
    )
    # Written to again, although the folder itself is old.
    busy = killed(cache, "e", 30)
    (busy / "one.json").write_text("{}")
    listed = told("list")
    assert f"Unfinished: {old.name}: 1 picture, 0.0 MB" in listed
    assert listed.count("Unfinished: ") == 5
    with locked(cache / ("d" * 32)):
        removed = json.loads(told("clean", "--json"))
    assert [one["folder"] for one in removed] == [str(old), str(draft)]
    assert (removed[0]["pictures"], removed[0]["bytes"]) == (1, 1002)
    assert removed[0]["untouched_hours"] == pytest.approx(30, abs=0.1)
    assert [path.exists() for path in (old, draft, fresh, at_work, busy)] == [False, False, True, True, True]
    assert "Left alone: 2 unfinished" in told("clean")
    assert "Removed" in told("clean", "--hours", "0")
    assert set(cache.rglob("*")) == whole
    assert "nothing to remove" in told("clean")
