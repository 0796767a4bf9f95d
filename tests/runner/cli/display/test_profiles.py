"""`display fit` of an ICC profile, and `display convert` to one and to a `.cube`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from devices.characterise import table_c1_codes, thesis_display
from devices.characterise.display_yaml import model_lines
from devices.display import read_display
from devices.measurements import Measurements
from devices.measurements.ti3 import format_ti3
from devices.profiles import read_profile
from runner.cli.main import group
from tests.devices.profiles.profile_bytes import curv, matrix_tags, para, profile, text, vcgt
from tests.devices.profiles.random_displays import plvc_display

PANEL = ["--panel", "1920x1080,0.2768"]
DISPLAY = Path("configs/displays/asus_vg248qe.yaml").resolve()


def _run(*arguments: str, code: int = 0) -> str:
    result = CliRunner().invoke(group, ["display", *arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        if code:
            return str(result.exception)
        raise result.exception
    assert result.exit_code == code, result.output
    return result.output


@pytest.fixture
def icc(tmp_path: Path) -> Path:
    path = tmp_path / "display.icc"
    path.write_bytes(profile(matrix_tags(para(2, 2.25, 0.999, 0.0, 0.002), lumi=None)))
    return path


def test_a_display_file_becomes_a_profile_and_the_profile_the_display(tmp_path: Path) -> None:
    out, back = tmp_path / "asus.icc", tmp_path / "back.yaml"
    words = _run("convert", str(DISPLAY), "--mode", "quad-buffered", "--to", "icc", "-o", str(out))
    assert "matrix and curves; against the model ΔE00 0.00" in words
    words = _run("fit", str(out), "--mode", "flat", "-o", str(back), *PANEL)
    assert "as they are (gog)" in words
    assert "nothing in the profile says how well" in words
    codes = np.random.default_rng(1).random((50, 3))
    model, again = read_display(DISPLAY).models("quad-buffered").left, read_display(back).models("flat").left
    np.testing.assert_allclose(again.xyz(codes), model.xyz(codes), atol=5e-3)


def test_a_profile_without_luminance_asks_for_it(icc: Path, tmp_path: Path) -> None:
    assert "--white-cd-m2" in _run("fit", str(icc), code=1)
    told = json.loads(_run("fit", str(icc), "--white-cd-m2", "80", "--json"))
    assert told["both"]["model"] == "gog"
    assert told["both"]["white_XYZ_cd_m2"][1] == pytest.approx(80, rel=1e-3)
    assert _run("fit", str(icc), "--white-cd-m2", "80", "-o", str(tmp_path / "d.yaml"), code=2)


def test_measurements_in_a_profile_are_fitted(tmp_path: Path) -> None:
    codes = table_c1_codes()
    words = format_ti3(Measurements(codes, thesis_display().xyz(codes)))
    path = tmp_path / "display.icm"
    path.write_bytes(profile(matrix_tags(curv()) | {"targ": text(words)}, version=2))
    told = json.loads(_run("fit", str(path), "--json", "--brief"))
    assert told["both"]["chosen"] == "gog"
    assert "readings inside the profile were read" in " ".join(told["both"]["said"])


def test_a_matrix_is_fitted_where_a_model_is_named(icc: Path) -> None:
    told = json.loads(_run("fit", str(icc), "--white-cd-m2", "80", "--model", "gamma", "--json", "--brief"))
    assert told["both"]["chosen"] == "gamma"


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
    result = CliRunner().invoke(group, ["display", "convert", *arguments])
    assert result.exit_code != 0
    assert words in result.output + str(result.exception)


def test_the_gamma_table_goes_with_the_model_both_ways(tmp_path: Path) -> None:
    values = [round(65535 * (i / 255) ** 1.1) for i in range(256)]
    icc, made, again = tmp_path / "display.icc", tmp_path / "made.yaml", tmp_path / "made.icc"
    icc.write_bytes(profile(matrix_tags(para(0, 2.25)) | {"vcgt": vcgt(1, 2, values)}))
    assert "'vcgt'" in _run("fit", str(icc), "--mode", "flat", "-o", str(made), *PANEL)
    held = read_display(made).gamma_table("flat", "left")
    assert held.departure_codes > 5
    _run("convert", str(made), "--to", "icc", "-o", str(again))
    back = read_profile(again).gamma_table
    assert back is not None
    assert back.same_as(held)


def test_a_profile_that_is_far_off_is_noted(tmp_path: Path) -> None:
    plvc = plvc_display(0.15)
    lines = ["schema_version: 1", "panel: {resolution_px: [100, 100], pixel_pitch_mm: 0.25}", "modes:", "  flat:"]
    lines += [f"    {line}" for line in model_lines(plvc, "made up")]
    path = tmp_path / "plvc.yaml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert "take more --points" in _run("convert", str(path), "--to", "icc", "--points", "3")
    words = _run("convert", str(path), "--to", "icc")
    assert "Note" not in words
    assert "tables of 33 points" in words or "tables of 25 points" in words


@pytest.mark.parametrize(("target", "more"), [("icc", []), ("cube", ["--points", "9"])])
def test_the_room_s_light_goes_into_no_file_for_other_programs(tmp_path: Path, target: str, more: list[str]) -> None:
    made: dict[str, bytes] = {}
    for name, room in (("dark", ""), ("lit", "ambient_XYZ_cd_m2: [0.5, 0.6, 0.4]\n")):
        path, out = tmp_path / name / "d.yaml", tmp_path / name / f"d.{target}"
        path.parent.mkdir()
        path.write_text(DISPLAY.read_text(encoding="utf-8") + room, encoding="utf-8")
        words = _run("convert", str(path), "--mode", "side-by-side", "--to", target, "-o", str(out), *more)
        assert ("Note: it is of the display alone: the room's light, 0.6 cd/m², is left out." in words) == bool(room)
        made[name] = out.read_bytes()
    assert made["lit"] == made["dark"]
