"""The verdict of a verification, against colour-science, colour by colour."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from devices.compensation import Correction
from devices.display import DisplayModel, EyeModels, ToneCurve, read_display
from devices.errors import MeasuringError
from devices.readings import (
    KeptReading,
    Patch,
    PatchSet,
    PatchTurn,
    Reading,
    ReadingRun,
    SimulatedDisplay,
    asked_of,
    read_session,
)
from runner.cli.main import group
from runner.measuring.verification import doubt_on_light, judge, patches_of
from runner.presenter import find_mode
from tests.choice import nightly
from tests.runner.measuring.displays import DISPLAY as SMALL

PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
CURVE = ToneCurve(0.97, 0.02, 1.8)
MODEL = DisplayModel(np.array([0.02, 0.02, 0.03]), PRIMARIES, (CURVE, CURVE, CURVE))
DISPLAY = SimulatedDisplay(EyeModels(MODEL, MODEL))


def _session(read: np.ndarray, patches: PatchSet, leave_out: int = -1) -> ReadingRun:
    order = tuple(PatchTurn(place, patch.name, patch) for place, patch in enumerate(patches.patches))
    kept = {
        place: KeptReading(place, 0.0, Reading((float(X), float(Y), float(Z))))
        for place, (X, Y, Z) in enumerate(read)
        if place != leave_out
    }
    return ReadingRun(Path("m.jsonl"), {}, order, kept, {})


def test_differences_are_those_of_colour_science() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour
    asked = asked_of(MODEL)
    wanted = np.array([one.XYZ_cd_m2 for one in asked])
    read = wanted * np.random.default_rng(3).normal(1.0, 0.03, wanted.shape)
    verdict = judge(_session(read, patches_of(asked, MODEL)), asked, DISPLAY, "both")
    white = MODEL.xyz([1.0, 1.0, 1.0])
    xy = white[:2] / white.sum()
    asked_lab, read_lab = (colour.XYZ_to_Lab(XYZ / white[1], xy) for XYZ in (wanted, read))
    expected = np.asarray(colour.delta_E(asked_lab, read_lab, method="CIE 2000"))
    np.testing.assert_allclose([one.delta_e_00 for one in verdict.colours], expected, atol=1e-6)
    assert verdict.achieved.mean == pytest.approx(expected.mean(), abs=1e-6)
    assert verdict.achieved.p95 == pytest.approx(np.percentile(expected, 95), abs=1e-6)
    assert verdict.achieved.largest == pytest.approx(expected.max(), abs=1e-6)
    assert verdict.missing == ()
    assert [one.name for one in verdict.colours if one.desaturated] == ["cyan"]


def test_a_colour_that_was_not_read_is_missing_from_the_numbers() -> None:
    asked = asked_of(MODEL)
    wanted = np.array([one.XYZ_cd_m2 for one in asked])
    verdict = judge(_session(wanted, patches_of(asked, MODEL), leave_out=4), asked, DISPLAY, "both")
    assert verdict.missing == (asked[4].name,)
    assert len(verdict.colours) == 23
    assert verdict.achieved.largest < 1e-9


@pytest.mark.parametrize("room", [0.05, *nightly(1.0)])
def test_a_verification_in_the_dark_by_a_file_of_a_lit_room_is_doubted(room: float) -> None:
    lit = MODEL.in_room([room] * 3)
    patches = PatchSet("m", (Patch("black", (0.0, 0.0, 0.0)), Patch("white", (1.0, 1.0, 1.0))))
    codes = np.array([[0.0] * 3, [1.0] * 3])
    dark, right = (_session(1.02 * model.xyz(codes), patches) for model in (MODEL, lit))
    assert "verify with the room lit" in doubt_on_light(dark, lit)
    assert doubt_on_light(right, lit) == ""
    assert doubt_on_light(dark, MODEL) == ""
    dimmer = _session(0.9 * MODEL.xyz(codes), patches)
    assert doubt_on_light(dimmer, MODEL) == ""
    assert doubt_on_light(dark, MODEL.in_room([1e-4] * 3)) == ""
    assert doubt_on_light(_session(0.97 * lit.xyz(codes), patches), lit) == ""
    assert doubt_on_light(_session(MODEL.xyz(codes), patches, leave_out=0), lit) == ""


def test_nothing_read_is_no_verdict() -> None:
    asked = asked_of(MODEL)
    other = PatchSet("s", (Patch("black", (0.0, 0.0, 0.0)),))
    with pytest.raises(MeasuringError, match="none of the colours"):
        judge(_session(np.array([[1.0, 1.0, 1.0]]), other), asked, DISPLAY, "both")


LEAKING = (
    SMALL
    + """\
    crosstalk:
      left: [[0.05, 0, 0], [0, 0.05, 0], [0, 0, 0.05]]
      right: [[0.08, 0, 0], [0, 0.08, 0], [0, 0, 0.08]]
    gain_map: {luminance: [[20, 25, 20], [22, 27, 24], [21, 24, 16]], positions: cells, normalise: minimum}
  side-by-side: {same_as: row-interleaved}
  frame-sequential: {same_as: row-interleaved}
