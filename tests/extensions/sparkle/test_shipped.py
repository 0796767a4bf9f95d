"""The experiments and recipes of plates that come with cyclopean: right, in the schema, and copied by `new --from`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from stimuli.recipes import read_recipe
from tests.invoked import invoked

ROOT = Path(__file__).parents[3]
EXPERIMENTS, RECIPES = (sorted(ROOT.glob(names)) for names in ("experiments/*.yaml", "configs/stimuli/*.yaml"))


@pytest.mark.parametrize("file", [*EXPERIMENTS, *RECIPES], ids=lambda file: file.name)
def test_every_shipped_file_is_right(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path))
    # Their 90 pictures take minutes: tests/stress builds them.
    more = ["--no-pictures", "--observers", "5"] if file in EXPERIMENTS else []
    result = invoked("check", file, "--json", *more)
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)[0]["findings"] == []


def test_the_schema_of_recipes_names_every_key_of_a_shipped_plate() -> None:
    (file,) = (file for file in RECIPES if file.stem == "manitoba_gray")
    read_recipe(file)
    keys = set(yaml.safe_load(file.read_text()))
    branches = json.loads(invoked("schema", "stimuli").stdout)["$defs"].values()
    assert any(keys <= set(branch.get("properties", {})) for branch in branches)


@pytest.mark.parametrize("name", ["dynamic_range", "paints", "preliminary"])
def test_a_shipped_experiment_is_copied_under_its_own_name(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = invoked("new", "--from", name)
    assert done.exit_code == 0
    assert (tmp_path / name / "experiments" / f"{name}.yaml").is_file()
    assert f"cyclopean check {name}/experiments/{name}.yaml" in done.stdout
    copied = json.loads(invoked("new", "my_study", "--from", name, "--json").stdout)
    assert all(Path(file).is_file() for file in copied["files"])
