"""Tone curves and the table the shader reads."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.display import DisplayModel, ToneCurve, code_tables, table_codes
from devices.errors import DeviceError

CURVES = st.builds(
    ToneCurve,
    gain=st.floats(0.5, 1.5),
    offset=st.floats(-0.1, 0.1),
    gamma=st.floats(1.0, 3.2),
    lift=st.floats(-0.01, 0.05),
)


@given(CURVES, st.floats(0, 1))
def test_code_undoes_linear_wherever_there_is_light(curve: ToneCurve, code: float) -> None:
    drive = curve.gain * code + curve.offset
    if drive > 1e-3:
        assert curve.code(curve.linear(code)) == pytest.approx(code, abs=1e-9)


@given(CURVES, st.floats(0, 1), st.floats(0, 1))
def test_curves_never_fall(curve: ToneCurve, one: float, other: float) -> None:
    low, high = sorted((one, other))
    assert curve.linear(low) <= curve.linear(high)
    assert curve.code(low) <= curve.code(high)


@pytest.mark.parametrize("bad", [{"gain": 0}, {"gamma": -1}, {"gain": float("nan")}, {"gain": 0.1, "offset": -0.2}])
def test_curves_that_give_no_rising_light_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(DeviceError):
        ToneCurve(**bad)


def _grey(curve: ToneCurve) -> DisplayModel:
    return DisplayModel(np.zeros(3), np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]]), (curve, curve, curve))


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
