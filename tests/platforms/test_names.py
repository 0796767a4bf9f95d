"""Names and paths that one system takes and another does not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from documents import InputError
from documents.files import looked_for, no_file_name, with_slashes
from documents.yaml import parse_yaml
from runner.protocol import read_experiment
from runner.session.folders import observer_folder
from stimuli.recipes import read_recipe
from stimuli.recipes.values import relative_path

Study = Any  # tests/conftest.py


@pytest.mark.parametrize("name", ["con", "NUL", "aux.exr", "com1", "LPT9.tar.gz", "a.", "a "])
def test_no_file_is_named_so(name: str) -> None:
    assert no_file_name(name)


@pytest.mark.parametrize("name", ["console", "nul-1", "auxiliary.exr", "com10", "a.b", "1.1"])
def test_a_file_may_be_named_so(name: str) -> None:
    assert no_file_name(name) is None


@pytest.mark.parametrize(
    ("file", "old", "new", "why"),
    [
        ("small.yaml", "name: small", "name: con", "Windows keeps the name 'con' for a device"),
        ("recipe.yaml", "name: one,", "name: aux,", "Windows keeps the name 'aux' for a device"),
        ("recipe.yaml", "name: one,", "name: two.,", "full stop or a space at the end"),
        ("recipe.yaml", "name: one,", "name: TWO,", "the name 'two' stands twice"),
        ("recipe.yaml", "one.exr", r"sub\one.exr", "which every system reads: sub/one.exr"),
        (
            "small.yaml",
            "rig: rig.yaml",
            r"rig: sub\rig.yaml",
            "which every system reads: sub/rig.yaml",
        ),
        (
            "small.yaml",
            "rig: rig.yaml",
            r'rig: "..\rig.yaml"',
            "which every system reads: ../rig.yaml",
        ),
        ("small.yaml", "rig: rig.yaml", r'rig: "..\lab\rig.yaml"', "forward slashes"),
        ("small.yaml", "rig: rig.yaml", r'rig: "sub\bar.yaml"', "begins an escape"),
        ("small.yaml", "recipe.yaml", r"sub\recipe.yaml", "which every system reads: sub/recipe.yaml"),
        ("rig.yaml", "display.yaml", r"..\display.yaml", "which every system reads: ../display.yaml"),
    ],
)
def test_what_only_one_system_takes_is_refused_with_what_to_write(
    study: Study, file: str, old: str, new: str, why: str
) -> None:
    study.edit(file, old, new)
    with pytest.raises(InputError) as caught:
        read_experiment(study.experiment)
    assert why in str(caught.value)
    assert file in str(caught.value)


def test_windows_takes_backslashes_in_recipes(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is made of them is the same text as with slashes, so that the cache and the manifest do not differ."""
    monkeypatch.setattr("stimuli.recipes.values.sys.platform", "win32")
    assert relative_path(r"day 1\a.exr") == "day 1/a.exr"
    monkeypatch.setattr("documents.files.paths.sys.platform", "win32")
    assert "looked for" in looked_for(Path("lab.yaml"), r"rigs\lab.yaml")  # the backslash is not what is wrong


def test_observers_that_differ_in_capitals_only_are_one_folder_on_windows(study: Study, tmp_path: Path) -> None:
    run = ("run", study.experiment, "--results", study.results, "--simulate", study.observers, "--observer")
    study.cyclopean(*run, "ann")
    before = sorted(study.results.rglob("*"))
    assert "'Ann' differs from that in capitals only" in study.cyclopean(*run, "Ann", expect=2).stderr
    assert sorted(study.results.rglob("*")) == before
    assert observer_folder(study.results, "small", "anna").name == "sub-anna"


@pytest.mark.parametrize("end", ["\r\n", "\n", "\r"])
def test_yaml_reads_the_same_whatever_ends_its_lines(study: Study, end: str) -> None:
    """Also a text of several lines: observers see the same page."""
    lines = "instructions, text: Look at the two pictures.}"
    study.edit("small.yaml", f"  - {{kind: {lines}", "  - kind: instructions\n    text: |\n      Look.\n      Press.")
    before = read_experiment(study.experiment).digest
    for file in ("small.yaml", "rig.yaml", "recipe.yaml", "display.yaml"):
        text = (study.folder / file).read_text(encoding="utf-8")
        (study.folder / file).write_bytes(text.replace("\n", end).encode())
    assert read_experiment(study.experiment).digest == before
    read_recipe(study.folder / "recipe.yaml")


def test_slashes_are_put_back_where_an_escape_ate_the_letter() -> None:
    assert with_slashes(parse_yaml(r'"..\new\table\rig.yaml"', "a.yaml").data) == "../new/table/rig.yaml"
