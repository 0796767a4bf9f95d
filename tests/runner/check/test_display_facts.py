"""What `check` says in a line of a rig: what is nominal, assumed or unknown, and nothing that is known."""

from __future__ import annotations

import json
from typing import Any

import pytest

Study = Any  # tests/conftest.py
PANEL = "panel: {resolution_px: [640, 480], pixel_pitch_mm: 0.3}"


def _not_measured(study: Study, display: str, mode: str, more: str = "") -> list[str]:
    text = f"schema_version: 1\ndisplay: {display}\nmode: {mode}\ndistance_mm: 700\n{more}"
    (study.folder / "rig.yaml").write_text(text)
    (facts,) = json.loads(study.cyclopean("check", study.folder / "rig.yaml", "--no-screen", "--json").stdout)
    return [str(words) for words in facts["not_measured"]]


@pytest.mark.parametrize("kind", ["srgb", "bt1886"])
def test_what_is_assumed_of_a_nominal_display(kind: str, study: Study) -> None:
    said = _not_measured(study, f"{{nominal: {kind}, white_cd_m2: 100, {PANEL}}}", "anaglyph-red-cyan")
    assert said[0].startswith("colours (nominal ")
    assert said[1:] == [
        "black (0.1 cd/m² assumed)",
        "filters of the glasses (round figures)",
        "crosstalk",
        "evenness of the panel",
        "the room's light",
        "settings of the monitor",
        "onsets",
    ]


def test_what_is_stated_or_measured_is_left_out(study: Study) -> None:
    filters = "{left_filter: [0.9, 0.1, 0.0], right_filter: [0.0, 0.8, 0.8]}"
    stated = f"mode_options: {filters}\nambient_XYZ_cd_m2: [0.1, 0.1, 0.1]\nmonitor_settings: {{preset: sRGB}}\n"
    nominal = f"{{nominal: srgb, white_cd_m2: 100, black_cd_m2: 0.2, {PANEL}}}"
    assert _not_measured(study, nominal, "anaglyph-red-cyan", stated) == [
        "colours (nominal sRGB)",
        "crosstalk",
        "evenness of the panel",
        "onsets",
    ]
    measured = _not_measured(study, "display.yaml", "side-by-side", "ambient_XYZ_cd_m2: [0.1, 0.1, 0.1]\n")
    assert "colours" not in " ".join(measured)
    assert "gamma table of the measurement" in measured
    assert "crosstalk" not in _not_measured(study, nominal, "flat")


@pytest.mark.parametrize(("swap", "eye"), [("false", "right"), ("true", "left")])
def test_a_filter_that_is_stated_alone_leaves_the_other_assumed(study: Study, swap: str, eye: str) -> None:
    options = f"mode_options: {{left_filter: [0.9, 0.1, 0.0], swap_eyes: {swap}}}\n"
    said = _not_measured(study, f"{{nominal: srgb, white_cd_m2: 100, {PANEL}}}", "anaglyph-red-cyan", options)
    assert f"filter before the {eye} eye (round figures)" in said
    assert "filters of the glasses (round figures)" not in said


def test_doctor_says_the_same_of_a_rig(study: Study) -> None:
    nominal = f"{{nominal: srgb, white_cd_m2: 100, {PANEL}}}"
    said = _not_measured(study, nominal, "anaglyph-red-cyan")
    printed = study.cyclopean("doctor", "--rig", study.folder / "rig.yaml").stdout
    assert f"not measured: {', '.join(said)}\n" in printed
    asked = study.cyclopean("doctor", "--rig", study.folder / "rig.yaml", "--json").stdout
    assert json.loads(asked)["rig_not_measured"] == said


# `check` names the folder that results are copied to, and warns where it is not.


def test_a_folder_that_is_not_there_is_a_warning(study: Study) -> None:
    study.edit("rig.yaml", "distance_mm: 700", "distance_mm: 700\nresults_mirror: backup")
    for there in (False, True):
        if there:
            (study.folder / "backup").mkdir()
        (facts,) = json.loads(study.cyclopean("check", study.folder / "rig.yaml", "--json").stdout)
        assert facts["results_mirror"] == str(study.folder / "backup")
        warned = [finding for finding in facts["warnings"] if "results_mirror" in finding["message"]]
        assert len(warned) == (not there)
