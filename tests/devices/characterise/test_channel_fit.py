"""Curves of one channel: recovered exactly, from poor starts, in any unit; refused where they cannot be found."""

import numpy as np
import pytest

from devices.characterise.channel_fit import KINDS, Kind, fit_channel
from devices.errors import DeviceError

CODES = np.arange(0, 256, 10) / 255
TRUE: dict[Kind, tuple[float, float, float, float]] = {
    "gamma": (1.0, 0.0, 2.2, 0.0),
    "gog": (0.969, 0.0218, 1.8132, 0.0),
    "ggo": (0.95, 0.0, 1.6, 0.02),
    "gogo": (0.9, -0.05, 2.4, 0.01),
}


def _light(kind: Kind) -> np.ndarray:
    gain, offset, gamma, lift = TRUE[kind]
    return np.maximum(gain * CODES + offset, 0) ** gamma + lift


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("start", [None, 0.3, 1.0, 6.0])
@pytest.mark.parametrize("unit", [1.0, 2000.0, 1e-3])
def test_coefficients_come_back_from_poor_starts_in_any_unit(kind: Kind, start: float | None, unit: float) -> None:
    if kind == "gamma" and unit != 1:
        pytest.skip("the simple gamma has no gain to carry a unit")
    fit = fit_channel(CODES, unit * _light(kind), kind, start_gamma=start)
    gain, offset, gamma, lift = TRUE[kind]
    scale = unit ** (1 / gamma)
    np.testing.assert_allclose(fit.coefficients / [scale, scale, 1, unit], [gain, offset, gamma, lift], atol=1e-8)
    assert fit.r2 == pytest.approx(1, abs=1e-12)
    assert not fit.at_bound


@pytest.mark.parametrize("kind", ["gog", "ggo", "gamma"])
def test_the_inverse_is_fitted_too(kind: Kind) -> None:
    fit = fit_channel(CODES, _light(kind), kind, inverse=True)
    np.testing.assert_allclose(fit(_light(kind)), CODES, atol=1e-7)
    gain, _, gamma, _ = TRUE[kind]
    assert fit.coefficients[2] == pytest.approx(1 / gamma, abs=1e-6)
    assert fit.coefficients[0] == pytest.approx(1 / gain, abs=1e-6)


@pytest.mark.nightly
def test_standard_errors_are_the_spread_over_repeated_noise() -> None:
    rng = np.random.default_rng(1)
    fits = [fit_channel(CODES, _light("gog") + 0.002 * rng.standard_normal(len(CODES)), "gog") for _ in range(150)]
    spread = np.std([fit.coefficients[:3] for fit in fits], axis=0)
    told = np.mean([fit.standard_errors[:3] for fit in fits], axis=0)
    np.testing.assert_allclose(told, spread, rtol=0.25)


def test_standard_errors_scale_with_the_unit() -> None:
    light = _light("gogo") + 0.001 * np.random.default_rng(2).standard_normal(len(CODES))
    one, many = fit_channel(CODES, light, "gogo"), fit_channel(CODES, 1000 * light, "gogo")
    assert many.standard_errors[3] == pytest.approx(1000 * one.standard_errors[3], rel=1e-4)
    assert many.standard_errors[2] == pytest.approx(one.standard_errors[2], rel=1e-4)


def test_what_cannot_be_fitted_is_refused() -> None:
    with pytest.raises(DeviceError, match="different codes"):
        fit_channel([0, 0.5, 1], [0, 0.2, 1], "gog")
    with pytest.raises(DeviceError, match="no light"):
        fit_channel(CODES, np.zeros_like(CODES), "gog")
    with pytest.raises(DeviceError, match="finite"):
        fit_channel(CODES, np.full_like(CODES, np.nan), "gog")
