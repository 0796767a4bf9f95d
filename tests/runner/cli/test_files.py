"""`check`, `preview`, `schema` and `doctor`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from PIL import Image

from devices.compensation import Correction
from devices.display import read_display
from documents import InputError
from runner.cli.main import group
from runner.presenter.arithmetic import Arithmetic
from runner.protocol import read_experiment
from stimuli.pictures import read_exr
from tests.invoked import invoked
from tests.runner.cli.every_command import EXTENDED

Study = Any  # tests/conftest.py
ROOT = Path(__file__).parents[3]
# Those of plates are checked with their extension: tests/extensions/sparkle.
SHIPPED = [file for file in sorted(ROOT.glob("configs/*/*.yaml")) if file.parent.name != "stimuli"]


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.name)
def test_every_shipped_file_is_right(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path))
    result = invoked("check", file, "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)[0]["findings"] == []


def test_preview_holds_the_exact_codes_of_each_eye(study: Study) -> None:
    output = study.folder / "preview"
    result = invoked("preview", study.experiment, "-o", output, "--json")
    assert result.exit_code == 0, result.output
    files = sorted(output.glob("*.png"))
    # Instructions, six pairs and one break, for two eyes.
    assert len(files) == len(json.loads(result.stdout)) == 18
    model = read_display(study.folder / "display.yaml").models("side-by-side").left
    block = read_experiment(study.experiment).blocks("01")[1]
    (first, _second) = next(iter(block.steps())).scene.stimuli  # type: ignore[union-attr]  # an Ask or a Hold
    image = read_exr(study.folder / f"{first}.exr")
    for eye in ("left", "right"):
        codes = np.asarray(Image.open(output / f"block-02_screen-001_{eye}.png"))
        assert codes.shape == (480, 320, 3)
        shown = codes[240 - 30 - 20 : 240 - 30 + 20, 160 - 40 : 160 + 40]
        assert np.abs(shown - model.code(image.eye(eye)) * 255).max() <= 0.501


def test_preview_marks_what_is_clipped_where_the_panel_is_dim(study: Study) -> None:
    output = study.folder / "preview"
    gains = "gain_map: {luminance: [[40, 40], [100, 100]], positions: cells, normalise: centre}"
    study.edit("display.yaml", "    source: made up for tests", f"    {gains}\n    source: made up for tests")
    result = invoked("preview", study.experiment, "-o", output, "--clipping", "--json")
    assert result.exit_code == 0, result.output
    design = read_experiment(study.experiment)
    names = next(iter(design.blocks("01")[1].steps())).scene.stimuli  # type: ignore[union-attr]  # an Ask or a Hold
    images = [read_exr(study.folder / f"{name}.exr") for name in names]
    rig = design.rig
    compensation = design.mode.compensation(rig.models, rig.display.panel.resolution_px, Correction(None, rig.gain_map))
    codes = np.asarray(Image.open(output / "block-02_screen-001_clipping_left.png")).astype(int)
    marked = np.ptp(codes, axis=2) > 128
    counts = [
        rig.models.left.clipping(compensation.evened((image.left, image.right), place)[0], half=image.half).any_channel
        for image, place in zip(images, design.places_px, strict=True)
    ]
    assert counts[0] > counts[1] + 100
    assert [marked[:240].sum(), marked[240:].sum()] == counts


def test_preview_of_a_wrong_experiment_writes_nothing(study: Study) -> None:
    study.edit("small.yaml", "all_pairs", "al_pairs")
    output = study.folder / "preview"
    with pytest.raises(InputError, match="did you mean 'all_pairs'"):
        CliRunner().invoke(group, ["preview", str(study.experiment), "-o", str(output)], catch_exceptions=False)
    assert not output.exists()


@pytest.mark.parametrize(
    ("kind", "shipped"),
    [
        ("experiment", "experiments/dynamic_range.yaml"),
        ("rig", "configs/rigs/asus_vg248qe_3dvision.yaml"),
        ("display", "configs/displays/asus_vg248qe.yaml"),
        ("stimuli", "configs/stimuli/photographs/recipe.yaml"),
        ("observers", "configs/observers/table_4_4.yaml"),
        ("camera", "configs/cameras/nikon_d800.yaml"),
        ("regions", "configs/regions/plate.yaml"),
    ],
)
def test_schemas_are_json_schema_and_name_every_key_of_the_shipped_file(kind: str, shipped: str) -> None:
    schema = json.loads(invoked("schema", kind).stdout)
    assert schema["$schema"].startswith("https://json-schema.org/")
    branches = [schema, *schema.get("$defs", {}).values()]
    keys = set(yaml.safe_load((ROOT / shipped).read_text()))
    assert any(keys <= set(branch.get("properties", {})) for branch in branches)


def test_doctor_says_what_there_is() -> None:
    result = invoked("doctor", "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    assert set(facts["surfaces"]) == {"egl", "null", "window"}
    wrong = {name for name, package in facts["packages"].items() if package["problem"] is not None}
    assert wrong == (set() if EXTENDED else {"extensions"})
    egl = facts["surfaces"]["egl"]
    assert egl["modes"]["side-by-side"] is None
    assert "GL_STEREO is false" in egl["modes"]["quad-buffered"]
    for surface in facts["surfaces"].values():
        if surface["problem"] is None:
            ten_bits = surface["ten_bits"]
            assert ten_bits["given"] or "10 bits a channel were asked for" in ten_bits["problem"]
            assert surface["facts"]["arithmetic"].split(":")[0] in {kind.value for kind in Arithmetic}
    assert facts["measures"]["s-cielab"] is None
    printed = invoked("doctor").output
    assert f"colours computed in {egl['facts']['arithmetic']}" in printed
    assert "installed: delta-e-2000, s-cielab" in printed


def test_the_schema_of_a_photodiode_s_record_names_its_keys() -> None:
    schema = json.loads(invoked("schema", "verification").stdout)
    assert {"onsets", "onset_error_ms", "refresh_hz", "mode"} <= set(schema["properties"])
