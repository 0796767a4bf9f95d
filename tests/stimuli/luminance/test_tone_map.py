"""The largest factor that saturates no more than allowed, against bisection, and Table 4.3."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.display import DisplayModel, EyeModels, Plvc, TableCurve, ToneCurve, read_display
from stimuli.errors import StimulusError
from stimuli.luminance import picture_statistics, tone_mapping
from stimuli.luminance.saturation import largest_factor, measure_saturation, saturation_factors
from stimuli.pictures import StereoImage, XYZImage

DISPLAY = Path(__file__).parents[3] / "configs" / "displays" / "asus_vg248qe.yaml"
CURVES = (ToneCurve(gamma=2.2),) * 3


def thesis() -> DisplayModel:
    return read_display(DISPLAY).models("quad-buffered").left


def with_black(black: tuple[float, float, float] = (0.2, 0.21, 0.3), dimmed: float = 1.0) -> DisplayModel:
    return DisplayModel(np.array(black), thesis().primaries_XYZ_cd_m2 * dimmed, CURVES)


def sparkling(seed: int, shape: tuple[int, int] = (60, 80)) -> XYZImage:
    random = np.random.default_rng(seed)
    light = random.lognormal(0, 1.2, (*shape, 1)) * random.uniform(0.7, 1.3, (*shape, 3))
    return light.astype(np.float32)


def saturated_pixels_plain(xyz: XYZImage, model: DisplayModel, factor: float) -> int:
    """The slow obvious twin: transform the whole picture at this factor."""
    full = [float(curve.linear(1.0)) for curve in model.curves]
    return int((model.linear(xyz.astype(np.float64) * factor) > full).any(axis=-1).sum())


def largest_factor_by_bisection(xyz: XYZImage, model: DisplayModel, limit_percent: float) -> float:
    """The thesis's way: halve an interval of factors, transforming the picture each time."""
    pixels = xyz.size // 3

    def allowed(factor: float) -> bool:
        return saturated_pixels_plain(xyz, model, factor) <= limit_percent / 100 * pixels * (1 + 1e-12)

    low, high = 0.0, 1.0
    while allowed(high):
        high *= 2
    while high - low > 1e-13 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if allowed(middle) else (low, middle)
    return low


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0, 20), st.booleans())
def test_order_statistic_equals_bisection(seed: int, limit_percent: float, black: bool) -> None:
    xyz = sparkling(seed, (30, 40))
    model = with_black() if black else thesis()
    found = largest_factor(xyz, model, limit_percent)
    assert found.factor == pytest.approx(largest_factor_by_bisection(xyz, model, limit_percent), rel=1e-9)
    assert found.pixels_transformed == 1200
    count = saturated_pixels_plain(xyz, model, found.factor * (1 - 1e-9))
    assert count <= found.allowed_pixels < saturated_pixels_plain(xyz, model, found.factor * (1 + 1e-6))


def test_saturation_equals_the_display_model() -> None:
    xyz, model = sparkling(2), with_black()
    for factor in (0.3, 3.0, 30.0):
        counts = measure_saturation(xyz, model, factor)
        above = model.linear(xyz.astype(np.float64) * factor) > 1.0
        assert (counts.red, counts.green, counts.blue) == tuple(above.sum(axis=(0, 1)))
        assert counts.any_channel == above.any(axis=-1).sum()
        assert counts.percent_any == pytest.approx(100 * above.any(axis=-1).mean())


def test_counts_of_parts_add_up_to_those_of_the_whole() -> None:
    xyz, model = sparkling(2), with_black()
    first, second = (measure_saturation(part, model, 3.0) for part in np.array_split(xyz, 2))
    assert first + second == measure_saturation(xyz, model, 3.0)
    assert first.any_channel > 0 < second.any_channel


def test_pixels_that_never_saturate() -> None:
    black = np.zeros((4, 5, 3), np.float32)
    assert np.all(np.isinf(saturation_factors(black, thesis())))
    assert largest_factor(black, thesis(), 0.0).factor == math.inf
    one = black.copy()
    one[2, 3] = (20.0, 20.0, 20.0)
    assert np.isfinite(saturation_factors(one, thesis())).sum() == 1
    assert largest_factor(one, thesis(), 5.0).factor == math.inf
    assert math.isfinite(largest_factor(one, thesis(), 4.9).factor)
    assert largest_factor(one, thesis(), 100.0).factor == math.inf


