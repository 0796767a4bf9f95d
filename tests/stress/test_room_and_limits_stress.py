"""What displays can show at extremes: rooms from none to sunlight, curves lifted to 0.9, leaks at their bounds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.colour import delta_e_2000, xyz_to_lab
from devices.compensation import cancel_crosstalk
from devices.compensation.clipping import clip_cost
from devices.compensation.crosstalk_cancel import seen_XYZ
from devices.diagnostics.room_light import in_light_of
from devices.display import EYES, Crosstalk, DisplayModel, EyeModels, ToneCurve, check_leakage
from devices.errors import DeviceError
from devices.readings import Measurements
from documents.arrays import Floats
from tests.displays import display_models, eye_models

pytestmark = pytest.mark.stress

MANY = settings(max_examples=300, suppress_health_check=list(HealthCheck), deadline=None)
SOME = settings(MANY, max_examples=60)
# cd/m²: none, less than a float32 resolves beside white, dusk, sunlight on the panel.
ROOMS = st.sampled_from([0.0, 1e-300, 1e-9, 1e-3, 1.0, 1e3, 1e6])
SEEDS = st.integers(0, 10**6)
BLACK = np.array([0.05, 0.06, 0.08])
PRIMARIES = np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]])


def _lifted(gain: float, offset: float, gamma: float, lift: float) -> DisplayModel:
    curve = ToneCurve(gain, offset, gamma, lift)
    return DisplayModel(BLACK, PRIMARIES, (curve, curve, curve))


def _by_bisection(model: DisplayModel, linear: Floats) -> NDArray[np.bool_]:
    """Return which of linear light (n, 3) no codes give, by halving codes: nothing of the model's limits is used."""
    low, high = np.zeros_like(linear), np.ones_like(linear)
    for _ in range(60):
        middle = 0.5 * (low + high)
        light = np.stack([curve.linear(middle[:, i]) for i, curve in enumerate(model.curves)], axis=1)
        low, high = np.where(light < linear, middle, low), np.where(light < linear, high, middle)
    ends = [
        np.stack([curve.linear(side[:, i]) for i, curve in enumerate(model.curves)], axis=1) for side in (low, high)
    ]
    off = np.minimum(*(np.abs(end - linear) for end in ends))
    return np.asarray((off > model.gamut_tolerance).any(axis=1))


def _beside_the_tolerance(model: DisplayModel, linear: Floats) -> NDArray[np.bool_]:
    """Return which of linear light (n, 3) no rounding takes over the edge of the tolerance."""
    tolerance = model.gamut_tolerance
    edges = [model.limits[0] - tolerance, model.limits[1] + tolerance]
    return np.asarray(np.all([np.abs(linear - edge) > 1e-3 * tolerance for edge in edges], axis=(0, 2)))


@MANY
@given(
    gain=st.floats(0.01, 3.0),
    offset=st.floats(-0.9, 0.9),
    gamma=st.floats(1.0, 4.0),
    lift=st.floats(-0.5, 0.5),
    room=ROOMS,
    seed=SEEDS,
)
def test_counts_are_those_of_bisection_over_the_codes(
    gain: float, offset: float, gamma: float, lift: float, room: float, seed: int
) -> None:
    if gain + offset < 0.05:
        return
    model = _lifted(gain, offset, gamma, lift).in_room(room * np.array([0.95, 1.0, 1.09]))
    lowest, highest = model.limits
    span = highest - lowest
    linear = lowest + span * np.random.default_rng(seed).uniform(-0.2, 1.2, (300, 3))
    linear = model.linear(model.xyz_of_linear(linear))
    linear = linear[_beside_the_tolerance(model, linear)]
    counted = np.array([model.clipping(model.xyz_of_linear(light)).any_channel for light in linear], dtype=bool)
    assert np.array_equal(counted, _by_bisection(model, linear))


@MANY
@given(model=display_models(), room=ROOMS, seed=SEEDS)
def test_all_codes_are_inside_in_any_room_and_come_back(model: DisplayModel, room: float, seed: int) -> None:
    lit = model.in_room(room * np.array([0.95, 1.0, 1.09]))
    codes = np.random.default_rng(seed).uniform(0.0, 1.0, (200, 3))
    codes[:8] = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1]), axis=-1).reshape(-1, 3)
    light = lit.xyz(codes)
    assert lit.clipping(light).any_channel == 0
    assert lit.clipping(light.astype(np.float32)).any_channel == 0
    # The room's light takes digits from a light beside it.
    again = lit.xyz(lit.code(light))
    assert np.abs(again - light).max() <= 1e-9 * (1.0 + room) + 1e-9 * lit.shown_white_XYZ_cd_m2.max()
    assert lit.contrast() <= lit.contrast(in_the_room=False) * (1.0 + 1e-9)


