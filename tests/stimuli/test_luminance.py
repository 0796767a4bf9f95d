"""Factors and statistics of luminance, as thesis Table 4.3 has them."""

from __future__ import annotations

import csv
import json
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.colour import xyY_from_XYZ
from devices.display import DisplayModel, EyeModels, Plvc, TableCurve, ToneCurve, read_display
from stimuli.errors import StimulusError
from stimuli.luminance import (
    factor_to,
    mean_luminance_cd_m2,
    picture_statistics,
    scaled_picture,
    tone_mapping,
    white_luminance_cd_m2,
)
from stimuli.luminance.saturation import largest_factor, measure_saturation
from stimuli.luminance.scale import factor_series, grey_picture, greyscale, max_luminance_cd_m2, scaled
from stimuli.luminance.statistics import DynamicRange, _ends, _mean_and_deviation
from stimuli.pictures import StereoImage, XYZImage
from stimuli.sparkles import PixelScale, SparkleThreshold
from tests.kept import known

# The largest factor that saturates no more than allowed, against bisection, and Table 4.3.

DISPLAY = Path(__file__).parents[2] / "configs" / "displays" / "asus_vg248qe.yaml"
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
    assert largest_factor(black, thesis(), 0.0).factor == math.inf
    one = black.copy()
    one[2, 3] = (20.0, 20.0, 20.0)
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
    assert known(statistics.saturated).any_channel == 0


@pytest.mark.nightly
def test_pictures_of_many_blocks() -> None:
    xyz = sparkling(5, (700, 900))
    found = largest_factor(xyz, with_black(), 0.3)
    assert found.allowed_pixels == 1890
    assert found.factor == pytest.approx(largest_factor_by_bisection(xyz, with_black(), 0.3), rel=1e-9)


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


# One factor for a picture: what it changes, and what it must leave alone.
def pixels(seed: int, rows: int = 30, columns: int = 40) -> XYZImage:
    return np.random.default_rng(seed).uniform(0.01, 100, (rows, columns, 3)).astype(np.float32)


@pytest.fixture
def pair() -> StereoImage:
    return StereoImage(pixels(1), pixels(2) * np.float32(1.5))


def test_target_mean_over_both_eyes_with_one_factor(pair: StereoImage) -> None:
    factor = factor_to(mean_luminance_cd_m2(pair), 5.0)
    shown = scaled_picture(pair, factor)
    means = [float(eye[..., 1].mean(dtype=np.float64)) for eye in (shown.left, shown.right)]
    assert np.mean(means) == pytest.approx(5.0, rel=1e-6)
    was = [float(eye[..., 1].mean(dtype=np.float64)) for eye in (pair.left, pair.right)]
    assert means[1] / means[0] == pytest.approx(was[1] / was[0], rel=1e-6)
    assert abs(means[1] - means[0]) > 1


def test_target_white_by_a_white_photographed_along(pair: StereoImage) -> None:
    pair.left[5:9, 10:16] = pair.right[5:9, 10:16] = (95, 100, 108)
    pair.left[5, 10] = 7  # dust
    factor = factor_to(white_luminance_cd_m2(pair, (5, 10, 4, 6)), 26.47)
    np.testing.assert_allclose(scaled_picture(pair, factor).right[6, 12, 1], 26.47, rtol=1e-6)


@pytest.mark.parametrize("box", [(-1, 0, 2, 2), (0, 0, 0, 1), (29, 0, 2, 2), (0, 39, 1, 2)])
def test_a_white_outside_the_picture(pair: StereoImage, box: tuple[int, int, int, int]) -> None:
    with pytest.raises(StimulusError, match="does not lie in the picture"):
        white_luminance_cd_m2(pair, box)


@given(st.floats(1e-6, 1e6), st.integers(0, 2**32 - 1))
def test_chromaticity_is_kept_whatever_the_factor(factor: float, seed: int) -> None:
    before = pixels(seed, 3, 4)
    after = scaled(before, factor)
    assert after.dtype == np.float32
    np.testing.assert_allclose(xyY_from_XYZ(after)[..., :2], xyY_from_XYZ(before)[..., :2], rtol=0, atol=1e-6)
    np.testing.assert_allclose(after, before.astype(np.float64) * factor, rtol=2e-7)


