"""Modes that were characterised through one lens so far: kept, told, and not to be used."""

from __future__ import annotations

from pathlib import Path

import pytest

from devices.display import read_display
from devices.errors import DeviceError
from runner.check import CheckOptions, CheckReport
from runner.check.files import check_display

HEAD = "schema_version: 1\npanel: {resolution_px: [640, 480], pixel_pitch_mm: 0.3}\nmodes:\n"
MODEL = """\
{
      black_XYZ_cd_m2: [0, 0, 0], primaries_XYZ_cd_m2: {red: [4, 2, 0], green: [3, 7, 1], blue: [2, 1, 9]},
      curve: {kind: gamma, red: {gamma: 2}, green: {gamma: 2}, blue: {gamma: 2}}}
"""


def _file(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "display.yaml"
    path.write_text(HEAD + "\n".join(lines) + "\n")
    return path


def test_a_mode_of_one_eye_is_lacking_and_refused_with_what_to_do(tmp_path: Path) -> None:
    path = _file(tmp_path, "  quad-buffered:", f"    right: {MODEL}", "  side-by-side: {same_as: quad-buffered}")
    display = read_display(path)
    assert display.modes == {}
    assert display.lacking == {"quad-buffered": ("left",), "side-by-side": ("left",)}
    with pytest.raises(DeviceError, match=r"of the left eye yet.*--eye left"):
        display.models("quad-buffered")
    with pytest.raises(DeviceError, match="left eye"):
        display.crosstalk("quad-buffered")


def test_check_warns_of_it_and_of_none_other(tmp_path: Path) -> None:
    checked = CheckReport(_file(tmp_path, "  flat:", f"    left: {MODEL}", f"    right: {MODEL}"))
    check_display(checked, CheckOptions())
    assert not checked.warnings
    checked = CheckReport(_file(tmp_path, "  flat:", f"    left: {MODEL}"))
    check_display(checked, CheckOptions())
    (warning,) = checked.warnings
    assert "'flat' has no characterisation of the right eye" in warning.message


def test_the_eye_that_is_there_is_tried_all_the_same(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="primaries are so nearly alike"):
        read_display(_file(tmp_path, "  flat:", f"    left: {MODEL.replace('[3, 7, 1]', '[4, 2, 0]')}"))
