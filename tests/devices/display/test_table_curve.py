"""Tone curves as tables: they rise, are undone, and serve the presenter's table."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from devices.display import DisplayModel, TableCurve, code_tables, read_display, table_codes
from devices.errors import DeviceError

Floats = NDArray[np.float64]
FINITE = st.floats(allow_nan=False, allow_infinity=False)


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


@settings(max_examples=15)
@given(tables())
def test_it_runs_through_its_entries(curve: TableCurve) -> None:
    np.testing.assert_allclose(curve.linear(curve.codes), curve.light, atol=1e-12)
    np.testing.assert_allclose(curve.code(curve.light), curve.codes, atol=1e-9)


def _as_the_page_says(codes: tuple[float, ...], light: tuple[float, ...], at: Floats) -> Floats:
    """The formulae of docs/display.md, "What exactly is a table between its entries?", one code at a time."""
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


def _model(curve: TableCurve) -> DisplayModel:
    return DisplayModel(np.full(3, 0.03), np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]]), (curve, curve, curve))


@pytest.mark.parametrize("gamma", [1.6, 2.2, 2.9])
def test_the_presenters_table_is_made_of_it_within_a_hundredth_of_a_code(gamma: float) -> None:
    codes = np.linspace(0, 1, 27)
    model = _model(TableCurve(tuple(codes), tuple(codes**gamma)))
    asked = np.repeat(np.linspace(0, 1, 20001)[:, None], 3, axis=1)
    XYZ = model.xyz(asked)
    error = np.abs(table_codes(model, XYZ, code_tables(model)) - asked).max() * 255
    assert error < 0.01


def test_a_display_file_may_hold_tables(tmp_path: Path) -> None:
    table = "{codes: [0, 0.5, 1], light: [0, 0.2, 1]}"
    text = f"""schema_version: 1
panel: {{resolution_px: [8, 8], pixel_pitch_mm: 0.3}}
modes:
  flat:
    black_XYZ_cd_m2: [0.1, 0.1, 0.1]
    primaries_XYZ_cd_m2: {{red: [10.83, 5.62, 0.54], green: [9.67, 18.65, 1.63], blue: [5.68, 2.20, 29.18]}}
    curve: {{kind: table, red: {table}, green: {table}, blue: {table}}}
"""
    path = tmp_path / "d.yaml"
    path.write_text(text)
    curve = read_display(path).models("flat").left.curves[1]
    assert curve == TableCurve((0.0, 0.5, 1.0), (0.0, 0.2, 1.0))
    path.write_text(text.replace("0.2, 1]}", "1.2, 1]}"))
    with pytest.raises(DeviceError, match="rise from 0 to 1"):
        read_display(path)
