"""Pairs are compared eye by eye, and in depth; and become an experiment."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from analysis.records import read_session
from stimuli.exr import read_exr
from tests.runner.comparing.scenes import PLATE, RIG, ROOT, Cyclopean, compared, said, spots, written


def test_depth_is_compared(tmp_path: Path, cyclopean: Cyclopean) -> None:
    photo = written(tmp_path / "a.exr", spots(), spots(1.0))
    same, deeper = (
        written(tmp_path / f"{name}.exr", spots(0.3), spots(0.3 + d)) for name, d in (("b", 1.0), ("c", 3.0))
    )
    found = compared(cyclopean, photo, same, "--regions", PLATE)
    assert found["decision"] == "validated"
    assert list(found["eyes"]) == ["left", "right"]
    found = compared(cyclopean, photo, deeper, "--regions", PLATE, expect=1)
    assert found["disparity"]["difference_px"] == pytest.approx([2.0, 0.0], abs=0.05)
    assert [line for line in said(found, "fails") if "disparity" not in line] == []
    assert any(line.startswith("both eyes: disparity across differs by 2.00") for line in said(found, "fails"))
    shifts = [found["eyes"][eye]["registration"]["shift_px"][0] for eye in ("left", "right")]
    assert shifts == pytest.approx([0.3, 2.3], abs=0.02)


@pytest.mark.parametrize("stereo", [True, False])
def test_an_experiment_follows(
    tmp_path: Path, cyclopean: Cyclopean, monkeypatch: pytest.MonkeyPatch, stereo: bool
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "configs").mkdir()
    for name in ("rigs", "displays"):
        (tmp_path / "configs" / name).symlink_to(ROOT / "configs" / name)
    rig = Path("configs/rigs") / RIG.name
    right = spots(1.0) if stereo else None
    words = (written(tmp_path / "a b.exr", spots(), right), written(tmp_path / "b.exr", spots(gain=1.02), right))
    found = compared(
        cyclopean, *words, "--regions", PLATE, "--rig", rig, "--experiment", "study", "--luminance", "mean_ratio"
    )
    assert found["written"]["experiment"][0] == "experiments/study.yaml"
    photo, rendering = (read_exr(Path(f"configs/stimuli/study/{name}.exr")) for name in ("photograph", "rendering"))
    assert photo.is_flat != stereo
    np.testing.assert_allclose(photo.left, spots(), rtol=1e-3)
    np.testing.assert_allclose(rendering.left, photo.left, rtol=2e-3)  # the factor was undone
    told = json.loads(cyclopean("check", "experiments/study.yaml", "--json").stdout)
    text = json.dumps(told)
    assert "rendering" in text
    stimuli = [
        f"{name}{view}" for name in ("photograph", "rendering") for view in (("-stereo", "-flat") if stereo else ("",))
    ]
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