def test_white_that_the_display_shows_is_not_saturated() -> None:
    model = thesis()
    white = np.broadcast_to(model.shown_white_XYZ_cd_m2, (5, 6, 3)).astype(np.float32)
    assert measure_saturation(white, model).any_channel == 0
    assert measure_saturation(white, model, 1.0001).any_channel == 30
    assert largest_factor(white, model, 0.0).factor == pytest.approx(1.0, abs=1e-6)
    # Linear light 1 of every channel, which red and blue do not reach.
    nominal = np.broadcast_to(model.white_XYZ_cd_m2, (5, 6, 3)).astype(np.float32)
    counts = measure_saturation(nominal, model)
    assert (counts.red, counts.green, counts.blue) == (30, 0, 30)


# Table 4.3


def table_4_3(max_luminance: float, red_at: float, red_percent: float) -> XYZImage:
    """A picture of 100,000 pixels whose maximum is given, and of which a share is at full red at a factor."""
    model = thesis()
    white = model.white_XYZ_cd_m2
    count = round(red_percent * 1000)
    full = np.array([model.limits[1][0], 0.5, 0.5]) @ model.primaries_XYZ_cd_m2.T
    xyz = np.tile(0.1 * white / red_at, (100_000, 1))
    # One pixel more than the share starts to saturate just above that factor, the others well below it.
    xyz[: count + 1] = full / red_at
    xyz[:count] *= 1.05
    xyz[0] = white / white[1] * max_luminance
    return xyz.reshape(200, 500, 3).astype(np.float32)


def test_images_1_2_and_3_2() -> None:
    """k = 104.7 / 205.3 = 0.51 for Image 1.1; for Image 3.1 6.69 is asked, and 1.78 saturates 0.3 % in red."""
    models = EyeModels(thesis(), thesis())
    # Of a long exposure's 15.65 cd/m² nothing saturates before the factor is well above 1.
    long = StereoImage.flat(table_4_3(15.65, 1.78, 0.300))
    mapped = tone_mapping(long, 104.7, models)
    assert mapped.asked_factor == pytest.approx(6.69, abs=0.005)
    assert mapped.held_back
    assert mapped.factor == pytest.approx(1.78, rel=1e-6)
    assert mapped.saturated["left"].to_json() == pytest.approx(
        {"red": 0.3, "green": 0.0, "blue": 0.0, "any": 0.3}, abs=2e-3
    )
    assert float(mapped.apply(long).left[..., 1].max()) == pytest.approx(27.85, abs=0.01)
    short = StereoImage.flat(table_4_3(205.3, 10.0, 0.158))
    mapped = tone_mapping(short, 104.7, models)
    assert not mapped.held_back
    assert mapped.factor == pytest.approx(0.51, abs=5e-5)
    assert float(mapped.apply(short).left[..., 1].max()) == pytest.approx(104.7, rel=1e-6)


# Both eyes


def test_one_factor_held_back_by_the_eye_that_saturates_first() -> None:
    left, right = sparkling(1), sparkling(1) * np.float32(1.4)
    models = EyeModels(with_black(), with_black(dimmed=0.9))
    mapped = tone_mapping(StereoImage(left, right), 1e4, models)
    each = [largest_factor(eye, model, 0.3).factor for eye, model in ((left, models.left), (right, models.right))]
    assert each[1] < 0.8 * each[0]
    assert mapped.factor == min(each)
    assert mapped.saturated["right"].any_channel == 14
    assert mapped.saturated["left"].any_channel < 14
    assert mapped.saturated_at_asked["left"].any_channel > 14
    shown = mapped.apply(StereoImage(left, right))
    np.testing.assert_allclose(shown.right, 1.4 * shown.left.astype(np.float64), rtol=5e-7)
    # Float32 rounds: the presenter's count has room for it.
    assert models.right.clipping(shown.right).above_full == 14


# What cannot be


@pytest.mark.parametrize("limit", [-1.0, 101.0, math.nan])
def test_limits_that_cannot_be(limit: float) -> None:
    with pytest.raises(StimulusError, match="share of saturated"):
        largest_factor(sparkling(1), thesis(), limit)


def test_a_dark_picture_or_a_display_without_room() -> None:
    dark = StereoImage.flat(np.zeros((3, 4, 3), np.float32))
    with pytest.raises(StimulusError, match="no factor brings"):
        tone_mapping(dark, 104.7, EyeModels(thesis(), thesis()))
    black: NDArray[np.float64] = -thesis().primaries_XYZ_cd_m2.sum(axis=1)
    with pytest.raises(StimulusError, match="black alone"):
        largest_factor(sparkling(1), DisplayModel(black, thesis().primaries_XYZ_cd_m2, CURVES), 0.3)


