"""The solvers against slow ones: SciPy's least squares, isotonic regression, and one channel after the other."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import isotonic_regression, least_squares

from devices.characterise import parametric, table_c1_codes, thesis_display
from devices.characterise.channel_fit import _HIGH, _LOW, FREE, KINDS, Kind, _forward_problem, fit_channel, fit_channels
from devices.characterise.descent import descend
from devices.characterise.parametric import fit_parametric
from devices.characterise.patches import patches
from devices.characterise.table_fit import rising_averages
from documents.arrays import Floats
from tests.example_displays import liquid_crystal_XYZ, noisy

CODES = table_c1_codes()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("XYZ", [thesis_display().xyz(CODES), liquid_crystal_XYZ(CODES)], ids=["thesis", "lcd"])
def test_models_are_those_of_scipy(kind: Kind, XYZ: Floats) -> None:
    data = patches(CODES, noisy(XYZ, 0.003, 1))
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
    alone = np.all(CODES[:, 1:] == 0, axis=1)
    XYZ = noisy(liquid_crystal_XYZ(CODES), 0.002, 1)[alone]
    code, lights = CODES[alone, 0], [XYZ[:, axis] / XYZ[:, axis].max() for axis in range(3)]
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