@MANY
@given(model=display_models(plvc=False), room=st.sampled_from([1e-3, 1.0, 100.0]))
def test_the_dark_is_outside_in_a_lit_room(model: DisplayModel, room: float) -> None:
    lit = model.in_room(room * np.array([0.95, 1.0, 1.09]))
    asked = model.shown_black_XYZ_cd_m2
    missing = (lit.linear_from_XYZ @ lit.ambient_XYZ_cd_m2) / lit.gamut_tolerance
    if missing.max() > 1.01:
        assert lit.clipping(asked).any_channel == 1
    if missing.max() < 0.99:
        assert lit.clipping(asked).any_channel == 0
    # A fitted black may be a little below no light, which nothing is compared with.
    white = lit.white_XYZ_cd_m2
    slow = delta_e_2000(xyz_to_lab(np.maximum(asked, 0.0), white), xyz_to_lab(lit.xyz(lit.code(asked)), white))
    assert clip_cost(lit, asked[np.newaxis]).delta_e_00_max == pytest.approx(float(slow), abs=1e-6)


@pytest.mark.parametrize("share", [0.999, 0.5, 0.1, 1e-6, -1e-6, -0.1, -0.5, -0.999])
@pytest.mark.parametrize("room", [0.0, 1e-9, 1e3])
def test_leaks_up_to_their_bounds_are_cancelled_or_said_to_be_left(share: float, room: float) -> None:
    model = _lifted(0.98, 0.02, 2.2, 0.0).in_room(np.full(3, room))
    models, leaks = EyeModels(model, model), Crosstalk(share * np.eye(3), share * np.eye(3))
    check_leakage(leaks, PRIMARIES, PRIMARIES)
    rng = np.random.default_rng(1)
    asked = [model.xyz(rng.uniform(0.0, 1.0, (5000, 3))) for _ in EYES]
    done = cancel_crosstalk(models, leaks, asked[0], asked[1])
    lowest, highest = model.limits
    for light, cost in ((done.left_linear, done.left), (done.right_linear, done.right)):
        assert np.isfinite(light).all()
        assert (light >= lowest - 1e-9).all()
        assert (light <= highest + 1e-9).all()
        assert np.isfinite([cost.delta_e_00_mean, cost.delta_e_00_max, cost.worst_residual_cd_m2]).all()
    # What both eyes can show with each other's leak is shown: solved without limits, it lies within them.
    solved = leaks.solve(*(part - model.shown_black_XYZ_cd_m2 for part in asked))
    inside = np.ones(5000, dtype=bool)
    for part in solved:
        linear = model.linear(part + model.shown_black_XYZ_cd_m2)
        inside &= np.all((linear >= lowest + 1e-6) & (linear <= highest - 1e-6), axis=1)
    codes = [model.code(model.xyz_of_linear(light)) for light in (done.left_linear, done.right_linear)]
    for seen, wanted in zip(seen_XYZ(models, leaks, *codes), asked, strict=True):
        assert np.abs(seen - wanted)[inside].max(initial=0.0) < 1e-6 * (1.0 + room)
    assert inside.any() or abs(share) > 0.4
    assert (done.left.negative > 0) == (share > 1e-3) or abs(share) < 1e-3


@pytest.mark.parametrize("share", [1.001, -1.001, 3.0, -3.0])
def test_leaks_beyond_their_bounds_are_refused(share: float) -> None:
    with pytest.raises(DeviceError):
        check_leakage(Crosstalk(share * np.eye(3), 0.01 * np.eye(3)), PRIMARIES, PRIMARIES)


@SOME
@given(models=eye_models(), room=ROOMS, bad=st.sampled_from([np.nan, np.inf, -np.inf]), seed=SEEDS)
def test_what_is_no_number_is_counted_and_refused_and_never_a_cost(
    models: EyeModels, room: float, bad: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    model = models.left.in_room(np.full(3, room))
    asked = model.xyz(rng.uniform(0.0, 1.0, (50, 3)))
    asked[rng.integers(50), rng.integers(3)] = bad
    with np.errstate(all="ignore"):
        assert model.clipping(asked).any_channel == 1
        for refuse in (
            lambda: clip_cost(model, asked),
            lambda: cancel_crosstalk(models, Crosstalk(0.02 * np.eye(3), 0.02 * np.eye(3)), asked, asked),
        ):
            with pytest.raises(DeviceError, match="finite"):
                refuse()


@SOME
@given(
    black=st.floats(1e-4, 5.0),
    room=st.floats(1e-6, 1e5),
    noise=st.sampled_from([0.0, 0.002, 0.01]),
    seed=SEEDS,
    lit=st.booleans(),
    said=st.booleans(),
)
def test_the_light_of_readings_is_found_wherever_it_matters(
    black: float, room: float, noise: float, seed: int, lit: bool, said: bool
) -> None:
    """Where it is taken wrongly, black and room differ by less than the noise of the black itself."""
    own = DisplayModel(black * np.array([0.9, 1.0, 1.2]), PRIMARIES, (ToneCurve(gamma=2.2),) * 3)
    file = own.in_room(room * np.array([0.95, 1.0, 1.09]))
    true = file if lit else own
    codes = np.repeat(np.linspace(0.0, 1.0, 9)[:, np.newaxis], 3, axis=1)
    light = true.xyz(codes) * (1.0 + noise * np.clip(np.random.default_rng(seed).standard_normal((9, 1)), -3, 3))
    found, words = in_light_of(Measurements(codes, light), file, file.ambient_XYZ_cd_m2 if said else None)
    right = np.array_equal(found.ambient_XYZ_cd_m2, true.ambient_XYZ_cd_m2)
    assert right or room <= 2.0 * 3.0 * noise * float(true.shown_black_XYZ_cd_m2[1])
    assert words
