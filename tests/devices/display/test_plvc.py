"""PLVC as a display model: exact there and back, monotone, one answer to every colour; beside a slow obvious twin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import fsolve

from devices.compensation.clipping import clip_cost
from devices.display import NODES, Plvc, TableCurve
from devices.display.plvc import CROSS, PAIRS, _solved
from devices.errors import DeviceError

PRIMARIES = np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]])
BLACK = np.array([0.05, 0.05, 0.08])


def plvc(seed: int = 1, bend: float = 0.05, mixed: float = 0.02) -> Plvc:
    """Return a display whose channels drift by shares of ``bend`` and take shares of ``mixed`` from each other."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0.0, 1.0, 17)
    curves = tuple(TableCurve(tuple(x), tuple(x**gamma)) for gamma in (1.8, 2.2, 2.6))
    own = PRIMARIES.T[:, np.newaxis] * (1.0 + bend * rng.uniform(-1, 1, (3, 4, 3)))
    mixtures = mixed * rng.uniform(-1, 1, (10, 3)) * PRIMARIES.sum(axis=1)
    return Plvc(BLACK, PRIMARIES, curves, own, mixtures)  # type: ignore[arg-type]  # three curves, one each


def plain(seed: int = 0) -> Plvc:
    """Return one whose channels do keep their chromaticity and add up."""
    return plvc(seed, 0.0, 0.0)


def twin(model: Plvc, T: np.ndarray) -> np.ndarray:
    """Return XYZ of linear light T (3,), written out term by term."""
    XYZ = model.black_XYZ_cd_m2.copy()
    for c in range(3):
        XYZ = XYZ + T[c] * np.array(
            [
                np.polyval(
                    np.polyfit([*NODES, 1.0], [*model.XYZ_per_light_cd_m2[c, :, k], PRIMARIES[k, c]], 4), T[c] ** 0.5
                )
                for k in range(3)
            ]
        )
    mixtures = model.mixtures_XYZ_cd_m2
    for (i, j), given_ in zip(PAIRS, mixtures[:3], strict=True):
        XYZ = XYZ + T[i] * T[j] * given_
    XYZ = XYZ + T[0] * T[1] * T[2] * mixtures[3]
    for (i, j), given_ in zip(CROSS, mixtures[4:], strict=True):
        XYZ = XYZ + T[i] * (1 - T[i]) * T[j] * given_
    return np.asarray(XYZ)


def test_the_forward_model_is_the_sum_of_its_terms() -> None:
    model = plvc()
    codes = np.random.default_rng(3).uniform(0, 1, (50, 3))
    linear = np.stack([curve.linear(codes[:, c]) for c, curve in enumerate(model.curves)], axis=1)
    np.testing.assert_allclose(model.xyz(codes), [twin(model, T) for T in linear], rtol=1e-12)


def test_without_drift_and_mixtures_it_is_the_additive_model() -> None:
    codes = np.random.default_rng(3).uniform(0, 1, (100, 3))
    model = plain()
    expected = BLACK + np.stack([c.linear(codes[:, i]) for i, c in enumerate(model.curves)], axis=1) @ PRIMARIES.T
    np.testing.assert_allclose(model.xyz(codes), expected, rtol=1e-12)
    assert model.steps == 2


@pytest.mark.parametrize("seed", range(2))
def test_there_and_back_within_a_millionth_of_a_code(seed: int) -> None:
    model = plvc(seed)
    rng = np.random.default_rng(seed)
    codes = np.concatenate(
        [rng.uniform(0, 1, (4000, 3)), rng.uniform(1e-3, 1, (4000, 3)) ** 3, np.eye(3), 1 - np.eye(3)]
    )
    codes = np.maximum(codes, 2e-3)
    assert np.abs(model.code(model.xyz(codes)) - codes).max() * 255 <= 1e-6
    ends = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
    np.testing.assert_allclose(model.xyz(model.code(model.xyz(ends))), model.xyz(ends), atol=1e-9)


