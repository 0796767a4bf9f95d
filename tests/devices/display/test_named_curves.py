"""Curves by name, against colour-science, and in a display file."""

from __future__ import annotations

from pathlib import Path

import colour
import numpy as np
import pytest

from devices.characterise.display_yaml import model_lines
from devices.display import DisplayModel, SrgbCurve, ToneCurve, bt1886_curve, read_display
from devices.errors import DeviceError
from documents import InputError

CODES = np.linspace(0.0, 1.0, 4096)
DISPLAY = """\
schema_version: 1
panel: {{resolution_px: [1920, 1080], pixel_pitch_mm: 0.25}}
modes:
  flat:
    black_XYZ_cd_m2: [0.19, 0.2, 0.3]
    primaries_XYZ_cd_m2: {{red: [40, 20, 2], green: [35, 70, 11], blue: [18, 7, 95]}}
    curve: {curve}
    source: the panel's standard
"""


def test_srgb_is_colour_science_s() -> None:
    curve = SrgbCurve()
    np.testing.assert_allclose(curve.linear(CODES), colour.models.eotf_sRGB(CODES), rtol=0, atol=1e-12)
    light = np.concatenate([[0.0], np.geomspace(1e-9, 1.0, 4096)])
    np.testing.assert_allclose(curve.code(light), colour.models.eotf_inverse_sRGB(light), rtol=0, atol=1e-12)
    np.testing.assert_allclose(curve.linear(curve.code(light)), light, rtol=0, atol=1e-14)
    np.testing.assert_allclose(curve.code([-1.0, 2.0]), [0.0, 1.0], rtol=0, atol=1e-15)
    assert curve.unclipped_code(1.2) > 1.0
    assert (float(curve.linear(0)), float(curve.linear(1)), curve.lift) == (0.0, 1.0, 0.0)


@pytest.mark.parametrize(("white", "black"), [(100.0, 0.0), (100.0, 0.1), (350.0, 0.7), (48.0, 2.0)])
def test_bt1886_is_colour_science_s(white: float, black: float) -> None:
    curve = bt1886_curve(white, black)
    shown = black + (white - black) * curve.linear(CODES)
    np.testing.assert_allclose(shown, colour.models.eotf_BT1886(CODES, black, white), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(curve.code(curve.linear(CODES[1:])), CODES[1:], rtol=0, atol=1e-12)
    np.testing.assert_allclose(curve.linear([0.0, 1.0]), [0.0, 1.0], rtol=0, atol=1e-15)


@pytest.mark.parametrize(("white", "black"), [(100.0, 100.0), (100.0, -0.1), (np.inf, 0.1), (np.nan, 0.1)])
def test_bt1886_needs_a_white_above_its_black(white: float, black: float) -> None:
    with pytest.raises(DeviceError, match=r"BT.1886 needs a black from 0"):
        bt1886_curve(white, black)


def _read(folder: Path, curve: str) -> DisplayModel:
    file = folder / "display.yaml"
    file.write_text(DISPLAY.format(curve=curve), encoding="utf-8")
    return read_display(file).models("flat").left


def test_a_display_file_names_srgb(tmp_path: Path) -> None:
    model = _read(tmp_path, "{kind: srgb}")
    assert model.curves == (SrgbCurve(),) * 3
    assert model.normalised is model


def test_a_display_file_names_bt1886_with_the_panel_s_own_white_and_black(tmp_path: Path) -> None:
    model = _read(tmp_path, "{kind: bt1886}")
    greys = np.repeat(CODES[:, np.newaxis], 3, axis=1)
    expected = colour.models.eotf_BT1886(CODES, 0.2, 97.2)
    np.testing.assert_allclose(model.xyz(greys)[:, 1], expected, rtol=1e-12)
    # Through glasses, light is less than what the panel's own curve goes by.
    assert _read(tmp_path, "{kind: bt1886, white_cd_m2: 300, black_cd_m2: 0.3}").curves[0] == bt1886_curve(300.0, 0.3)
    assert _read(tmp_path, "{kind: bt1886, black_cd_m2: 0}").curves[0].code(0.3) == ToneCurve(gamma=2.4).code(0.3)


@pytest.mark.parametrize(
    ("curve", "says"),
    [
        ("{kind: bt1886, black_cd_m2: 200}", "white above it, not 200 and 97.2"),
        ("{kind: bt1886, black_cd_m2: -1}", "black_cd_m2"),
        ("{kind: srgb, gamma: 2.2}", "gamma"),
        ("{kind: bt709}", "srgb"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, curve: str, says: str) -> None:
    with pytest.raises(InputError, match=says) as refused:
        _read(tmp_path, curve)
    assert all(finding.line for finding in refused.value.findings)


@pytest.mark.parametrize("curve", ["{kind: srgb}", "{kind: bt1886}"])
def test_a_model_of_named_curves_can_be_written_and_read_again(tmp_path: Path, curve: str) -> None:
    model = _read(tmp_path, curve)
    text = DISPLAY.format(curve="{kind: srgb}").split("    black")[0]
    file = tmp_path / "again.yaml"
    file.write_text(text + "".join(f"    {line}\n" for line in model_lines(model, "again")), encoding="utf-8")
    codes = np.random.default_rng(1).random((100, 3))
    np.testing.assert_allclose(read_display(file).models("flat").left.xyz(codes), model.xyz(codes), rtol=1e-8)
