"""Curves of one channel: recovered exactly, from poor starts, in any unit; refused where they cannot be found.

Derivatives against differences, and ΔE00's local length against ΔE00.
"""

from __future__ import annotations

import numpy as np
import pytest

from devices.characterise import table_c1_codes, thesis_display
from devices.characterise.channel_fit import KINDS, Kind, fit_channel
from devices.characterise.metric import difference_roots, lab_slopes
from devices.characterise.parametric import _Problem, condition_of, fit_parametric
from devices.characterise.patches import patches
from devices.characterise.table_fit import FUNCTIONS, functions_of, plvc_of
from devices.colour import delta_e_2000, xyz_to_lab
from devices.display import TableCurve
from devices.errors import DeviceError
from tests.example_displays import noisy

CODES = np.arange(0, 256, 10) / 255
TRUE: dict[Kind, tuple[float, float, float, float]] = {
    "gamma": (1.0, 0.0, 2.2, 0.0),
    "gog": (0.969, 0.0218, 1.8132, 0.0),
    "ggo": (0.95, 0.0, 1.6, 0.02),
    "gogo": (0.9, -0.05, 2.4, 0.01),
}
WHITE = np.array([95.0, 100, 108])


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


def test_lab_slopes() -> None:
    XYZ = np.array([[20.0, 30, 10], [0.1, 0.2, 0.05], [90, 95, 100], [0.0, 0.0, 0.0], [-0.1, 0.1, 0.1]])
    slopes = lab_slopes(XYZ, WHITE)
    for axis in range(3):
        step = np.eye(3)[axis] * 1e-6
        there = (xyz_to_lab(XYZ + step, WHITE) - xyz_to_lab(XYZ - step, WHITE)) / 2e-6
        np.testing.assert_allclose(slopes[:, :, axis], there, rtol=1e-5, atol=1e-6)


def test_lengths_are_delta_e_2000_near_a_colour() -> None:
    rng = np.random.default_rng(3)
    lab = np.column_stack([rng.uniform(2, 98, 200), rng.uniform(-60, 60, (200, 2))])
    step = rng.normal(0, 0.05, (200, 3))
    length = np.linalg.norm(np.einsum("nij,nj->ni", difference_roots(lab), step), axis=1)
    np.testing.assert_allclose(length, delta_e_2000(lab, lab + step), rtol=0.02)


@pytest.mark.parametrize("kind", KINDS)
def test_parametric_jacobian(kind: Kind) -> None:
    codes = table_c1_codes()[::7]
    data = patches(codes, noisy(thesis_display().xyz(codes), 0.01, 1))
    problem = _Problem(data, kind)
    _, p = fit_parametric(data, kind)
    p = p * 1.05 + 1e-3
    J = problem.jacobian(p)
    for k in range(len(p)):
        step = np.zeros(len(p))
        step[k] = 1e-7
        there = (problem.residuals(p + step) - problem.residuals(p - step)) / 2e-7
        np.testing.assert_allclose(J[:, k], there, rtol=1e-4, atol=1e-4)


def test_plvc_is_its_functions_times_their_coefficients() -> None:
    x = np.linspace(0, 1, 9)
    curve = TableCurve(tuple(x), tuple(x**2.2))
    rng = np.random.default_rng(4)
    coefficients, codes = rng.uniform(-1, 1, (FUNCTIONS, 3)), rng.uniform(0, 1, (30, 3))
    coefficients[:3] += 5 * np.eye(3)
    model = plvc_of(np.full(3, 0.1), (curve, curve, curve), coefficients)
    np.testing.assert_allclose(model.xyz(codes), 0.1 + functions_of(curve.linear(codes)) @ coefficients, atol=1e-12)


@pytest.mark.parametrize("spread", [0.0, 1.0, 3.0, 5.5, 7.5, 7.9, 12.0])
def test_the_condition_is_that_of_the_singular_values(spread: float) -> None:
    rng = np.random.default_rng(3)
    left, right = (np.linalg.qr(rng.normal(size=(count, 9)))[0] for count in (40, 9))
    J = left @ np.diag(10 ** np.linspace(0, -spread, 9)) @ right
    unit = J / np.linalg.norm(J, axis=0)
    assert condition_of(1e3 * J) == pytest.approx(np.linalg.cond(unit), rel=1e-3)
    assert condition_of(np.column_stack([J, np.zeros(40)])) == np.inf