def test_newton_agrees_with_a_general_solver() -> None:
    model = plvc()
    for T in np.random.default_rng(5).uniform(0.05, 0.95, (8, 3)):
        XYZ = twin(model, T)

        def miss(z: np.ndarray, asked: np.ndarray = XYZ) -> np.ndarray:
            return np.asarray(twin(model, z**2) - asked)

        found = fsolve(miss, np.full(3, 0.7), xtol=1e-13) ** 2
        np.testing.assert_allclose(model.linear(XYZ), found, atol=1e-9)


def test_three_equations_are_solved_and_singular_ones_have_finite_answers() -> None:
    random = np.random.default_rng(6)
    A, b = random.normal(size=(3, 3, 50)), random.normal(size=(3, 50))
    assert _solved(A, b) == pytest.approx(np.linalg.solve(A.T.transpose(0, 2, 1), b.T[..., None])[..., 0].T, rel=1e-6)
    assert np.isfinite(_solved(np.zeros((3, 3, 2)), b[:, :2])).all()


def test_slopes_are_those_of_the_light() -> None:
    model = plvc()
    T = np.random.default_rng(4).uniform(0.05, 0.95, (30, 3))
    for c in range(3):
        step = 1e-6 * np.eye(3)[c]
        there = (model.light_of(T + step) - model.light_of(T - step)) / 2e-6
        np.testing.assert_allclose(model.slopes(T)[:, :, c], there, atol=1e-8)


def test_more_drive_gives_more_of_a_channel_s_own_light_whatever_the_others_do() -> None:
    model = plvc()
    for others in ([0.0, 0.0], [0.4, 0.9], [1.0, 1.0]):
        for c in range(3):
            codes = np.insert(np.tile(others, (256, 1)), c, np.linspace(0, 1, 256), axis=1)
            light = model.in_primaries(model.xyz(codes))[:, c]
            assert np.all(np.diff(light) > 0)
            np.testing.assert_array_less(-1e-12, np.diff(model.code(model.xyz(codes))[:, c]))


def test_outside_the_gamut_every_colour_has_one_answer_that_comes_back() -> None:
    model = plvc()
    T = np.random.default_rng(6).uniform(-0.5, 1.5, (3000, 3))
    np.testing.assert_allclose(model.linear(model.xyz_of_linear(T)), T, atol=1e-9)
    clipping = model.clipping(model.xyz_of_linear(T))
    assert clipping.any_channel == int(((T < -1e-6) | (T > 1 + 1e-6)).any(axis=1).sum())
    assert clip_cost(model, model.xyz_of_linear(np.clip(T, 0, 1))).delta_e_00_max < 1e-6
    assert clip_cost(model, model.xyz_of_linear(T)).delta_e_00_max > 1.0


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=3, max_size=3))
def test_every_finite_colour_has_finite_codes(XYZ: list[float]) -> None:
    codes = plvc().code(XYZ)
    assert np.all((codes >= 0) & (codes <= 1))


def test_white_is_all_channels_together() -> None:
    model = plvc()
    np.testing.assert_allclose(model.white_XYZ_cd_m2, model.xyz(np.ones(3)), rtol=1e-12)
    assert np.abs(model.white_XYZ_cd_m2 - BLACK - PRIMARIES.sum(axis=1)).max() > 0.1


def test_a_channel_that_falls_is_refused() -> None:
    model = plvc()
    wrong = model.XYZ_per_light_cd_m2.copy()
    wrong[1, 0] *= -1
    broken = Plvc(BLACK, PRIMARIES, model.curves, wrong, model.mixtures_XYZ_cd_m2)
    assert broken.clashes() > 0
    with pytest.raises(DeviceError, match="more drive gives less light"):
        assert broken.steps


@pytest.mark.parametrize("wrong", [np.zeros((3, 3, 3)), np.full((3, 4, 3), np.nan)])
def test_other_shapes_and_numbers_that_are_not_finite_are_refused(wrong: np.ndarray) -> None:
    model = plvc()
    with pytest.raises(DeviceError, match="XYZ_per_light_cd_m2"):
        Plvc(BLACK, PRIMARIES, model.curves, wrong, model.mixtures_XYZ_cd_m2)
