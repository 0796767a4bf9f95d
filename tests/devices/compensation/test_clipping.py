"""What the gamut clip costs, against colour-science and by counting.

Marks stand exactly where the ledger counts.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.colour import delta_e_2000, xyz_to_lab
from devices.compensation import clip_marks, eye_clip_costs
from devices.compensation.clipping import clip_cost
from devices.display import DisplayModel, ToneCurve, read_display
from devices.errors import DeviceError

ASUS = Path(__file__).parents[3] / "configs/displays/asus_vg248qe.yaml"


def _plain() -> DisplayModel:
    curve = ToneCurve(gamma=2.2)
    return DisplayModel(np.zeros(3), np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]]), (curve, curve, curve))


def test_a_picture_inside_the_gamut_costs_nothing() -> None:
    model = _plain()
    linear = np.random.default_rng(0).uniform(0.01, 0.99, (50, 40, 3))
    cost = clip_cost(model, linear @ model.primaries_XYZ_cd_m2.T)
    assert (cost.delta_e_00_mean, cost.delta_e_00_max, cost.clipping.any_channel) == (0.0, 0.0, 0)
    assert cost.clipping.pixels == 2000


def test_the_cost_is_the_ciede2000_of_asked_and_shown() -> None:
    colour = pytest.importorskip("colour", reason="colour-science is the oracle")
    model = _plain()
    linear = np.random.default_rng(1).uniform(-0.05, 1.4, (300, 3))
    asked = np.maximum(linear @ model.primaries_XYZ_cd_m2.T, 0.0)
    shown = np.clip(model.linear(asked), 0, 1) @ model.primaries_XYZ_cd_m2.T
    white = model.white_XYZ_cd_m2

    def lab(xyz: np.ndarray) -> np.ndarray:
        return np.asarray(colour.XYZ_to_Lab(xyz / white[1], colour.XYZ_to_xy(white)))

    expected = np.asarray(colour.delta_E(lab(asked), lab(shown), method="CIE 2000"))
    cost = clip_cost(model, asked)
    assert cost.delta_e_00_mean == pytest.approx(expected.mean(), abs=1e-6)
    assert cost.delta_e_00_max == pytest.approx(expected.max(), abs=1e-6)
    assert cost.clipping.any_channel == np.count_nonzero(
        ((model.linear(asked) < -1e-6) | (model.linear(asked) > 1 + 1e-6)).any(axis=1)
    )


def test_light_that_a_channel_s_full_drive_does_not_reach_is_a_cost() -> None:
    """Table 3.6's red gives 0.98 of its light at full drive; asked for 1 it falls short, and counts."""
    model = read_display(ASUS).models("side-by-side").left
    cost = clip_cost(model, model.primaries_XYZ_cd_m2[:, 0])
    assert (cost.clipping.red, cost.clipping.green, cost.clipping.above_full) == (1, 0, 1)
    assert cost.delta_e_00_max > 0.1
    white = clip_cost(model, model.white_XYZ_cd_m2)
    assert white.clipping.any_channel == 1
    assert white.delta_e_00_max == pytest.approx(1.17, abs=0.01)
    assert clip_cost(model, model.shown_white_XYZ_cd_m2).delta_e_00_max < 1e-6


def test_a_cost_comes_with_a_count() -> None:
    """A grey of 0.5 cd/m² on a CRT whose offsets shine at code 0: it was counted as shown, at ΔE00 above 10."""
    curve = ToneCurve(0.75, 0.25, 2.2)
    model = DisplayModel(np.zeros(3), _plain().primaries_XYZ_cd_m2, (curve, curve, curve))
    white = model.white_XYZ_cd_m2
    cost = clip_cost(model, np.broadcast_to(0.5 / white[1] * white, (4, 5, 3)))
    assert cost.to_json()["percent_any"] == 100.0
    assert cost.to_json()["percent_above_full"] == 0.0
    assert cost.delta_e_00_mean > 10.0


