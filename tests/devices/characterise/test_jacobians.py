"""Derivatives against differences, and ΔE00's local length against ΔE00."""

import numpy as np
import pytest

from devices.characterise import table_c1_codes, thesis_display
from devices.characterise.channel_fit import KINDS, Kind
from devices.characterise.example_displays import noisy
from devices.characterise.metric import difference_roots, lab_slopes
from devices.characterise.parametric import _Problem, condition_of, fit_parametric
from devices.characterise.patches import patches
from devices.characterise.table_fit import FUNCTIONS, functions_of, plvc_of
from devices.colour import delta_e_2000, xyz_to_lab
from devices.display import TableCurve

WHITE = np.array([95.0, 100, 108])


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