@given(st.floats(0.05, 0.6), st.floats(0.05, 0.39), st.integers(0, 2**32 - 1))
def test_grey_keeps_luminance_and_has_one_chromaticity(x: float, y: float, seed: int) -> None:
    before = pixels(seed, 3, 4)
    after = greyscale(before, (x, y))
    np.testing.assert_array_equal(after[..., 1], before[..., 1])
    np.testing.assert_allclose(xyY_from_XYZ(after)[..., :2], np.broadcast_to((x, y), (3, 4, 2)), rtol=0, atol=1e-6)


@pytest.mark.parametrize("factor", [0.0, -1.0, math.nan, math.inf, 1e300, 1e38])
def test_factors_that_cannot_be(pair: StereoImage, factor: float) -> None:
    with pytest.raises(StimulusError, match="luminance factor"):
        scaled_picture(pair, factor)


@pytest.mark.parametrize(
    ("luminance", "target"), [(0.0, 5.0), (-1.0, 5.0), (math.nan, 5.0), (5.0, 0.0), (5.0, math.nan)]
)
def test_targets_that_cannot_be(luminance: float, target: float) -> None:
    with pytest.raises(StimulusError, match="cd/m²"):
        factor_to(luminance, target)


@pytest.mark.parametrize("white", [(0.3, 0.0), (-0.1, 0.5), (0.7, 0.5), (math.nan, 0.3)])
def test_whites_that_cannot_be(white: tuple[float, float]) -> None:
    with pytest.raises(StimulusError, match="chromaticity"):
        greyscale(pixels(1), white)


def test_series_of_factors() -> None:
    assert factor_series(33, 2) == pytest.approx((1.0, 1.33))
    assert factor_series(-50, 3, 4.0) == pytest.approx((4.0, 2.0, 1.0))
    for step, count, first in ((33, 0, 1.0), (-100, 2, 1.0), (10, 2, 0.0), (math.nan, 2, 1.0)):
        with pytest.raises(StimulusError, match="no series"):
            factor_series(step, count, first)


def test_flat_pictures_stay_flat() -> None:
    flat = StereoImage.flat(pixels(3))
    assert scaled_picture(flat, 2.0).is_flat
    assert grey_picture(flat, (0.3127, 0.329)).is_flat


def test_maximum_is_of_either_eye(pair: StereoImage) -> None:
    assert max_luminance_cd_m2(pair) == max(pair.left[..., 1].max(), pair.right[..., 1].max())


# The columns of Table 4.3 against plain calculation.


@pytest.fixture(scope="module")
def models() -> EyeModels:
    return read_display(DISPLAY).models("quad-buffered")


@pytest.fixture(scope="module")
def statistics_pair() -> StereoImage:
    random = np.random.default_rng(7)
    grain = random.uniform(2, 3, (2, 120, 160, 1)) * np.array([0.95, 1.0, 1.05])
    for eye, count in enumerate((9, 5)):
        places = 12 + 24 * np.arange(count)
        grain[eye, places % 110 + 3, places % 150 + 3] = [38, 40, 42]
    left, right = grain.astype(np.float32)
    return StereoImage(left, right)


def test_statistics_equal_plain_calculation(statistics_pair: StereoImage, models: EyeModels) -> None:
    told = picture_statistics(
        statistics_pair, models, exposure_s=1 / 15, luminance_scale=0.51, threshold=SparkleThreshold()
    )
    assert (told.exposure_s, told.luminance_scale) == (1 / 15, 0.51)
    for eye, xyz, count in (("left", statistics_pair.left, 9), ("right", statistics_pair.right, 5)):
        one = told.eyes["left" if eye == "left" else "right"]
        light = xyz[..., 1].astype(np.float64)
        assert one.mean_cd_m2 == pytest.approx(light.mean(), rel=1e-12)
        assert one.max_cd_m2 == light.max() == 40
        assert one.rms_contrast == pytest.approx(light.std() / light.mean(), rel=1e-9)
        assert one.dynamic_range.ratio == pytest.approx(light.max() / light.min())
        assert (one.robust_range.low_cd_m2, one.robust_range.high_cd_m2) == tuple(
            np.percentile(light, [0.1, 99.9], method="nearest")
        )
        assert one.robust_range.high_cd_m2 < 3.1
        assert known(one.saturated).any_channel == count
        assert known(one.sparkles).count.value == count
        assert known(one.sparkles).contrast.value == pytest.approx(40 / np.median(light) - 1, rel=0.02)