@settings(max_examples=12)
@given(st.integers(0, 2**32 - 1))
def test_what_costs_is_what_counts(seed: int) -> None:
    rng = np.random.default_rng(seed)
    curves = [ToneCurve(*rng.uniform((0.7, -0.1, 1.4, -0.01), (1.1, 0.25, 2.6, 0.03))) for _ in range(3)]
    model = DisplayModel(np.full(3, 0.05), _plain().primaries_XYZ_cd_m2, (curves[0], curves[1], curves[2]))
    asked = (rng.uniform(0.0, 1.15, (15, 3)) ** 2) * model.shown_white_XYZ_cd_m2
    for pixel in asked.astype(np.float32):
        cost = clip_cost(model, pixel)
        assert (cost.delta_e_00_max > 1e-3) <= (cost.clipping.any_channel == 1)
        shown = model.xyz(model.code(pixel))
        assert (cost.clipping.any_channel == 1) == (np.abs(shown - pixel).max() > 3e-4)


def test_leaving_out_the_pixels_shown_as_asked_changes_nothing() -> None:
    model = read_display(ASUS).models("side-by-side").left
    linear = np.random.default_rng(2).uniform(-0.02, 1.1, (2000, 3)) ** 3
    asked = np.maximum(linear @ model.primaries_XYZ_cd_m2.T, 0.0)
    white = model.white_XYZ_cd_m2
    everywhere = delta_e_2000(xyz_to_lab(asked, white), xyz_to_lab(model.xyz(model.code(asked)), white))
    cost = clip_cost(model, asked)
    assert cost.delta_e_00_mean == pytest.approx(everywhere.mean(), abs=1e-9)
    assert cost.delta_e_00_max == pytest.approx(everywhere.max(), abs=1e-9)


def _slow(model: DisplayModel, xyz_cd_m2: np.ndarray) -> tuple[float, float, tuple[int, ...]]:
    """Mean and maximum ΔE00 and the counts, of all pixels at once."""
    asked = np.asarray(xyz_cd_m2, dtype=np.float64).reshape(-1, 3)
    linear = model.linear(asked)
    lowest = [float(curve.linear(0.0)) for curve in model.curves]
    highest = [float(curve.linear(1.0)) for curve in model.curves]
    changed = ((linear < lowest) | (linear > highest)).any(axis=1)
    white = model.white_XYZ_cd_m2
    difference = delta_e_2000(
        xyz_to_lab(np.maximum(asked, 0.0), white), xyz_to_lab(model.xyz(model.code(asked)), white)
    )
    counted = model.clipping(asked)
    counts = counted.pixels, counted.red, counted.green, counted.blue, counted.any_channel, counted.above_full
    cost = np.where(changed, difference, 0.0)
    return float(cost.mean()), float(cost.max()), counts


def _lifted() -> DisplayModel:
    """A display whose red has light at code 0, and whose blue does not reach full."""
    curves = ToneCurve(0.98, 0.0, 2.2, 0.01), ToneCurve(gamma=2.2), ToneCurve(0.96, 0.02, 1.8)
    return DisplayModel(np.full(3, 0.03), _plain().primaries_XYZ_cd_m2, curves)


@pytest.mark.parametrize("model", [_plain(), _lifted(), read_display(ASUS).models("side-by-side").left])
@pytest.mark.parametrize("spread", [0.0, 0.02, 0.7])
def test_blocks_come_to_what_all_pixels_at_once_do(model: DisplayModel, spread: float) -> None:
    rng = np.random.default_rng(int(100 * spread))
    # Three blocks: too little light is asked for in two, too much in the last, and the rest of each is within limits.
    linear = rng.uniform(0.02, 0.9, (20_000, 3))
    linear[8_000:9_000] = rng.uniform(-0.05 - spread, 0.5, (1_000, 3))
    linear[17_000:] = rng.uniform(0.5, 1.02 + spread, (3_000, 3))
    asked = (model.black_XYZ_cd_m2 + linear @ model.primaries_XYZ_cd_m2.T).astype(np.float32).reshape(100, 200, 3)
    cost = clip_cost(model, asked)
    mean, most, counts = _slow(model, asked)
    clipping = cost.clipping
    found = clipping.pixels, clipping.red, clipping.green, clipping.blue, clipping.any_channel, clipping.above_full
    assert found == counts
    # Sums in another order.
    assert cost.delta_e_00_mean == pytest.approx(mean, rel=1e-12)
    assert cost.delta_e_00_max == pytest.approx(most, rel=1e-9)
    assert mean > 0.0


