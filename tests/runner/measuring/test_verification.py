"""The verdict of a verification, against colour-science, colour by colour."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from devices.display import DisplayModel
from devices.display_file import EyeModels
from devices.instruments import Reading
from devices.instruments.simulated import SimulatedDisplay
from devices.patches import Patch, PatchSet, Step
from devices.patches.colorchecker import asked_of
from devices.tone_curve import ToneCurve
from runner.measuring.errors import MeasuringError
from runner.measuring.log import Kept, Session
from runner.measuring.verification import judge, patches_of

PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
CURVE = ToneCurve(0.97, 0.02, 1.8)
MODEL = DisplayModel(np.array([0.02, 0.02, 0.03]), PRIMARIES, (CURVE, CURVE, CURVE))
DISPLAY = SimulatedDisplay(EyeModels(MODEL, MODEL))


def _session(read: np.ndarray, patches: PatchSet, leave_out: int = -1) -> Session:
    order = tuple(Step(place, patch.name, patch) for place, patch in enumerate(patches.patches))
    kept = {
        place: Kept(place, 0.0, Reading((float(X), float(Y), float(Z))))
        for place, (X, Y, Z) in enumerate(read)
        if place != leave_out
    }
    return Session(Path("m.jsonl"), {}, order, kept, {})


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


def test_nothing_read_is_no_verdict() -> None:
    asked = asked_of(MODEL)
    other = PatchSet("s", (Patch("black", (0.0, 0.0, 0.0)),))
    with pytest.raises(MeasuringError, match="none of the colours"):
        judge(_session(np.array([[1.0, 1.0, 1.0]]), other), asked, DISPLAY, "both")