def test_full_light_that_half_floats_held_is_not_saturated() -> None:
    """Half floats round about half of full light up; 0.1 % more is counted all the same."""
    model = thesis()
    full = np.random.default_rng(7).uniform(0.2, 1.0, (2_000, 3))
    full[np.arange(2_000), np.arange(2_000) % 3] = 1.0
    xyz = model.xyz_of_linear(full * model.limits[1])
    stored = xyz.astype(np.float16).astype(np.float32)
    assert measure_saturation(stored, model).any_channel > 300
    assert measure_saturation(stored, model, half=True).any_channel == 0
    assert measure_saturation((1.02 * xyz).astype(np.float16).astype(np.float32), model, half=True).any_channel == 2_000
    image = StereoImage(*[stored.reshape(40, 50, 3)] * 2, half=True)
    statistics = picture_statistics(image, models=EyeModels(model, model)).eyes["left"]
    assert statistics.saturated is not None
    assert statistics.saturated.any_channel == 0


def test_pictures_of_many_blocks() -> None:
    xyz = sparkling(5, (700, 900))
    found = largest_factor(xyz, with_black(), 0.3)
    assert found.allowed_pixels == 1890
    onsets = saturation_factors(xyz, with_black())
    assert onsets.shape == (700, 900)
    assert found.factor == np.sort(onsets.ravel())[1890]


@pytest.mark.nightly
def test_channels_that_act_on_each_other_saturate_by_their_own_light() -> None:
    own = np.tile(thesis().primaries_XYZ_cd_m2.T[:, np.newaxis], (1, 4, 1))
    mixtures = np.zeros((10, 3))
    mixtures[:3] = [[-1.5, -1.4, -0.2], [-0.8, -0.5, -1.5], [-0.9, -1.2, -1.4]]
    table = TableCurve((0.0, 0.3, 1.0), (0.0, 0.07, 1.0))
    model = Plvc(np.array([0.02, 0.02, 0.03]), thesis().primaries_XYZ_cd_m2, (table, table, table), own, mixtures)
    xyz = sparkling(3, (40, 50))
    for limit in (0.0, 0.3, 5.0):
        found = largest_factor(xyz, model, limit)
        at, beyond = (saturated_pixels_plain(xyz, model, found.factor * (1 + off)) for off in (-1e-5, 1e-5))
        assert at <= found.allowed_pixels < beyond
        assert measure_saturation(xyz, model, found.factor).any_channel <= found.allowed_pixels
        assert found.pixels_transformed < 12 * 2000
    assert measure_saturation(xyz, model, 3.0).any_channel == saturated_pixels_plain(xyz, model, 3.0)
    assert largest_factor(np.zeros((4, 5, 3), np.float32), model, 0.0).factor == math.inf


def test_a_limit_in_whole_pixels() -> None:
    """0.3 % of 1000 pixels are three of them, and a channel that is just full is not saturated."""
    white = thesis().shown_white_XYZ_cd_m2
    xyz = (white * np.linspace(0.001, 1.0, 1000)[:, None]).astype(np.float32)[None]
    found = largest_factor(xyz, thesis(), 0.3)
    assert found.allowed_pixels == 3
    assert found.factor == pytest.approx(1 / 0.997, rel=1e-6)


def test_a_flat_picture_on_one_model_is_transformed_once() -> None:
    one = sparkling(1)
    model = thesis()
    assert tone_mapping(StereoImage.flat(one), 50.0, EyeModels(model, model)).pixels_transformed == 4800
    both = tone_mapping(StereoImage.flat(one), 50.0, EyeModels(model, with_black()))
    assert both.pixels_transformed == 9600


def test_the_step_says_both_factors_and_is_json() -> None:
    mapped = tone_mapping(StereoImage.flat(sparkling(1)), 1e4, EyeModels(thesis(), thesis()))
    step = json.loads(json.dumps(mapped.to_json(), allow_nan=False))
    assert step["asked_luminance_scale"] > step["luminance_scale"] > 0
    assert step["held_back"] is True
    assert step["saturated_percent"]["left"]["any"] <= 0.3 < step["saturated_percent_at_asked"]["right"]["any"]
