"""Curves that are tables, as flat as measured ones may be, through the colour pass on EGL, against float64."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.characterise.choose import characterise
from devices.compensation import Mixture, dither_codes, dither_thresholds
from devices.display import Curve, DisplayModel, TableCurve, ToneCurve, code_tables, knotted_codes, table_codes
from devices.readings import read_csv
from documents.arrays import Floats
from runner.presenter import ColourPass, Dithering
from runner.presenter.colour_pass import MixedPass
from runner.presenter.surfaces.egl import EglSurface
from tests.runner.presenter.test_plvc_pass import read, upload

pytestmark = pytest.mark.usefixtures("each_arithmetic")

PRIMARIES = np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]])
CODES = np.linspace(0.0, 1.0, 31)
GAMMA = ToneCurve(gamma=2.2)


def tabled(root: Floats) -> TableCurve:
    """A curve through √light with the least rise that a fitted table has, 1e-3 over all codes."""
    rising = 0.999 * root / root[-1] + 1e-3 * CODES
    rising[-1] = 1.0
    return TableCurve(tuple(CODES), tuple(rising**2))


CUT_OFF = tabled(np.maximum(CODES - 0.3, 0.0) ** 1.1)
CLIPPED = tabled(np.minimum(1.25 * CODES, 1.0) ** 1.1)


def display(*curves: Curve) -> DisplayModel:
    red, green, blue = curves if len(curves) == 3 else (*curves, *curves, *curves)
    return DisplayModel(np.zeros(3), PRIMARIES, (red, green, blue))


def colours(model: DisplayModel) -> NDArray[np.float32]:
    """XYZ (100, 100, 3), float32, with 1e-7 ≤ Y ≤ white: greys at every code, single channels, any colours."""
    rng = np.random.default_rng(1)
    greys = model.linear(model.xyz(np.repeat(np.linspace(0, 1, 4081)[:, np.newaxis], 3, axis=1)))
    lone = 10 ** rng.uniform(-9, 0, (5000, 1)) * np.eye(3)[rng.integers(0, 3, 5000)]
    every = np.concatenate([greys, lone, rng.uniform(0, 1, (5000, 3)), 10 ** rng.uniform(-9, 0, (5000, 3))])
    asked = (model.black_XYZ_cd_m2 + every @ model.primaries_XYZ_cd_m2.T).astype(np.float32)
    inside = asked[(asked[:, 1] >= 1e-7) & (asked[:, 1] <= model.white_XYZ_cd_m2[1])]
    assert len(inside) > 10000
    return np.asarray(inside[np.linspace(0, len(inside) - 1, 10000).astype(int)].reshape(100, 100, 3))


def check(egl: EglSurface, model: DisplayModel) -> None:
    asked = colours(model)
    expected = model.code(asked.astype(np.float64))
    run = ColourPass(egl.context, model)
    texture = upload(egl, asked)
    assert np.abs(read(run.run(texture, "f4")) - expected).max() * 255 < 0.001
    assert np.abs(read(run.run(texture), "f1") - 255 * expected).max() <= 0.501


@pytest.mark.parametrize("curve", [CUT_OFF, CLIPPED])
def test_every_pixel_of_a_nearly_flat_table_is_within_rounding_of_float64(egl: EglSurface, curve: TableCurve) -> None:
    model = display(curve)
    check(egl, model)
    asked = colours(model).astype(np.float64)
    assert np.abs(knotted_codes(model, asked) - model.code(asked)).max() * 255 < 0.0006
    # The one table that serves curves with a formula would be off by codes.
    assert np.abs(table_codes(model, asked, code_tables(model)) - model.code(asked)).max() * 255 > 1


def test_a_display_may_have_tables_and_formulas(egl: EglSurface) -> None:
    check(egl, display(GAMMA, CLIPPED, CUT_OFF))


@pytest.mark.shared_data
def test_a_crt_that_gives_no_light_at_dark_codes_is_shown_by_its_table(egl: EglSurface, shared_data: Path) -> None:
    model = characterise(read_csv(shared_data / "data/displays/apple17_crt_2000.csv"), "table").chosen.model
    assert max(curve.light[5] for curve in model.curves if isinstance(curve, TableCurve)) < 2e-4
    check(egl, model)


def test_eyes_mixed_into_one_picture_may_have_tables_and_formulas(egl: EglSurface) -> None:
    model = display(CUT_OFF, GAMMA, CLIPPED)
    half, black, unit = 0.5 * model.linear_from_XYZ, model.black_XYZ_cd_m2, np.eye(3)
    mixture = Mixture(half, half, black, black, model.curves, unit, unit)
    asked = colours(model)
    texture = upload(egl, asked)
    shown = read(MixedPass(egl.context, mixture).run(texture, texture, "f4"))
    assert np.abs(shown - model.code(asked.astype(np.float64))).max() * 255 < 0.001


@pytest.mark.parametrize("curve", [CUT_OFF, CLIPPED])
def test_dithering_a_nearly_flat_table_keeps_the_mean_light(egl: EglSurface, curve: TableCurve) -> None:
    model = display(curve)
    asked = np.broadcast_to(model.xyz([0.2, 0.5, 0.95]), (64, 64, 3)).astype(np.float32)
    shown = read(ColourPass(egl.context, model, dithering=Dithering()).run(upload(egl, asked)), "f1")
    expected = dither_codes(model, asked.astype(np.float64), dither_thresholds(64, 64))
    np.testing.assert_allclose(model.xyz(shown / 255).mean(axis=(0, 1)), asked[0, 0], rtol=2e-4)
    assert np.mean(shown != expected) < 0.02
