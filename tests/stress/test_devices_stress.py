"""Crosstalk, gain maps and dithering at their edges: hardly any light, far too much, and systems hard to undo."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from devices.compensation import cancel_crosstalk, dither_thresholds, needed_lift
from devices.compensation.dither import dither_tables, tabled_dither_codes
from devices.display import Crosstalk, DisplayModel, EyeModels, GainMap, ToneCurve
from devices.errors import DeviceError

pytestmark = pytest.mark.stress


PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
PERIOD = dither_thresholds(64, 64)


def _model(curve: ToneCurve, black: float = 0.0) -> DisplayModel:
    return DisplayModel(black * np.array([0.95, 1.0, 1.2]), PRIMARIES, (curve, curve, curve))


def _both(model: DisplayModel) -> EyeModels:
    return EyeModels(model, model)


def test_crosstalk_that_hardly_differs_from_the_picture_is_undone_or_refused() -> None:
    """One minus the leak from 0.1 down: undone to the precision that the condition number leaves, then refused."""
    rng = np.random.default_rng(0)
    left, right = rng.uniform(0, 100, (2, 1000, 3))
    refused = []
    for power in range(1, 17):
        gap = 10.0**-power
        leak = (1 - gap) * np.eye(3)
        if 2 / gap > 1e6:
            with pytest.raises(DeviceError, match="cannot be undone"):
                Crosstalk(leak, leak)
            refused.append(power)
            continue
        crosstalk = Crosstalk(leak, leak)
        back = crosstalk.solve(*crosstalk.seen(left, right))
        allowed = 200 * np.finfo(np.float64).eps * np.linalg.cond(crosstalk.mixing) * 100
        assert max(np.abs(back[0] - left).max(), np.abs(back[1] - right).max()) < allowed
    assert refused == list(range(6, 17))


@pytest.mark.parametrize("scale", [1e-7, 1e-3, 1.0, 1e8, 1e30])
def test_cancelling_from_hardly_any_light_to_absurdly_much(scale: float) -> None:
    models = _both(_model(ToneCurve(gamma=2.2), black=1e-8))
    leak = Crosstalk(0.05 * np.eye(3), 0.03 * np.eye(3))
    left, right = scale * np.random.default_rng(2).uniform(0.5, 1, (2, 50, 3))
    cancelled = cancel_crosstalk(models, leak, left, right)
    for linear, cost in ((cancelled.left_linear, cancelled.left), (cancelled.right_linear, cancelled.right)):
        assert np.all((linear >= 0) & (linear <= 1))
        assert np.all(np.isfinite([cost.worst_residual_cd_m2, cost.delta_e_00_mean, cost.delta_e_00_max]))
        assert cost.worst_residual_cd_m2 <= 0.06 * models.left.white_XYZ_cd_m2.max()
    lift = needed_lift(models, leak, left, right)
    assert 0 <= lift < 0.06
    lifted = cancel_crosstalk(models, leak, left, right, lift)
    assert lifted.left.negative == lifted.right.negative == 0


CURVES = [
    ToneCurve(gain, offset, gamma, lift)
    for gain, offset, gamma, lift in itertools.product(
        (0.9, 1.0, 1.1), (-0.06, 0.0, 0.03), (1.0, 1.8, 2.4, 3.2), (-0.004, 0.0, 0.013)
    )
]


@pytest.mark.parametrize("levels", [63, 255, 1023, 4095])
def test_every_curve_keeps_the_mean_light_from_the_tables(levels: int) -> None:
    """All 108 curves, light from 1e-7 to full: within a four-thousandth of the step between the codes around it."""
    light = np.concatenate([np.geomspace(1e-7, 1, 25), np.linspace(0, 1, 12)])
    for curve in CURVES:
        model = _model(curve)
        reachable = np.clip(light, max(0.0, float(curve.linear(0))), min(1.0, float(curve.linear(1))))
        tables = dither_tables(model, levels)
        lights = curve.linear(np.arange(levels + 1) / levels)
        for wanted in reachable:
            xyz = np.broadcast_to(np.full(3, wanted) @ model.primaries_XYZ_cd_m2.T, PERIOD.shape)
            codes = tabled_dither_codes(model, xyz, PERIOD, tables)
            assert codes.max() - codes.min() <= 1
            # A share of the period is at most half a rank wrong, and one rank where float32 tips it over.
            step = float(np.diff(lights)[min(int(codes.min()), levels - 1)])
            assert abs(float(curve.linear(codes / levels)[..., 0].mean()) - wanted) <= 1.5 / 4096 * step + 1e-12


@pytest.mark.parametrize("levels", [255, 1023, 4095])
def test_every_exact_code_is_itself_from_the_tables(levels: int) -> None:
    for curve in CURVES:
        model = _model(curve)
        codes = np.arange(levels + 1)
        lights = curve.linear(codes / levels)
        inside = (lights >= 0) & (lights <= 1)
        xyz = np.repeat(lights[inside, None], 3, axis=1) @ model.primaries_XYZ_cd_m2.T
        tables = dither_tables(model, levels)
        for threshold in (0.5 / 4096, 0.5, 4095.5 / 4096):
            found = tabled_dither_codes(model, xyz, np.full(3, threshold), tables)
            # Codes below a curve's foot give the same light; the highest of them stands for all.
            assert np.abs(curve.linear(found / levels) - lights[inside, None]).max() < 1e-12


def test_gain_maps_of_every_size_and_steepness() -> None:
    rng = np.random.default_rng(5)
    for rows, columns in ((1, 1), (1, 50), (50, 1), (2, 2), (200, 300)):
        readings = 10.0 ** rng.uniform(-6, 6, (rows, columns))
        gain_map = GainMap(readings, (1920, 1080), "cells", "minimum")
        x, y = np.arange(0.5, 1920, 7), np.arange(0.5, 1080, 7)
        fast, plain = gain_map.over(x, y), gain_map.gain(x[None, :], y[:, None])
        assert np.abs(fast / plain - 1).max() < 1e-9
        assert np.all((plain >= gain_map.gains.min() * (1 - 1e-12)) & (plain <= gain_map.gains.max() * (1 + 1e-12)))
        assert 0 < gain_map.delivered_share <= 1
        assert np.all(gain_map.corrected(np.ones((*plain.shape, 3)), plain) <= 1 + 1e-9)
