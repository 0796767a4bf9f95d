"""Fits of one channel, the solvers beneath them, and the residual above."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import isotonic_regression, least_squares

from devices.characterise import parametric, residual_fit, table_c1_codes, thesis_display
from devices.characterise.channel_fit import _HIGH, _LOW, FREE, KINDS, Kind, _forward_problem, fit_channel, fit_channels
from devices.characterise.choose import characterise
from devices.characterise.cross_validation import fit_all
from devices.characterise.descent import descend
from devices.characterise.fit_numbers import differences
from devices.characterise.metric import difference_roots, lab_slopes
from devices.characterise.parametric import _Problem, condition_of, fit_parametric
from devices.characterise.patches import patches
from devices.characterise.residual_fit import fit_curves_too, fit_residual, knots_among
from devices.characterise.table_fit import FUNCTIONS, functions_of, plvc_of, rising_averages
from devices.colour import delta_e_2000, xyz_to_lab
from devices.display import Plvc, TableCurve
from devices.errors import DeviceError
from devices.readings import Measurements
from documents.arrays import Floats
from tests.devices.display.test_model import smooth
from tests.example_displays import liquid_crystal_XYZ, noisy
from tests.kept import known

# Curves of one channel: recovered exactly, from poor starts, in any unit; refused where they cannot be found.
#
# Derivatives against differences, and ΔE00's local length against ΔE00.

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


# The solvers against slow ones: SciPy's least squares, isotonic regression, and one channel after the other.

DESCENT_CODES = table_c1_codes()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "XYZ", [thesis_display().xyz(DESCENT_CODES), liquid_crystal_XYZ(DESCENT_CODES)], ids=["thesis", "lcd"]
)
def test_models_are_those_of_scipy(kind: Kind, XYZ: Floats) -> None:
    data = patches(DESCENT_CODES, noisy(XYZ, 0.003, 1))
    _, found = fit_parametric(data, kind)
    problem = parametric._Problem(data, kind)
    slow = least_squares(
        problem.residuals,
        problem.start(),
        jac=problem.jacobian,
        bounds=problem.bounds(),
        x_scale="jac",
        loss="soft_l1",
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
    )
    np.testing.assert_allclose(found, slow.x, atol=1e-6)


def test_bounds_are_kept() -> None:
    def residuals(p: Floats) -> Floats:
        return np.array([p[0] - 2.0, p[1] + 3.0, p[0] + p[1]])

    def jacobian(p: Floats) -> Floats:
        return np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])

    low, high = np.array([-1.0, -1.0]), np.array([1.0, 1.0])
    found = descend(residuals, jacobian, np.zeros(2), bounds=(low, high), last_gain=1e-12, steps=50)
    np.testing.assert_allclose(found, [1.0, -1.0], atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_channels_fitted_at_once_are_those_fitted_alone_and_those_of_scipy(kind: Kind) -> None:
    alone = np.all(DESCENT_CODES[:, 1:] == 0, axis=1)
    XYZ = noisy(liquid_crystal_XYZ(DESCENT_CODES), 0.002, 1)[alone]
    code, lights = DESCENT_CODES[alone, 0], [XYZ[:, axis] / XYZ[:, axis].max() for axis in range(3)]
    together = fit_channels([(code, light) for light in lights], kind)
    free = np.array(FREE[kind])
    for fit, light in zip(together, lights, strict=True):
        np.testing.assert_allclose(fit.coefficients, fit_channel(code, light, kind).coefficients, atol=1e-9)

        def residuals(p: Floats, light: Floats = light) -> Floats:
            whole = np.array([1.0, 0.0, 1.0, 0.0])
            whole[free] = p
            return np.asarray(_forward_problem(whole[None], code[None])[0][0] - light)

        start = np.array([1.0, 0.0, 1.8, 0.0])[free]
        slow = least_squares(residuals, start, bounds=(_LOW[free], _HIGH[free]), xtol=1e-14, ftol=1e-14, gtol=1e-14)
        assert ((fit(code) - light) ** 2).sum() <= (slow.fun**2).sum() * (1 + 1e-9)


def test_rising_averages_are_isotonic_regression() -> None:
    rng = np.random.default_rng(0)
    for size in (1, 2, 3, 10, 40):
        values = rng.uniform(0, 1, size) + np.linspace(0, 0.7, size)
        np.testing.assert_allclose(rising_averages(values), isotonic_regression(values).x, atol=1e-14)


# The residual is chosen where it helps and nowhere else, and what is left out is what a fit without it leaves.

RESIDUAL_CODES = np.concatenate([table_c1_codes(), np.random.default_rng(0).integers(0, 256, (40, 3)) / 255])
FRESH = np.random.default_rng(9).uniform(0, 1, (300, 3))


@pytest.mark.nightly
def test_it_is_chosen_where_it_helps_and_keeps_what_it_promises() -> None:
    model = smooth(2, 0.02, 8)
    found = characterise(Measurements(RESIDUAL_CODES, noisy(model.xyz(RESIDUAL_CODES), 0.001, 1)))
    held = {candidate.name: candidate.held_out.mean for candidate in found.candidates}
    assert found.chosen.name == "residual"
    assert held["residual"] <= 0.5
    assert held["residual"] < held["plvc"] - 0.05
    fresh = patches(FRESH, model.xyz(FRESH), white=found.patches.white)
    assert differences(found.chosen.model, fresh).mean() <= 1.2 * held["residual"]
    assert found.chosen.table_error_codes is not None
    assert known(found.chosen.inversion_error_codes) < 1e-6


@pytest.mark.nightly
def test_it_is_not_chosen_where_it_does_not_help() -> None:
    """Nor on an additive display: see `test_choose`."""
    found = characterise(Measurements(RESIDUAL_CODES, noisy(liquid_crystal_XYZ(RESIDUAL_CODES), 0.002, 0)))
    assert found.chosen.name != "residual"


def test_what_is_left_out_is_what_the_fit_without_it_leaves() -> None:
    rng = np.random.default_rng(1)
    J, target, penalty = rng.normal(size=(60, 12)), rng.normal(size=60), 0.3 * np.eye(12)
    quick = residual_fit._left_out(J, target, penalty).reshape(-1, 3)
    for row in range(20):
        own = np.arange(3 * row, 3 * row + 3)
        rest = np.setdiff1d(np.arange(60), own)
        without = np.linalg.solve(J[rest].T @ J[rest] + penalty, J[rest].T @ target[rest])
        np.testing.assert_allclose(quick[row], target[own] - J[own] @ without, atol=1e-10)


def test_the_normal_equations_are_those_of_the_columns() -> None:
    rng = np.random.default_rng(1)
    A, target, functions = rng.normal(size=(40, 3, 3)), rng.normal(size=120), rng.normal(size=(40, 7))
    J = residual_fit._columns(A, functions)
    normal, wanted = residual_fit._normal_equations(A, target, functions)
    np.testing.assert_allclose(normal, J.T @ J, atol=1e-12)
    np.testing.assert_allclose(wanted, J.T @ target, atol=1e-12)


def test_knots_are_readings_far_from_each_other() -> None:
    light = np.random.default_rng(2).uniform(0, 1, (200, 3))
    knots = knots_among(light, 12)
    apart = np.linalg.norm(knots[:, None] - knots[None], axis=2) + np.eye(12)
    assert apart.min() > 0.25
    assert len(knots_among(light[:3], 12)) == 3
    np.testing.assert_array_equal(knots, np.round(1024 * knots) / 1024)


@pytest.mark.nightly
def test_a_model_that_cannot_be_undone_is_passed_over_for_a_stiffer_one(monkeypatch: pytest.MonkeyPatch) -> None:
    data = patches(RESIDUAL_CODES, noisy(smooth(2, 0.02, 8).xyz(RESIDUAL_CODES), 0.001, 1))
    plvc = fit_all(data, {}, residual=False)["plvc"]
    assert isinstance(plvc.model, Plvc)
    free, _ = fit_residual(data, plvc.model, plvc.free_numbers)
    tried: list[Plvc] = []

    def clashes(model: Plvc, steps: int = 13) -> int:
        tried.append(model)
        return 1 if len(tried) == 1 else 0

    monkeypatch.setattr(Plvc, "clashes", clashes)
    other, _ = fit_residual(data, plvc.model, plvc.free_numbers)
    assert len(tried) == 3
    assert tried[1] is tried[2] is not tried[0]
    assert np.abs(other.xyz(FRESH) - free.xyz(FRESH)).max() > 0


def test_plvc_is_found_again_where_its_curves_are_fitted_along() -> None:
    model = replace(smooth(2), residual=None)
    data = patches(RESIDUAL_CODES, noisy(model.xyz(RESIDUAL_CODES), 0.001, 1))
    fresh = patches(FRESH, model.xyz(FRESH), white=data.white)
    fit = fit_all(data, {}, residual=False)["plvc"]
    assert differences(fit.model, fresh).mean() < 0.6 * differences(known(fit.before), fresh).mean()


def test_curves_are_not_fitted_along_where_that_could_not_be_undone(monkeypatch: pytest.MonkeyPatch) -> None:
    data = patches(RESIDUAL_CODES, noisy(smooth(2).xyz(RESIDUAL_CODES), 0.001, 1))
    before = known(fit_all(data, {}, residual=False)["plvc"].before)
    monkeypatch.setattr(Plvc, "clashes", lambda model: 1)
    assert fit_curves_too(data, before) is before
