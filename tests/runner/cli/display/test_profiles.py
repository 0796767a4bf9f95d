"""`display fit` of an ICC profile, and `display convert` to one and to a `.cube`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from devices.display import read_display
from devices.errors import DeviceError
from devices.profiles import read_profile
from tests.devices.profiles.profile_bytes import matrix_tags, para, profile
from tests.runner.cli.display.test_fit import _run

PANEL = ["--panel", "1920x1080,0.2768"]
DISPLAY = Path("configs/displays/asus_vg248qe.yaml").resolve()


@pytest.fixture
def icc(tmp_path: Path) -> Path:
    path = tmp_path / "display.icc"
    path.write_bytes(profile(matrix_tags(para(2, 2.25, 0.999, 0.0, 0.002), lumi=None)))
    return path


def test_a_display_file_becomes_a_profile_and_the_profile_the_display(tmp_path: Path) -> None:
    out, back = tmp_path / "asus.icc", tmp_path / "back.yaml"
    words = _run("convert", str(DISPLAY), "--mode", "quad-buffered", "--to", "icc", "-o", str(out))
    assert "matrix and curves; " in words
    words = _run("fit", str(out), "--mode", "flat", "-o", str(back), *PANEL)
    assert "as they are (gog)" in words
    assert "nothing in the profile says how well" in words
    codes = np.random.default_rng(1).random((50, 3))
    model, again = read_display(DISPLAY).models("quad-buffered").left, read_display(back).models("flat").left
    np.testing.assert_allclose(again.xyz(codes), model.xyz(codes), atol=5e-3)


def test_a_profile_without_luminance_asks_for_it(icc: Path, tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="--white-cd-m2"):
        _run("fit", str(icc))
    told = json.loads(_run("fit", str(icc), "--white-cd-m2", "80", "--json"))
    assert told["both"]["model"] == "gog"
    assert told["both"]["white_XYZ_cd_m2"][1] == pytest.approx(80, rel=1e-3)
    with pytest.raises(DeviceError, match="do not name a mode"):
        _run("fit", str(icc), "--white-cd-m2", "80", "-o", str(tmp_path / "d.yaml"))


def test_tables_and_cubes_are_written_on_request(tmp_path: Path) -> None:
    here = tmp_path / "asus.yaml"
    here.write_bytes(DISPLAY.read_bytes())
    asked = ["convert", str(here), "--mode", "quad-buffered"]
    words = _run(*asked, "--to", "icc", "--profile-kind", "table", "--points", "9")
    assert "tables of 9 points a side" in words
    assert read_profile(tmp_path / "asus.icc").table_name == "A2B1"
    assert "17 points a side, from sRGB" in _run(*asked, "--to", "cube", "--points", "17")
    assert "LUT_3D_SIZE 17" in (tmp_path / "asus.cube").read_text(encoding="utf-8")
    assert "4096 entries, from light" in _run(*asked, "--to", "cube", "--cube-input", "light")
    assert "LUT_1D_SIZE 4096" in (tmp_path / "asus.cube").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--to", "icc"], "name the display file"),
        ([str(DISPLAY), "--to", "icc"], "several modes"),
        ([str(DISPLAY), "--display", str(DISPLAY), "--to", "icc"], "once"),
        (["codes.csv", "--to", "xyz"], "--display"),
        (["codes.csv", "--display", str(DISPLAY), "--to", "xyz", "-o", "x.csv"], "standard output"),
    ],
)
def test_what_is_missing_is_asked_for(arguments: list[str], words: str) -> None:
    with pytest.raises(DeviceError, match=words):
        _run("convert", *arguments)


def test_the_room_s_light_goes_into_no_file_for_other_programs(tmp_path: Path) -> None:
    """In a ``.cube``: tests/devices/profiles/test_display_model.py."""
    made: dict[str, bytes] = {}
    for name, room in (("dark", ""), ("lit", "ambient_XYZ_cd_m2: [0.5, 0.6, 0.4]\n")):
        path, out = tmp_path / name / "d.yaml", tmp_path / name / "d.icc"
        path.parent.mkdir()
        path.write_text(DISPLAY.read_text(encoding="utf-8") + room, encoding="utf-8")
        words = _run("convert", str(path), "--mode", "side-by-side", "--to", "icc", "-o", str(out))
        assert ("the room's light, 0.6 cd/m²" in words) == bool(room)
        made[name] = out.read_bytes()
    assert made["lit"] == made["dark"]
