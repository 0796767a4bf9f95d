"""Crosstalk and gain map of a display file's modes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from devices.display import read_display
from devices.errors import DeviceError
from documents import InputError

ROOT = Path(__file__).parents[2]
HEAD = "schema_version: 1\npanel: {resolution_px: [640, 480], pixel_pitch_mm: 0.3}\nmodes:\n  flat:\n"
MODEL = """\
    black_XYZ_cd_m2: [0, 0, 0]
    primaries_XYZ_cd_m2: {red: [4, 2, 0], green: [3, 7, 1], blue: [2, 1, 9]}
    curve: {kind: gamma, red: {gamma: 2}, green: {gamma: 2}, blue: {gamma: 2}}
"""
CROSSTALK = """\
    crosstalk:
      left: [[0.03, 0, 0], [0, 0.03, 0], [0, 0, 0.05]]
      right: [[0.02, 0.01, 0], [0, 0.04, 0], [0, 0, 0.06]]
      source: measured through the glasses
"""
GAIN_MAP = "    gain_map: {luminance: [[1, 2], [3, 4]], positions: cells, normalise: centre}\n"


def _file(tmp_path: Path, *parts: str) -> Path:
    path = tmp_path / "d.yaml"
    path.write_text(HEAD + "".join(parts))
    return path


def _indented(model: str) -> str:
    return "".join(f"  {line}\n" for line in model.splitlines())


PER_EYE = f"    left:\n{_indented(MODEL)}    right:\n{_indented(MODEL)}"


@pytest.mark.parametrize("model", [MODEL, PER_EYE], ids=["both eyes", "per eye"])
def test_a_mode_holds_crosstalk_and_a_gain_map(tmp_path: Path, model: str) -> None:
    display = read_display(_file(tmp_path, model, CROSSTALK, GAIN_MAP))
    crosstalk, gain_map = display.crosstalk("flat"), display.gain_map("flat")
    assert crosstalk is not None
    assert np.array_equal(crosstalk.left, np.diag([0.03, 0.03, 0.05]))
    assert crosstalk.right[0, 1] == 0.01
    assert gain_map is not None
    assert gain_map.resolution_px == (640, 480)
    assert (gain_map.positions, gain_map.normalise) == ("cells", "centre")
    assert gain_map.gain(320, 240) == pytest.approx(1.0)
    assert gain_map.gain(0, 0) == pytest.approx(1 / 2.5)


def test_a_leak_that_takes_light_is_held(tmp_path: Path) -> None:
    display = read_display(_file(tmp_path, MODEL, CROSSTALK.replace("0.03", "-0.03")))
    crosstalk = display.crosstalk("flat")
    assert crosstalk is not None
    assert crosstalk.left[0, 0] == -0.03


def test_same_as_carries_both_along(tmp_path: Path) -> None:
    display = read_display(_file(tmp_path, MODEL, CROSSTALK, GAIN_MAP, "  side-by-side: {same_as: flat}\n"))
    crosstalk, gain_map = display.crosstalk("side-by-side"), display.gain_map("side-by-side")
    assert crosstalk is not None
    assert gain_map is not None
    assert crosstalk.right[0, 1] == 0.01
    assert np.array_equal(gain_map.luminance, [[1, 2], [3, 4]])


def test_a_mode_without_them_has_none() -> None:
    display = read_display(ROOT / "configs/displays/asus_vg248qe.yaml")
    assert display.crosstalk("side-by-side") is None
    assert display.gain_map("side-by-side") is None
    for asked in (display.crosstalk, display.gain_map):
        with pytest.raises(DeviceError, match=r"not characterised .* 'anaglyph'"):
            asked("anaglyph")


SAME = "    crosstalk: {left: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], right: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}\n"


@pytest.mark.parametrize(
    ("more", "place", "message"),
    [
        (CROSSTALK.replace("[[0.03", "[[0.03, 1"), ":9:14: ", "crosstalk.left.1"),
        (CROSSTALK.replace("[[0.03", "[[.nan"), ":9:15: ", "finite number"),
        (CROSSTALK.replace("      right", "      wrong"), ":10:7: ", "unknown key 'modes.flat.crosstalk.wrong'"),
        (CROSSTALK.replace("0, 0.03, 0]", "0, -1.4, 0]"), ":8:5: ", "loses"),
        (CROSSTALK.replace("0, 0.04, 0]", "0, 1.4, 0]"), ":8:5: ", "more than all of it"),
        (SAME, ":8:5", "cannot be undone"),
        (GAIN_MAP.replace("[3, 4]", "[3]"), ":8:5: ", "hold 2, 1 readings"),
        (GAIN_MAP.replace("[3, 4]", "[3, 0]"), ":8:40: ", "a number above 0"),
        (GAIN_MAP.replace("cells", "cell"), ":8:56: ", "did you mean 'cells'?"),
        (GAIN_MAP.replace(", normalise: centre", ""), ":8:15: ", "normalise' is missing"),
        ("    gain_map: {luminance: [[1, 2]], positions: corners, normalise: centre}\n", ":8:5", "at least 2 × 2"),
        ("    gain_map: {luminance: [], positions: cells, normalise: centre}\n", ":8:27: ", "at least 1"),
    ],
)
def test_faults_are_placed(tmp_path: Path, more: str, place: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        read_display(_file(tmp_path, MODEL, more))
    assert message in str(caught.value)
    assert f"d.yaml{place}" in str(caught.value)


def test_an_eye_has_no_gain_map_of_its_own(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"d.yaml:8:7: unknown key"):
        read_display(_file(tmp_path, PER_EYE.replace("curve:", "gain_map: 1\n      curve:", 1)))


def test_a_fault_is_told_once_though_two_modes_share_it(tmp_path: Path) -> None:
    bad = CROSSTALK.replace("0, 0.04, 0]", "0, 1.4, 0]")
    with pytest.raises(InputError) as caught:
        read_display(_file(tmp_path, MODEL, bad, "  side-by-side: {same_as: flat}\n"))
    assert len(caught.value.findings) == 1