"""
)


@pytest.mark.usefixtures("egl")
@pytest.mark.parametrize(
    ("mode", "eye"),
    [
        ("row-interleaved", "both"),
        ("frame-sequential", "right"),
        *nightly(("row-interleaved", "left"), ("side-by-side", "left")),
    ],
)
def test_colours_go_through_what_a_session_does(tmp_path: Path, mode: str, eye: str) -> None:
    """Crosstalk and unevenness are in the codes shown, so that what is left is the rounding of codes.

    The codes are those of the float64 twin: `Compensation.apply`, then the model.
    """
    file, log = tmp_path / "display.yaml", tmp_path / "v.jsonl"
    file.write_text(LEAKING)
    arguments = ["display", "verify", "--display", str(file), "--mode", mode, "--eye", eye, "--instrument", "simulated",
                 "--instrument-option", "noise=0", "--backend", "egl", "--settle", "0", "-o", str(log),
                 "--limit", "0.5", "--json"]  # fmt: skip
    result = CliRunner().invoke(group, arguments)
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["passed"] is True
    for one in found["colours"]:
        np.testing.assert_allclose(one["measured_XYZ_cd_m2"], one["model_XYZ_cd_m2"], rtol=1e-9)
    display = read_display(file)
    models, stereo_mode = display.models(mode), find_mode(mode)
    correction = Correction(display.crosstalk(mode), display.gain_map(mode))
    twin = stereo_mode.compensation(models, (64, 48), correction)
    area = stereo_mode.areas((64, 48))[eye == "right"]
    width, height = area.view_px
    row, column = height // 2, width // 2
    if area.weave is not None:  # the nearest of the eye's own rows
        row, column = (row if area.weave.mask(height, width)[row, column] else row - 1), column - 1
    model = models.right if eye == "right" else models.left
    session = read_session(log)
    plain = 0.0
    for kept in session.readings.values():
        patch = session.steps[kept.position].patch
        asked = session.header["asked_XYZ_cd_m2"].get(patch.name)
        assert kept.shown is not None
        if asked is None:
            continue
        own = np.tile(np.float32(asked), (height, width, 1))
        dark = np.tile(np.float32(model.xyz([0.0] * 3)), (height, width, 1))
        views = (own if eye != "right" else dark, own if eye != "left" else dark)
        sent = twin.apply(views)[0][1 if eye == "right" else 0]
        code = 255 * model.code(sent[row, column].astype(np.float64))
        np.testing.assert_allclose(255 * np.array(kept.shown.own), code, atol=0.51)
        plain = max(plain, float(np.abs(255 * np.array(patch.codes) - code).max()))
    assert plain > 5  # the model's own codes are others


def test_a_fault_that_the_display_file_does_not_tell_shows_beside_the_model(tmp_path: Path) -> None:
    (tmp_path / "display.yaml").write_text(LEAKING)
    arguments = ["display", "verify", "--display", str(tmp_path / "display.yaml"), "--mode", "row-interleaved",
                 "--instrument", "simulated", "--instrument-option", "crosstalk=0.1", "--backend", "egl",
                 "--settle", "0", "--limit", "1", "--json"]  # fmt: skip
    result = CliRunner().invoke(group, arguments)
    assert result.exit_code == 1
    found = json.loads(result.stdout.splitlines()[0])
    assert found["passed"] is False
    assert found["delta_e_00"]["mean"] > 1 > 0.5 > found["model_alone_delta_e_00"]["mean"]


def test_a_rig_and_a_mode_that_was_not_measured(tmp_path: Path) -> None:
    (tmp_path / "display.yaml").write_text(LEAKING)
    (tmp_path / "rig.yaml").write_text(
        "schema_version: 1\ndisplay: display.yaml\nmode: row-interleaved\ndistance_mm: 700\n"
    )
    shown = ["--instrument", "simulated", "--backend", "egl", "--settle", "0"]
    result = CliRunner().invoke(group, ["display", "verify", "--display", str(tmp_path / "rig.yaml"), *shown])
    assert result.exit_code == 0, result.output
    assert "by the model alone: mean" in result.output
    arguments = ["display", "verify", "--display", str(tmp_path / "display.yaml"), "--mode", "flat", *shown]
    assert "not characterised in the mode 'flat'" in str(CliRunner().invoke(group, arguments).exception)
