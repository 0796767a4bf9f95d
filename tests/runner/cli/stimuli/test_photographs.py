"""From raw files to an experiment that can be run: camera fit, develop, align, luminance, size, all by commands."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from stimuli.pictures import StereoImage, read_exr, resample_picture
from tests.invoked import printed_json
from tests.stimuli.photographs.raw_pair import (
    LEFT_AT,
    PX_PER_MM,
    RIGHT_AT,
    ROOT,
    chart_csv,
    raw_pair,
    write_recipe,
)

RIG = ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml"


def fitted(folder: Path) -> Path:
    """Fit the camera that took the raw files to its chart."""
    folder.mkdir(parents=True, exist_ok=True)
    chart = chart_csv(folder / "chart.csv")
    printed_json("camera", "fit", chart, "--exposure", "1/15,8,800", "-o", folder / "camera.yaml")
    return folder / "camera.yaml"


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_raw_files_of_a_sparkling_plate_become_stimuli_whose_xyz_are_the_plate_s(tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    fitted(folder)
    # Photographed at 1/30 s: half the signal of the camera file's exposure.
    pair = raw_pair(folder, times=0.5, time=(1, 30))
    target = 1.5 * float(np.mean([pair.plate.left[8:160, 8:232, 1], pair.plate.right[8:160, 8:232, 1]]))
    # What both views show begins with the plate at 12 + 19 and 12 + 2 in the left one.
    recipe = {
        **pair.recipe,
        "views": ["stereo", "flat"],
        "align": {"method": "correlation", "region": [40, 24, 264, 174], "most_px": [40, 10], "whole_pixels": True},
        "crop": {"left_px": 20, "top_px": 20, "width_px": 224, "height_px": 152},
        "luminance": {"mean_cd_m2": target},
        "resample": {"px_per_mm": PX_PER_MM},
        "sparkles": {"times": 1.5},
    }
    told = printed_json("stimuli", "build", write_recipe(folder, recipe), "--rig", RIG, "-o", tmp_path / "out")
    assert [one["name"] for one in told["stimuli"]] == ["plate-stereo", "plate-flat"]
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    steps = {step["step"]: step for step in manifest["stimuli"][0]["steps"]}
    assert steps["align"]["shift_px"] == pytest.approx(RIGHT_AT[0] - LEFT_AT[0], abs=0.5)
    assert steps["align"]["vertical_px"] == pytest.approx(RIGHT_AT[1] - LEFT_AT[1], abs=0.5)
    assert steps["camera_to_xyz"]["signal_beside_characterisation"] == pytest.approx(0.5, rel=1e-6)
    assert steps["exposure"]["time_s"] == pytest.approx(1 / 30)
    assert steps["adapt"]["luminance_scale"] == pytest.approx(1.5, rel=2e-3)
    assert {"mm", "arcmin"} <= steps["disparity"]["vertical"].keys()
    assert steps["resample"]["resolution"]["picture_px"] == [224, 152]
    assert any("cycles per degree" in sentence for sentence in steps["resample"]["said"])
    assert len(manifest["inputs"]) == 3
    # The aligned pair begins in the left view where the shift lets it; the plate then at (LEFT_AT - start).
    start = steps["crop"]["start_px"]
    at = [int(start["left"][axis] + recipe_crop - LEFT_AT[axis]) for axis, recipe_crop in ((0, 20), (1, 20))]
    rows, columns = slice(at[1], at[1] + 152), slice(at[0], at[0] + 224)
    scale = steps["adapt"]["luminance_scale"]
    truth = StereoImage(scale * pair.plate.left[rows, columns], scale * pair.plate.right[rows, columns])
    shown = resample_picture(truth, (224 / PX_PER_MM, 152 / PX_PER_MM), 0.2768)
    built = read_exr(tmp_path / "out" / "plate-stereo.exr")
    for eye, expected in ((built.left, shown.left), (built.right, shown.right)):
        error = np.abs(eye - expected) / expected[..., 1:2].mean()
        assert error.max() < 2.5e-3  # half floats, raw codes and the fitted matrix: 1.5e-3 of the mean luminance
        assert error.mean() < 4e-4
    flat = read_exr(tmp_path / "out" / "plate-flat.exr")
    assert flat.is_flat
    statistics = manifest["stimuli"][0]["statistics"]
    assert statistics["exposure_s"] == pytest.approx(1 / 30)
    assert statistics["eyes"]["left"]["saturated_percent"]["any"] <= 100
    assert statistics["eyes"]["left"]["sparkles"]["count"]["value"] > 10
    assert (tmp_path / "out" / "contact_sheet.png").stat().st_size > 1000
    # An experiment shows them, on the same display, without building anything again.
    experiment = {
        "schema_version": 1,
        "name": "mine",
        "rig": str(RIG),
        "stimuli": "recipe.yaml",
        "question": "Which?",
        "layout": {"arrangement": "vertical", "size_mm": [28, 19], "gap_mm": 10},
        "blocks": [{"kind": "all_pairs", "stimuli": "all"}],
    }
    (folder / "experiment.yaml").write_text(yaml.safe_dump(experiment))
    (checked,) = printed_json("check", folder / "experiment.yaml", "--no-screen", "--results", tmp_path / "results")
    assert checked["findings"] == []
    again = printed_json("stimuli", "build", folder / "recipe.yaml", "--rig", RIG)
    assert (again["rendered"], again["digest"]) == (0, told["digest"])
    assert len(list((tmp_path / "cache").glob("[!.]*/manifest.json"))) == 1
