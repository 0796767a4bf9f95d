"""The residual of a display model: its slopes, black, its inverse, its file, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml

from devices.display import Plvc, Residual, TableCurve, kernels_at_black
from devices.display.model_spec import ModelSpec
from devices.display.residual import kernels, kernels_and_slopes, place_of
from devices.errors import DeviceError
from documents.arrays import Floats

PRIMARIES = np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]])


def smooth(seed: int = 1, size: float = 0.02, count: int = 12, width: float = 0.875) -> Plvc:
    """A display with a residual of ``size`` of white at random knots, beside drift and mixtures."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0.0, 1.0, 17)
    red, green, blue = (TableCurve(tuple(x), tuple(x**gamma)) for gamma in rng.uniform(1.6, 2.6, 3))
    own = PRIMARIES.T[:, None] * (1.0 + 0.03 * rng.uniform(-1, 1, (3, 4, 3)))
    white = PRIMARIES.sum(axis=1)
    mixtures = 0.01 * rng.uniform(-1, 1, (10, 3)) * white
    residual = Residual(rng.uniform(0, 0.88, (count, 3)), width, size * rng.uniform(-1, 1, (count, 3)) * white)
    return Plvc(np.full(3, 0.05), PRIMARIES, (red, green, blue), own, mixtures, residual)


def twin(model: Plvc, T: Floats) -> Floats:
    """The residual's XYZ, term by term."""
    residual = model.residual
    assert residual is not None

    def phi(place: Floats, knot: Floats) -> float:
        rho = float(np.sqrt(((place - knot) ** 2).sum())) / residual.width
        return (1 - rho) ** 4 * (4 * rho + 1) if rho < 1 else 0.0

    out = np.zeros_like(T)
    for row, light in enumerate(T):
        for knot, XYZ in zip(residual.knots, residual.XYZ_cd_m2, strict=True):
            place = np.sqrt(light + 1 / 64) - 1 / 8
            out[row] += XYZ * (phi(place, knot) - phi(np.zeros(3), knot))
    return out


def test_it_is_the_sum_of_its_kernels() -> None:
    model = smooth()
    T = np.random.default_rng(2).uniform(0, 1, (50, 3))
    alone = replace(model, residual=None)
    np.testing.assert_allclose(model.xyz_of_linear(T) - alone.xyz_of_linear(T), twin(model, T), atol=1e-12)


def test_black_stays_black() -> None:
    model = smooth()
    np.testing.assert_allclose(model.xyz(np.zeros(3)), model.black_XYZ_cd_m2, atol=1e-12)
    assert model.residual is not None
    here = kernels(np.zeros((1, 3)), model.residual.knots, model.residual.width)
    np.testing.assert_array_equal(here, np.zeros_like(here))
    assert np.all(kernels_at_black(model.residual) >= 0)


def test_slopes_are_those_of_small_steps_down_to_black() -> None:
    model = smooth()
    assert model.residual is not None
    T = np.concatenate([np.random.default_rng(3).uniform(1e-4, 1, (30, 3)), np.full((1, 3), 1e-4)]).T
    made, by = kernels_and_slopes(T, model.residual.knots, model.residual.width)
    np.testing.assert_allclose(made.T, kernels(T.T, model.residual.knots, model.residual.width), atol=1e-14)
    for channel in range(3):
        step = np.zeros((3, 1))
        step[channel] = 1e-6
        above, below = (
            kernels_and_slopes(T + sign * step, model.residual.knots, model.residual.width)[0] for sign in (1, -1)
        )
        np.testing.assert_allclose(by[channel], (above - below) / 2e-6, atol=1e-7)
    assert np.all(place_of(np.linspace(0, 1, 9)) <= 1.0)


@pytest.mark.parametrize("seed", range(2))
def test_it_is_undone_everywhere(seed: int) -> None:
    model = smooth(seed, 0.01)
    assert model.clashes() == 0
    rng = np.random.default_rng(seed)
    T = np.concatenate(
        [rng.uniform(0, 1, (500, 3)), 10 ** rng.uniform(-8, 0, (500, 3)), rng.uniform(-0.5, 1.5, (300, 3))]
    )
    np.testing.assert_allclose(model.linear(model.xyz_of_linear(T)), T, atol=1e-9)


def test_one_that_turns_light_round_is_refused() -> None:
    model = smooth(size=1.0)
    assert model.clashes() > 0
    with pytest.raises(DeviceError, match="more drive gives less light"):
        assert model.steps


def test_a_display_file_gives_it_back() -> None:
    model = smooth(count=6, size=0.003)
    read = ModelSpec.model_validate(yaml.safe_load("\n".join(ModelSpec.of(model, source="test").lines()))).model()
    assert isinstance(read, Plvc)
    assert read.residual is not None
    codes = np.random.default_rng(1).uniform(0, 1, (200, 3))
    np.testing.assert_allclose(read.xyz(codes), model.xyz(codes), atol=1e-6)


@pytest.mark.parametrize(
    ("knots", "width", "XYZ", "says"),
    [
        (np.zeros((2, 3)), 1.0, np.zeros((3, 3)), "one each"),
        (np.zeros((0, 3)), 1.0, np.zeros((0, 3)), "1 to 48 rows"),
        (np.zeros((49, 3)), 1.0, np.zeros((49, 3)), "1 to 48 rows"),
        (np.full((2, 3), np.nan), 1.0, np.zeros((2, 3)), "finite"),
        (np.full((2, 3), 1.5), 1.0, np.zeros((2, 3)), r"0\.\.1"),
        (np.zeros((2, 3)), 0.0, np.zeros((2, 3)), "width"),
        (np.zeros((2, 3)), float("nan"), np.zeros((2, 3)), "width"),
    ],
)
def test_wrong_residuals_are_refused(knots: Floats, width: float, XYZ: Floats, says: str) -> None:
    with pytest.raises(DeviceError, match=says):
        Residual(knots, width, XYZ)


def test_one_beyond_all_measure_is_refused() -> None:
    model = smooth()
    with pytest.raises(DeviceError, match="thousand times"):
        replace(model, residual=Residual(np.zeros((1, 3)), 1.0, np.full((1, 3), 1e9)))
