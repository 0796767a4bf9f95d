"""Tone curves and the table the shader reads.

Curves by name, against colour-science, and in a display file.

Tone curves as tables: they rise, are undone, and serve the presenter's table.
"""

from __future__ import annotations

from pathlib import Path

import colour
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from devices.display import (
    DisplayModel,
    SrgbCurve,
    TableCurve,
    ToneCurve,
    bt1886_curve,
    code_tables,
    read_display,
    table_codes,
)
from devices.display.model_spec import ModelSpec
from devices.errors import DeviceError
from documents import InputError
from documents.arrays import Floats

CURVES = st.builds(
    ToneCurve,
    gain=st.floats(0.5, 1.5),
    offset=st.floats(-0.1, 0.1),
    gamma=st.floats(1.0, 3.2),
    lift=st.floats(-0.01, 0.05),
)
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
FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(CURVES, st.floats(0, 1))
def test_code_undoes_linear_wherever_there_is_light(curve: ToneCurve, code: float) -> None:
    drive = curve.gain * code + curve.offset
    if drive > 1e-3:
        assert curve.code(curve.linear(code)) == pytest.approx(code, abs=1e-9)


@pytest.mark.parametrize("bad", [{"gain": 0}, {"gamma": -1}, {"gain": float("nan")}, {"gain": 0.1, "offset": -0.2}])
def test_curves_that_give_no_rising_light_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(DeviceError):
        ToneCurve(**bad)


def _grey(curve: ToneCurve | TableCurve, black_cd_m2: float = 0.0) -> DisplayModel:
    primaries = np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]])
    return DisplayModel(np.full(3, black_cd_m2), primaries, (curve, curve, curve))


@pytest.mark.parametrize("gamma", [1.6, 1.8132, 2.2, 2.4, 2.9])
@pytest.mark.parametrize("lift", [0.0, 0.02, -0.005])
@pytest.mark.parametrize("offset", [-0.03, 0.0, 0.0218])
def test_the_table_errs_by_less_than_a_thousandth_of_a_code(gamma: float, lift: float, offset: float) -> None:
    curve = ToneCurve(1.0, offset, gamma, lift)
    model = _grey(curve)
    light = np.concatenate([np.geomspace(1e-12, 1, 4_001), np.linspace(0, 1, 4_001)])
    xyz = np.repeat(light[:, None], 3, axis=1) @ model.primaries_XYZ_cd_m2.T
    error = np.abs(table_codes(model, xyz, code_tables(model)) - model.code(xyz)) * 255
    assert error.max() < 0.001


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
    file.write_text(
        text + "".join(f"    {line}\n" for line in ModelSpec.of(model, source="again").lines()), encoding="utf-8"
    )
    codes = np.random.default_rng(1).random((100, 3))
    np.testing.assert_allclose(read_display(file).models("flat").left.xyz(codes), model.xyz(codes), rtol=1e-8)


@st.composite
def tables(draw: st.DrawFn) -> TableCurve:
    entries = draw(st.integers(3, 30))
    steps = st.lists(st.floats(1e-3, 1), min_size=entries - 1, max_size=entries - 1)
    codes = np.cumsum([0.0, *draw(steps)])
    roots = np.cumsum([0.0, *draw(steps)])
    return TableCurve(tuple(codes / codes[-1]), tuple((roots / roots[-1]) ** 2))


@settings(max_examples=15)
@given(tables(), st.lists(st.floats(0, 1), min_size=1, max_size=9))
def test_code_undoes_linear_to_a_millionth(curve: TableCurve, codes: list[float]) -> None:
    np.testing.assert_allclose(curve.code(curve.linear(codes)), codes, atol=1e-6, rtol=0)


@settings(max_examples=15)
@given(tables(), st.lists(FINITE, min_size=2, max_size=9))
def test_it_never_falls_and_is_finite(curve: TableCurve, values: list[float]) -> None:
    ordered = np.sort(values)
    for found in (curve.linear(ordered), curve.code(ordered)):
        assert np.all((found >= 0) & (found <= 1))
        assert np.all(np.diff(found) >= -1e-12)