def test_no_pixels_cost_nothing() -> None:
    cost = clip_cost(_plain(), np.zeros((0, 3)))
    assert (cost.clipping.pixels, cost.delta_e_00_mean, cost.delta_e_00_max) == (0, 0.0, 0.0)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_no_light_counts_as_outside_and_has_no_cost(bad: float) -> None:
    model = _plain()
    picture = np.full((20_000, 3), 5.0)
    picture[15_000, 1] = bad
    assert model.clipping(picture).any_channel == 1
    with pytest.raises(DeviceError, match="hold 1 value not finite"):
        clip_cost(model, picture)


@pytest.mark.parametrize("model", [_plain(), read_display(ASUS).models("side-by-side").left])
def test_half_floats_near_black_are_no_light_that_is_missing(model: DisplayModel) -> None:
    """Stored as half floats, half of the colours just above black, or of one channel, lie just below it."""
    dark = np.random.default_rng(4).uniform(0.0, 0.05, (5_000, 3)) * np.eye(3)[np.arange(5_000) % 3]
    stored = model.xyz_of_linear(model.limits[0] + dark).astype(np.float16).astype(np.float32)
    assert clip_cost(model, stored).clipping.any_channel > 1_000
    cost = clip_cost(model, stored, half=True)
    assert cost.clipping.any_channel == model.clipping(stored, half=True).any_channel == 0
    assert cost.delta_e_00_max < 0.05


def test_what_half_floats_cannot_have_rounded_still_counts() -> None:
    model = _plain()
    linear = np.random.default_rng(5).uniform(0.1, 0.9, (3_000, 3))
    linear[:1_000, 0], linear[1_000:2_000, 2] = -0.02, 1.02
    stored = model.xyz_of_linear(linear).astype(np.float16).astype(np.float32)
    cost = clip_cost(model, stored, half=True)
    assert (cost.clipping.red, cost.clipping.blue, cost.clipping.any_channel) == (1_000, 1_000, 2_000)
    marks = clip_marks(model, stored, model.tolerance(stored, half=True))
    light = model.in_primaries(marks) > 0.5
    assert light[:1_000, 2].all()
    assert light[1_000:2_000, 0].all()


def test_each_eye_s_cost_knows_half_floats() -> None:
    models = read_display(ASUS).models("side-by-side")
    dark = np.random.default_rng(6).uniform(0, 0.05, (20, 20, 3)) * np.eye(3)[0]
    stored = models.left.xyz_of_linear(models.left.limits[0] + dark).astype(np.float16).astype(np.float32)
    assert eye_clip_costs(models, None, stored, stored)["left"]["percent_any"] > 20
    assert eye_clip_costs(models, None, stored, stored, half=True)["left"]["percent_any"] == 0


def _model() -> DisplayModel:
    curve = ToneCurve(gamma=2.2)
    return DisplayModel(np.zeros(3), np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]]), (curve, curve, curve))


def test_marks_are_red_above_blue_below_and_grey_inside() -> None:
    model = _model()
    linear = np.array([[[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]], [[-0.2, 0.5, 0.5], [1.5, -0.2, 0.5]]])
    codes = model.code(clip_marks(model, linear @ model.primaries_XYZ_cd_m2.T))
    assert np.allclose(codes[0, 1], [1, 0, 0], atol=1e-3)
    assert np.allclose(codes[1, 0], [0, 0, 1], atol=1e-3)
    assert np.allclose(codes[1, 1], [1, 0, 1], atol=1e-3)
    assert np.ptp(codes[0, 0]) < 1e-3
    assert 0.1 < codes[0, 0, 0] < 0.9


def test_as_many_marks_as_the_ledger_counts() -> None:
    model = _model()
    linear = np.random.default_rng(0).uniform(-0.1, 1.2, (40, 50, 3))
    xyz = linear @ model.primaries_XYZ_cd_m2.T
    codes = model.code(clip_marks(model, xyz))
    marked = (np.ptp(codes, axis=-1) > 0.5).sum()
    assert marked == model.clipping(xyz).any_channel
