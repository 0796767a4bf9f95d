"""Pairs are compared eye by eye, and in depth; and become an experiment."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analysis.records import read_session
from stimuli.pictures import read_exr
from tests.stimuli.comparison.scenes import PLATE, RIG, ROOT, Cyclopean, compared, few, said, written


@pytest.mark.nightly
def test_depth_is_compared(tmp_path: Path, cyclopean: Cyclopean) -> None:
    photo = written(tmp_path / "a.exr", few(), few(1.0))
    same, deeper = (written(tmp_path / f"{name}.exr", few(0.3), few(0.3 + d)) for name, d in (("b", 1.0), ("c", 3.0)))
    found = compared(cyclopean, photo, same, "--regions", PLATE)
    assert found["decision"] == "validated"
    assert list(found["eyes"]) == ["left", "right"]
    found = compared(cyclopean, photo, deeper, "--regions", PLATE, expect=1)
    assert found["disparity"]["difference_px"] == pytest.approx([2.0, 0.0], abs=0.05)
    assert [line for line in said(found, "fails") if "disparity" not in line] == []
    assert any(line.startswith("both eyes: disparity across differs by ") for line in said(found, "fails"))
    shifts = [found["eyes"][eye]["registration"]["shift_px"][0] for eye in ("left", "right")]
    assert shifts == pytest.approx([0.3, 2.3], abs=0.02)


def test_both_eyes_have_one_luminance_factor_and_one_white(tmp_path: Path, cyclopean: Cyclopean) -> None:
    """A rendering has one unit: an eye that is darker than the other in it stays darker."""
    photo = written(tmp_path / "a.exr", few(), few(1.0))
    uneven = written(tmp_path / "b.exr", few(gain=2.0), few(1.0, gain=1.6))
    found = compared(cyclopean, photo, uneven, "--regions", PLATE, "--luminance", "mean_ratio", expect=None)
    tables = [found["eyes"][eye]["regions"] for eye in ("left", "right")]
    assert [table["scaled_by"] for table in tables] == pytest.approx([(1 / 2.0 + 1 / 1.6) / 2] * 2, rel=1e-3)
    assert tables[0]["factor"]["mean_ratio"] == pytest.approx(1 / 2.0, rel=1e-3)
    assert tables[0]["white_XYZ"] == tables[1]["white_XYZ"]
    assert tables[0]["rows"][0]["delta_e"] > 2
    assert tables[1]["rows"][0]["delta_L"] * tables[0]["rows"][0]["delta_L"] < 0


@pytest.mark.nightly
@pytest.mark.parametrize("stereo", [pytest.param(True, marks=pytest.mark.nightly), False])
def test_an_experiment_follows(
    tmp_path: Path, cyclopean: Cyclopean, monkeypatch: pytest.MonkeyPatch, stereo: bool
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "configs").mkdir()
    for name in ("rigs", "displays"):
        (tmp_path / "configs" / name).symlink_to(ROOT / "configs" / name)
    rig = Path("configs/rigs") / RIG.name
    words = tuple(
        written(tmp_path / name, few(gain=gain), few(1.0, gain=gain) if stereo else None)
        for name, gain in (("a b.exr", 1.0), ("b.exr", 1.02))
    )
    found = compared(
        cyclopean, *words, "--regions", PLATE, "--rig", rig, "--experiment", "study", "--luminance", "mean_ratio"
    )
    assert found["written"]["experiment"][0] == "experiments/study.yaml"
    photo, rendering = (read_exr(Path(f"configs/stimuli/study/{name}.exr")) for name in ("photograph", "rendering"))
    assert photo.is_flat != stereo
    np.testing.assert_allclose(photo.left, few(), rtol=1e-3)
    np.testing.assert_allclose(rendering.left, photo.left, rtol=2e-3)  # the factor was undone
    words_told = Path("experiments/study.yaml").read_text(encoding="utf-8")
    assert "Up arrow: the upper image is closer." in words_told or "Left arrow: the left image is closer." in words_told
    assert "rendering" in cyclopean("check", "experiments/study.yaml", "--json").stdout
    views = ("-stereo", "-flat") if stereo else ("",)
    stimuli = [f"{name}{view}" for name in ("photograph", "rendering") for view in views]
    lines = ["schema_version: 1", "kind: bradley_terry", "source: made up", "median_response_time_s: 1.0", "stimuli:"]
    lines += [f"  {name}: {{score: 1}}" for name in stimuli]
    Path("observers.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    ran = cyclopean("run", "experiments/study.yaml", "--observer", "01", "--simulate", "observers.yaml", "--json")
    assert ran.returncode == 0
    (answers,) = Path("results").rglob("session.jsonl")
    pairs = len(stimuli) * (len(stimuli) - 1) // 2
    asked = [trial for trial in read_session(answers).trials if trial.kind == "all_pairs"]
    assert len(asked) == 10 * pairs
    again = cyclopean("compare", *words, "--regions", PLATE, "--rig", rig, "--experiment", "study", expect=2)
    assert "experiments/study.yaml: it is there already" in again.stderr
