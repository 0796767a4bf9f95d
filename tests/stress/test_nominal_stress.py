"""What displays can show at extremes: nominal ones, lit rooms, leaks and gain maps, and the error budget."""

from __future__ import annotations

import itertools
from typing import get_args

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.budget import Encoding, OwnPixels, PathStep
from devices.colour import delta_e_2000, xyz_to_lab
from devices.compensation import cancel_crosstalk, dither_thresholds, needed_lift
from devices.compensation.clipping import clip_cost
from devices.compensation.crosstalk_cancel import seen_XYZ
from devices.compensation.dither import dither_tables, tabled_dither_codes
from devices.diagnostics.room_light import in_light_of
from devices.display import (
    EYES,
    Crosstalk,
    DisplayModel,
    EyeModels,
    GainMap,
    Nominal,
    NominalKind,
    ReportedMonitor,
    ToneCurve,
    check_leakage,
    panel_of_monitor,
)
from devices.errors import DeviceError
from devices.readings import Measurements
from documents import InputError
from documents.arrays import Floats
from runner import Picture, Scene
from runner.presenter import MODES, Presenter, find_mode, open_surface
from runner.presenter.depth import Bits, highest_code
from stimuli.pictures import StereoImage
from tests.displays import corrections, display_models, eye_models
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress


# Nominal displays at extremes: whites from moonlight to a searchlight, any black below, every kind, mode and depth.

KINDS = get_args(NominalKind)
WHITES = (1e-4, 0.08, 80.0, 10_000.0, 1e7)
SHARES = (0.0, 1e-9, 0.001, 0.2, 0.99)
KEEPS = [n for n, m in MODES.items() if not m.needs_stereo and "half" not in n and "anaglyph" not in n]
MANY = settings(max_examples=500, suppress_health_check=list(HealthCheck), deadline=None)


def _codes(seed: int, highest: int) -> NDArray[np.int64]:
    """Return all grey levels and colours at random, (128, 128, 3)."""
    rng = np.random.default_rng(seed)
    colours = rng.integers(0, highest + 1, (128 * 128, 3))
    colours[: highest + 1] = np.arange(highest + 1)[:, np.newaxis]
    return colours.reshape(128, 128, 3)


def _same(
    shown: NDArray[np.integer], asked: NDArray[np.int64], kind: NominalKind, bits: Bits, model: DisplayModel
) -> bool:
    """Return whether codes are the same; of 10 bits a power curve's darkest, as far as a picture in float32 holds them.

    Code 1 of 1023 at a gamma of 2.2 is 2.4e-7 of white: beside a bright channel, what float32 rounds away. sRGB and
    Display P3 begin with a straight line, and are exact.
    """
    if bits == 8 or kind in ("srgb", "display-p3"):
        return np.array_equal(shown, asked)
    light = [model.curves[0].linear(codes / highest_code(bits)) for codes in (shown, asked)]
    off = shown != asked
    return bool(np.abs(light[0] - light[1])[off].max(initial=0.0) <= 2.0**-21 and off.mean() < 0.01)


