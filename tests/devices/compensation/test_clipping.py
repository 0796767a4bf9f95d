"""What the gamut clip costs, for a picture of each eye and for one picture that both see."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.colour import delta_e_2000, xyz_to_lab
from devices.compensation import clip_marks, eye_clip_costs
from devices.compensation.clipping import clip_cost
from devices.compensation.eye_costs import mixed_costs
from devices.display import DisplayModel, EyeModels, ToneCurve, read_display
from devices.errors import DeviceError
from documents.arrays import Floats
from runner.presenter import ModeOptions, find_mode
from stimuli.pictures import StereoImage
from tests.kept import known

# What the gamut clip costs, against colour-science and by counting.
#
# Marks stand exactly where the ledger counts.

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


def test_marks_are_red_above_blue_below_and_grey_inside() -> None:
    model = _plain()
    linear = np.array([[[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]], [[-0.2, 0.5, 0.5], [1.5, -0.2, 0.5]]])
    codes = model.code(clip_marks(model, linear @ model.primaries_XYZ_cd_m2.T))
    assert np.allclose(codes[0, 1], [1, 0, 0], atol=1e-3)
    assert np.allclose(codes[1, 0], [0, 0, 1], atol=1e-3)
    assert np.allclose(codes[1, 1], [1, 0, 1], atol=1e-3)
    assert np.ptp(codes[0, 0]) < 1e-3
    assert 0.1 < codes[0, 0, 0] < 0.9


def test_as_many_marks_as_the_ledger_counts() -> None:
    model = _plain()
    linear = np.random.default_rng(0).uniform(-0.1, 1.2, (40, 50, 3))
    xyz = linear @ model.primaries_XYZ_cd_m2.T
    codes = model.code(clip_marks(model, xyz))
    marked = (np.ptp(codes, axis=-1) > 0.5).sum()
    assert marked == model.clipping(xyz).any_channel


# What one picture for both eyes costs each through its filter: against a pixel at a time, and by what must hold.
PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
BLACK = np.array([0.03, 0.03, 0.04])
RED, CYAN = (0.90, 0.05, 0.02), (0.03, 0.75, 0.80)


def _eyes_model(black: Floats = BLACK, primaries: Floats = PRIMARIES) -> DisplayModel:
    # Table 3.6's red, which at full drive gives 0.98 of its light.
    return DisplayModel(black, primaries, (ToneCurve(0.969, 0.0218, 1.8132), ToneCurve(gamma=2.2), ToneCurve(gamma=2)))


def _picture(model: DisplayModel, seed: int = 0) -> StereoImage:
    light = np.random.default_rng(seed).uniform(-0.02, 1.1, (2, 5, 6, 3))
    left, right = np.maximum(model.black_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T, 0.0).astype(np.float32)
    return StereoImage(left, right)


def _costs(models: EyeModels, image: StereoImage, **options: Any) -> Mapping[Any, dict[str, float]]:
    mixture = known(find_mode("anaglyph-red-cyan", ModeOptions.parse(options)).mixture(models))
    return mixed_costs(mixture, models, image.left, image.right, half=image.half)


def _eyes_slow(
    models: tuple[DisplayModel, DisplayModel], through: tuple[Floats, Floats], image: StereoImage
) -> tuple[Floats, Floats, Floats]:
    """Per eye and pixel: ΔE00 of the clip, ΔE00 of the projection; and per pixel and channel, whether it is clipped."""
    seen = [filtered @ model.primaries_XYZ_cd_m2 for filtered, model in zip(through, models, strict=True)]
    stacked = np.concatenate(seen)
    white = np.concatenate([model.primaries_XYZ_cd_m2.sum(axis=1) for model in models])
    full = np.linalg.lstsq(stacked, white, rcond=None)[0]
    clips, projections, outside = [], [], []
    for left, right in zip(image.left.reshape(-1, 3), image.right.reshape(-1, 3), strict=True):
        above = [asked - model.black_XYZ_cd_m2 for asked, model in zip((left, right), models, strict=True)]
        light = np.linalg.lstsq(stacked, np.concatenate(above), rcond=None)[0] / full
        curves = models[0].curves
        ends = np.array([[float(c.linear(code)) for c in curves] for code in (0.0, 1.0)])
        given = [float(c.linear(c.code(v))) for c, v in zip(curves, np.clip(light, *ends), strict=True)]
        clip, projection = [], []
        for asked, model, filtered in zip((left, right), models, through, strict=True):

            def eye(linear: Any, model: DisplayModel = model, filtered: Floats = filtered) -> Floats:
                return np.asarray(filtered @ (model.black_XYZ_cd_m2 + model.primaries_XYZ_cd_m2 @ np.asarray(linear)))

            eye_white = eye([1, 1, 1])
            wished = xyz_to_lab(np.maximum(eye(light), 0.0), eye_white)
            clip.append(delta_e_2000(wished, xyz_to_lab(eye(given), eye_white)))
            projection.append(delta_e_2000(xyz_to_lab(asked.astype(float), model.white_XYZ_cd_m2), wished))
        clips.append(clip)
        projections.append(projection)
        outside.append((light < ends[0] - 1e-6) | (light > ends[1] + 1e-6))
    return np.array(clips).T, np.array(projections).T, np.array(outside)


def _assert_alike(costs: Mapping[Any, dict[str, float]], slow: tuple[Floats, Floats, Floats]) -> None:
    clips, projections, outside = slow
    for cost, clip, projection in zip((costs["left"], costs["right"]), clips, projections, strict=True):
        assert cost["delta_e_00_mean"] == pytest.approx(clip.mean(), abs=2e-5)
        assert cost["delta_e_00_max"] == pytest.approx(clip.max(), abs=2e-4)
        assert cost["percent_noticed"] == pytest.approx(100 * (clip >= 1).mean(), abs=1e-3)
        assert cost["projection_delta_e_00_mean"] == pytest.approx(projection.mean(), abs=2e-5)
        assert cost["projection_delta_e_00_max"] == pytest.approx(projection.max(), abs=2e-4)
        assert cost["percent_any"] == pytest.approx(100 * outside.any(axis=1).mean(), abs=1e-3)
        assert cost["percent_green"] == pytest.approx(100 * outside[:, 1].mean(), abs=1e-3)
        assert clip.max() > 1 > clip.min()


def test_each_eye_s_costs_are_those_of_a_pixel_at_a_time() -> None:
    model = _eyes_model()
    image = _picture(model)
    inverse = np.linalg.inv(PRIMARIES)
    through = PRIMARIES @ np.diag(RED) @ inverse, PRIMARIES @ np.diag(CYAN) @ inverse
    _assert_alike(_costs(EyeModels(model, model), image), _eyes_slow((model, model), through, image))
    matrix = np.array([[0.8, 0.05, 0.0], [0.02, 0.5, 0.01], [0.0, 0.02, 0.1]])
    costs = _costs(EyeModels(model, model), image, left_filter=matrix.tolist())
    _assert_alike(costs, _eyes_slow((model, model), (matrix, through[1]), image))


def test_a_display_measured_through_each_filter_is_seen_as_it_was_measured() -> None:
    left, right = (
        _eyes_model(BLACK * 0.3, PRIMARIES * np.array(RED)),
        _eyes_model(BLACK * 0.6, PRIMARIES * np.array(CYAN)),
    )
    image = StereoImage(_picture(left, 1).left, _picture(right, 2).right)
    costs = _costs(EyeModels(left, right), image)
    _assert_alike(costs, _eyes_slow((left, right), (np.eye(3), np.eye(3)), image))
    swapped = _costs(EyeModels(right, left), StereoImage(image.right, image.left), swap_eyes=True)
    assert swapped == {"left": pytest.approx(costs["right"]), "right": pytest.approx(costs["left"])}


@pytest.mark.parametrize("split", ["least-squares", "channels"])
def test_a_grey_of_both_eyes_costs_nothing(split: str) -> None:
    model = _eyes_model(np.zeros(3))
    grey = StereoImage.flat((np.linspace(0.05, 0.95, 20)[None, :, None] * model.white_XYZ_cd_m2).astype(np.float32))
    for cost in _costs(EyeModels(model, model), grey, anaglyph=split).values():
        assert cost["percent_any"] == cost["delta_e_00_max"] == cost["percent_noticed"] == 0.0
        assert cost["projection_delta_e_00_max"] < 1e-3


def test_what_a_filter_stops_is_no_cost_to_its_eye() -> None:
    """Too much green, which is clipped, behind a filter that passes red only."""
    model = _eyes_model(np.zeros(3))
    light = np.full((4, 5, 3), 0.4)
    light[0, :, 1] = 1.4
    image = StereoImage.flat((light @ PRIMARIES.T).astype(np.float32))
    costs = _costs(
        EyeModels(model, model), image, anaglyph="channels", left_filter=[0.9, 0, 0], right_filter=[0, 0.8, 0.8]
    )
    assert [costs[eye]["percent_green"] for eye in ("left", "right")] == [25.0, 25.0]
    assert costs["left"]["delta_e_00_max"] == costs["left"]["percent_noticed"] == 0.0
    assert costs["right"]["delta_e_00_max"] > 5.0
    assert costs["right"]["percent_noticed"] == 25.0


def test_blocks_come_to_what_a_picture_at_once_does() -> None:
    models = EyeModels(_eyes_model(), _eyes_model())
    once = _picture(models.left)
    # Three blocks, whose edges fall within the picture that is repeated.
    many = StereoImage(*(np.tile(view, (15, 15, 1)) for view in (once.left, once.right)))
    small, large = _costs(models, once), _costs(models, many)
    for eye in ("left", "right"):
        assert large[eye] == pytest.approx(small[eye], abs=1.5e-5)  # a unit of the last place that is kept
        assert small[eye]["percent_noticed"] > 0.0


def test_the_unit_of_a_curve_changes_no_count() -> None:
    """Light from just full to 1e-5 of it beyond: what counts as outside is a part of a channel's own range."""
    counts = []
    for gain in (1.0, 4.0, 0.25):
        curve = ToneCurve(gain, gamma=2.0)
        model = DisplayModel(BLACK, PRIMARIES / gain**2, (curve, curve, curve))
        white = model.shown_white_XYZ_cd_m2 - BLACK
        asked = BLACK + np.linspace(1.0, 1.0 + 1e-5, 101)[:, np.newaxis] * white
        mixture = known(find_mode("anaglyph-red-cyan", ModeOptions.parse({})).mixture(EyeModels(model, model)))
        costs = mixed_costs(mixture, EyeModels(model, model), asked[np.newaxis], asked[np.newaxis])
        counts.append({key: costs["left"][key] for key in ("percent_any", "percent_red", "percent_blue")})
    assert 20 < counts[0]["percent_any"] < 95
    assert counts[1] == counts[0] == counts[2]