def _as_the_page_says(codes: tuple[float, ...], light: tuple[float, ...], at: Floats) -> Floats:
    """The formulae of decision 0010, "What exactly is a table between its entries?", one code at a time."""
    x, r = np.array(codes), np.sqrt(light)
    h = np.diff(x)
    rise = np.diff(r) / h

    def end(h0: float, h1: float, rise0: float, rise1: float) -> float:
        return max(((2 * h0 + h1) * rise0 - h0 * rise1) / (h0 + h1), 0.0)

    d = [end(h[0], h[1], rise[0], rise[1])]
    for k in range(1, len(h)):
        w1, w2 = 2 * h[k] + h[k - 1], h[k] + 2 * h[k - 1]
        d.append((w1 + w2) / (w1 / rise[k - 1] + w2 / rise[k]))
    d.append(end(h[-1], h[-2], rise[-1], rise[-2]))
    found = []
    for code in at:
        k = next((k for k in range(len(h)) if code <= x[k + 1]), len(h) - 1)
        t = (code - x[k]) / h[k]
        root = r[k] * (1 + 2 * t) * (1 - t) ** 2 + r[k + 1] * t**2 * (3 - 2 * t)
        found.append((root + h[k] * t * (1 - t) * (d[k] * (1 - t) - d[k + 1] * t)) ** 2)
    return np.array(found)


@settings(max_examples=15)
@given(tables(), st.lists(st.floats(0, 1), min_size=1, max_size=9))
def test_it_is_the_curve_that_the_page_defines(curve: TableCurve, codes: list[float]) -> None:
    at = np.array([*codes, *curve.codes, 0.5 * (curve.codes[0] + curve.codes[1])])
    np.testing.assert_allclose(curve.linear(at), _as_the_page_says(curve.codes, curve.light, at), rtol=0, atol=1e-11)
    scipy_s = PchipInterpolator(curve.codes, np.sqrt(curve.light))(at) ** 2
    np.testing.assert_allclose(curve.linear(at), scipy_s, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("codes", "light"),
    [
        ((0, 1), (0, 1)),
        ((0, 0.5, 1), (0, 1)),
        ((0, 0.5, 1), (0, 0, 1)),
        ((0, 0.5, 1), (0, 0.6, 0.5)),
        ((0, 0.5, 1), (0.1, 0.6, 1)),
        ((0, 0.5, 0.9), (0, 0.6, 1)),
        ((0, float("nan"), 1), (0, 0.6, 1)),
        ((0, 0.5, 1), (0, 1e-30, 1)),
    ],
)
def test_tables_that_do_not_rise_from_0_to_1_are_refused(codes: tuple[float, ...], light: tuple[float, ...]) -> None:
    with pytest.raises(DeviceError):
        TableCurve(codes, light)


@pytest.mark.parametrize("gamma", [1.6, 2.2, 2.9])
def test_the_presenters_table_is_made_of_it_within_a_hundredth_of_a_code(gamma: float) -> None:
    codes = np.linspace(0, 1, 27)
    model = _grey(TableCurve(tuple(codes), tuple(codes**gamma)), 0.03)
    asked = np.repeat(np.linspace(0, 1, 20001)[:, None], 3, axis=1)
    XYZ = model.xyz(asked)
    error = np.abs(table_codes(model, XYZ, code_tables(model)) - asked).max() * 255
    assert error < 0.01


def test_a_display_file_may_hold_tables(tmp_path: Path) -> None:
    table = "{codes: [0, 0.5, 1], light: [0, 0.2, 1]}"
    curve = f"{{kind: table, red: {table}, green: {table}, blue: {table}}}"
    assert _read(tmp_path, curve).curves[1] == TableCurve((0.0, 0.5, 1.0), (0.0, 0.2, 1.0))
    with pytest.raises(InputError, match="rise from 0 to 1"):
        _read(tmp_path, curve.replace("0.2, 1]}", "1.2, 1]}"))