def test_a_flat_picture_is_looked_at_once(statistics_pair: StereoImage, models: EyeModels) -> None:
    told = picture_statistics(StereoImage.flat(statistics_pair.left), models)
    assert told.eyes["left"] is told.eyes["right"]
    assert told.eyes["left"].sparkles is None


def test_the_manifest_holds_no_infinity(models: EyeModels) -> None:
    dark = np.zeros((20, 20, 3), np.float32)
    told = picture_statistics(
        StereoImage.flat(dark), models, threshold=SparkleThreshold(0, 1), scale=PixelScale(10, 50)
    )
    text = json.dumps(told.to_json(), allow_nan=False)
    assert json.loads(text)["eyes"]["left"]["dynamic_range"]["stops"] == 0
    dark[3, 4] = 1
    told = picture_statistics(StereoImage.flat(dark), models)
    assert told.to_json()["eyes"]["left"]["dynamic_range"]["stops"] is None
    assert told.eyes["left"].dynamic_range.ratio == math.inf


@pytest.mark.parametrize("size", [1, 63, 64, 501, 12345])
@pytest.mark.parametrize("kind", ["random", "even", "steps", "rising", "one sample of it the most"])
def test_the_ends_are_those_of_all_values_sorted(size: int, kind: str) -> None:
    rng = np.random.default_rng(size)
    values = {
        "random": rng.random(size) ** 3,
        "even": np.full(size, 2.5),
        "steps": rng.integers(0, 3, size),
        "rising": np.arange(size),
        "one sample of it the most": np.where(np.arange(size) == (size - 1) // 64 * 64, size, np.arange(size)),
    }[kind].astype(np.float32)
    low, high = np.percentile(values, (0.1, 99.9), method="nearest")
    assert _ends(values) == (values.min(), low, high, values.max())


@pytest.mark.parametrize("shape", [(1, 1), (31, 7), (32, 9), (100, 257)])
@pytest.mark.parametrize("offset", [0.0, 1e4])
def test_mean_and_deviation_in_one_pass(shape: tuple[int, int], offset: float) -> None:
    """As two passes give them, also of small differences on much light; of equal values nothing is left over."""
    values = (offset + np.random.default_rng(3).random(shape)).astype(np.float32)
    mean, deviation = _mean_and_deviation(values)
    assert mean == pytest.approx(values.mean(dtype=np.float64), rel=1e-12)
    assert deviation == pytest.approx(values.std(dtype=np.float64), rel=1e-9)
    tenth = np.float32(0.1)
    assert _mean_and_deviation(np.full(shape, tenth)) == (float(tenth), 0.0)


def test_ten_stops() -> None:
    assert DynamicRange(0.1, 102.4).to_json()["stops"] == pytest.approx(10)
    assert DynamicRange(0.1, 100.0).to_json()["log10"] == pytest.approx(3)


@pytest.mark.shared_data
def test_what_of_table_4_3_can_be_recomputed(shared_data: Path) -> None:
    """Factors and maxima; exposures and shares of saturated pixels are of photographs that are not published."""
    with (shared_data / "reference/table_4_3_images.csv").open(encoding="utf-8") as file:
        rows = {row["image"]: row for row in csv.DictReader(file)}
    most = {name: float(row["max_luminance_cd_m2"]) for name, row in rows.items()}
    used = {name: float(row["luminance_scale"]) for name, row in rows.items()}
    assert factor_to(most["1.1"], most["2.1"]) == pytest.approx(used["1.2"], abs=0.005)
    assert factor_to(most["3.1"], most["2.1"]) == pytest.approx(6.7, abs=0.05)
    assert most["1.1"] * used["1.2"] == pytest.approx(most["1.2"], abs=0.05)
    # 27.857 is printed as 27.85: the factor has two digits after its point.
    assert most["3.1"] * used["3.2"] == pytest.approx(most["3.2"], abs=0.01)
    assert float(rows["3.2"]["saturated_red_percent"]) == 0.3
    assert max(float(row["saturated_red_percent"]) for row in rows.values()) == 0.3
    # Were the same pixels full in all, luminance times exposure would be the same.
    full_well = [most[name] * float(Fraction(rows[name]["exposure_s"])) for name in ("1.1", "2.1", "3.1")]
    assert full_well == pytest.approx([13.69, 13.09, 15.65], abs=0.005)