@pytest.mark.parametrize("bits", [8, 10])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", KEEPS)
def test_every_code_of_every_kind_comes_back_in_every_mode(mode: str, kind: NominalKind, bits: Bits) -> None:
    highest = highest_code(bits)
    left, right = _codes(1, highest), _codes(2, highest)
    with open_surface("egl", (512, 256), windows=2, bits=bits) as surface:
        if surface.bits != bits:
            pytest.skip(f"the driver gives {surface.bits} bits")
        for white in WHITES:
            for share in SHARES:
                model = Nominal.of(kind, white, share * white).model()
                pictures = [model.xyz(codes / highest).astype(np.float32) for codes in (left, right)]
                image = StereoImage.flat(pictures[0]) if mode == "flat" else StereoImage(*pictures)
                load = {"codes": image}.__getitem__
                with Presenter(surface, find_mode(mode), EyeModels(model, model), load) as presenter:
                    presenter.show(Scene((Picture("codes"),)))
                    for eye in EYES:
                        area = next(area for area in presenter.areas if eye in area.eyes)
                        view = presenter.eye_view(eye)
                        mine = np.ones(view.shape[:2], bool)
                        if area.weave is not None:
                            mine = area.weave.mask(*view.shape[:2])
                        top, first = ((v - 128) // 2 for v in view.shape[:2])
                        inside = slice(top, top + 128), slice(first, first + 128)
                        asked = left if eye == "left" or mode == "flat" else right
                        assert _same(view[inside][mine[inside]], asked[mine[inside]], kind, bits, model)


@MANY
@given(
    kind=st.sampled_from(KINDS),
    white=st.floats(1e-6, 1e9),
    share=st.floats(0.0, 0.999999),
    code=st.tuples(*[st.floats(0.0, 1.0)] * 3),
)
def test_light_runs_from_black_to_white_and_codes_do_not_depend_on_black(
    kind: NominalKind, white: float, share: float, code: tuple[float, float, float]
) -> None:
    nominal = Nominal.of(kind, white, share * white)
    model, light = nominal.model(), nominal.light_model()
    assert light.shown_white_XYZ_cd_m2[1] == pytest.approx(white, rel=1e-9)
    assert light.shown_black_XYZ_cd_m2[1] == pytest.approx(share * white, rel=1e-9, abs=1e-12 * white)
    assert model.shown_white_XYZ_cd_m2[1] == pytest.approx(white, rel=1e-9)
    expected = nominal.black_XYZ_cd_m2 + (1 - share) * model.xyz(code)
    assert np.abs(light.xyz(code) - expected).max() <= 1e-9 * white
    # Where the curve is flat, as beside 0, many codes give one light.
    assert np.abs(model.xyz(model.code(model.xyz(code))) - model.xyz(code)).max() <= 1e-9 * white
    assert not model.clipping(model.xyz(code).astype(np.float32)).any_channel


@MANY
@given(
    size_px=st.tuples(st.integers(-1, 20_000), st.integers(-1, 20_000)),
    size_mm=st.tuples(st.integers(-1, 20_000), st.integers(-1, 20_000)),
    refresh_hz=st.sampled_from([None, 0.0, 23.976, 60.0, 480.0]),
)
def test_whatever_a_monitor_reports_gives_a_panel_or_one_clear_refusal(
    size_px: tuple[int, int], size_mm: tuple[int, int], refresh_hz: float | None
) -> None:
    try:
        panel = panel_of_monitor(ReportedMonitor("any", size_px, size_mm, refresh_hz))
    except InputError as error:
        (finding,) = error.findings
        assert "pixel_pitch_mm" in (finding.remedy or "")
        return
    assert panel.resolution_px == size_px
    widths = [mm / px for mm, px in zip(size_mm, size_px, strict=True)]
    assert 0.9 * min(widths) <= panel.pixel_pitch_mm <= 1.1 * max(widths)


# What displays can show at extremes: rooms from none to sunlight, curves lifted to 0.9, leaks at their bounds.

LIMITS_MANY = settings(max_examples=300, suppress_health_check=list(HealthCheck), deadline=None)
SOME = settings(LIMITS_MANY, max_examples=60)
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


@LIMITS_MANY
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


@LIMITS_MANY
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


@LIMITS_MANY
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


# Crosstalk, gain maps and dithering at their edges: hardly any light, far too much, and systems hard to undo.

DEVICES_PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
PERIOD = dither_thresholds(64, 64)


def _model(curve: ToneCurve, black: float = 0.0) -> DisplayModel:
    return DisplayModel(black * np.array([0.95, 1.0, 1.2]), DEVICES_PRIMARIES, (curve, curve, curve))


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


# The error budget on displays drawn at random, of every kind of curve, in lit rooms, with leaks and uneven panels.
@given(models=eye_models(), data=st.data())
@settings(max_examples=how_many(30, 150), suppress_health_check=list(HealthCheck), deadline=None)
def test_finer_tables_and_codes_never_cost_more_and_touch_no_other_step(models: EyeModels, data: st.DataObject) -> None:
    """Beyond the gamut, in the dark and at every light between: finite, at least 0, and each step by itself."""
    correction = data.draw(corrections((96, 64), lifts=models.left.additive and models.right.additive))
    dithered = data.draw(st.booleans())
    rng = np.random.default_rng(data.draw(st.integers(0, 2**31)))
    gains = None if correction.gain_map is None else rng.uniform(0.6, 1.1, 800)
    light = rng.uniform(-0.1, 1.2, (800, 3)) * 10.0 ** rng.uniform(-6.0, 0.0, (800, 1))
    asked = {eye: np.maximum(models.eye(eye).xyz_of_linear(light), 0.0) for eye in EYES}

    def costs(levels: int, entries: int) -> dict[PathStep, float]:
        path = OwnPixels(models, Encoding(levels, entries, dithered), correction, gains)
        found = path.differences(asked)
        assert all(np.isfinite(eyes[eye]).all() and (eyes[eye] >= 0.0).all() for eyes in found.values() for eye in EYES)
        return {step: float(np.mean([eyes[eye].mean() for eye in EYES])) for step, eyes in found.items()}

    fine, coarse_codes, coarse_table = costs(1023, 2048), costs(63, 2048), costs(1023, 16)
    assert coarse_codes[PathStep.CODES] >= fine[PathStep.CODES]
    assert coarse_table[PathStep.LOOK_UP_TABLE] >= fine[PathStep.LOOK_UP_TABLE] - 1e-9
    others = fine.keys() - {PathStep.CODES, PathStep.LOOK_UP_TABLE, PathStep.TOGETHER}
    assert all(fine[step] == coarse_codes[step] == coarse_table[step] for step in others)
