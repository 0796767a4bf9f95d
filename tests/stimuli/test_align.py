"""Pairs aligned: known shifts come back, what cannot be aligned is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr

from devices.display import disparity_arcmin
from documents.arrays import Floats, Floats32
from stimuli.align import Viewing, align_pair, measure_disparity, register
from stimuli.align.interpolate import Interpolation, cut, sampled, transfer, weights
from stimuli.align.phase import correlation, find_peak, hann
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage
from stimuli.recipes import read_recipe
from stimuli.recipes.sparkle_plate import SparklePlateRecipe
from stimuli.sparkle import Studio

ROOT = Path(__file__).parents[2]
WITHIN_PX = 0.02  # promised
PITCH_MM = 0.277


@pytest.fixture(scope="module")
def plate_views() -> dict[str, Floats32]:
    """Views of half the shipped grey plate, each eye with sparkles of its own; the right one as it lies, and moved.

    They are rendered on pixels a quarter as wide and averaged: moved by one of these, a view is moved by 0.25 px.
    """
    recipe, _ = read_recipe(ROOT / "configs/stimuli/manitoba_gray.yaml")
    assert isinstance(recipe, SparklePlateRecipe)
    plate = recipe.plate.model_copy(update={"size_mm": (105.0, 70.0)})
    studio = Studio(plate, recipe.lamp, recipe.camera, recipe.seed, PITCH_MM / 4)
    left, right = (one.xyz_cd_m2 for one in studio.photographs("stereo", 1.0))

    def averaged(view: Floats32, quarters: int) -> Floats32:
        height, width = ((length - 32) // 4 for length in view.shape[:2])
        part = view[16 : 16 + 4 * height, 16 - quarters : 16 - quarters + 4 * width]
        return np.asarray(part.reshape(height, 4, width, 4, 3).mean(axis=(1, 3)), dtype=np.float32)

    return {"left": averaged(left, 0), **{str(k / 4): averaged(right, k) for k in (0, 1, -2, 13)}}


def sparkles(
    dx: float, dy: float = 0.0, *, side: int = 192, count: int = 400, sd: float = 0.8, seed: int = 0
) -> Floats:
    """Sparse sparkles on an even ground, moved by (dx, dy); each is integrated over pixels, not resampled."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-40, side + 40, (2, count))
    light = rng.lognormal(0.0, 0.7, count) * 20.0
    edges = np.arange(side + 1) - 0.5
    across, down = (np.diff(ndtr((edges - place[:, None]) / sd), axis=1) for place in (x + dx, y + dy))
    return np.asarray(3.6 + (down * light[:, None]).T @ across)


def picture(plane: Floats) -> Floats32:
    return np.repeat(plane[:, :, None], 3, axis=2).astype(np.float32)


def refusal(left: Floats32, right: Floats32, method: Any = "correlation", **how: Any) -> str:
    with pytest.raises(StimulusError) as caught:
        align_pair(left, right, method, **how)
    (finding,) = caught.value.findings
    assert finding.remedy
    return finding.message


@pytest.mark.parametrize("shift", [(0.25, 0.0), (-0.25, 0.25), (0.5, -0.1), (3.25, 1.75), (-17.75, 0.0)])
def test_a_known_shift_comes_back(shift: tuple[float, float]) -> None:
    """With noise of 1 %, and a tenth more light in one eye."""
    rng = np.random.default_rng(1)
    left, right = sparkles(0.0), 1.1 * sparkles(*shift)
    left, right = (one + rng.normal(0.0, 0.01 * left.max(), left.shape) for one in (left, right))
    found = register(left, right)
    np.testing.assert_allclose(found.shift_px, shift, atol=WITHIN_PX)
    assert found.false_alarm < 1e-6
    assert max(found.standard_error_px) < 0.01


@pytest.mark.nightly
def test_the_standard_error_is_the_scatter() -> None:
    rng = np.random.default_rng(2)
    clean = sparkles(0.0, side=96), sparkles(0.25, side=96)
    noise = 0.02 * clean[0].max()
    found = [register(*(one + rng.normal(0.0, noise, one.shape) for one in clean)) for _ in range(60)]
    errors = np.array([one.shift_px for one in found]) - (0.25, 0.0)
    told = np.sqrt(np.mean(np.square([one.standard_error_px for one in found])))
    # 120 errors: their root mean square is known to 6.5 %.
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(told, rel=0.25)


def test_an_aligned_pair_is_at_zero_and_cropped_alike() -> None:
    left, right = picture(sparkles(0.0, sd=1.2)), picture(sparkles(5.3, -1.6, sd=1.2))
    found = align_pair(left, right, viewing=Viewing(PITCH_MM, 700.0))
    assert found.shift_px == pytest.approx(5.3, abs=0.005)
    assert found.vertical_px == pytest.approx(-1.6, abs=0.005)
    assert found.residual_px is not None
    assert found.residual_px < 0.005
    assert found.left.shape == found.right.shape == (192 - 2 - 10, 192 - 5 - 10, 3)
    # Each view is moved by half of the 0.3 px, and none beyond its edge.
    assert found.crop["left"][:2] == pytest.approx((4.85, 6.8), abs=0.005)
    assert found.crop["right"][:2] == pytest.approx((10.15, 5.2), abs=0.005)
    spread = found.disparity.horizontal
    assert abs(spread["px"].median) < 0.01
    assert abs(found.disparity.vertical["px"].median) < 0.01
    assert spread["arcmin"].most == pytest.approx(float(disparity_arcmin(spread["px"].most, PITCH_MM, 700.0)))
    assert spread["mm"].least == pytest.approx(PITCH_MM * spread["px"].least)
    np.testing.assert_allclose(found.left, found.right, atol=3e-3 * found.left.max())
    names = [step["step"] for step in found.steps]
    assert names == ["align", "crop", "interpolate", "disparity"]


def test_whole_pixels_are_copies() -> None:
    left, right = picture(sparkles(0.0)), picture(sparkles(7.25, -2.0))
    found = align_pair(left, right, "offset", offset_px=(7.0, -2.0))
    np.testing.assert_array_equal(found.left, left[2:, :-7])
    np.testing.assert_array_equal(found.right, right[:-2, 7:])
    assert found.steps[2]["interpolation"] is None
    assert found.disparity.horizontal["px"].median == pytest.approx(0.25, abs=0.02)
    rounded = align_pair(left, right, whole_pixels=True)
    np.testing.assert_array_equal(rounded.right, found.right)


def test_marked_points() -> None:
    left, right = picture(sparkles(0.0)), picture(sparkles(3.0, 1.0))
    one = np.array([[10.0, 10.0], [100.0, 20.0], [50.0, 150.0], [90.0, 90.0]])
    two = one + (3.0, 1.0) + np.array([[0.5, 0.0], [-0.5, 0.0], [0.0, 0.3], [0.0, -0.3]])
    found = align_pair(left, right, "points", points=(one, two))
    assert found.shift_px == pytest.approx(3.0)
    assert found.vertical_px == pytest.approx(1.0)
    assert found.residual_px == pytest.approx(np.sqrt((0.25 * 2 + 0.09 * 2) / 4))
    assert found.steps[0]["worst_pair"] in (1, 2)
    for points, message in (
        ((one, two[:2]), "4 points are marked"),
        ((one + 300.0, two), "point 1 of the left picture"),
        ((np.zeros((0, 2)), two), "shape"),
        ((one * np.nan, two), "lies outside"),
    ):
        with pytest.raises(StimulusError, match=message):
            align_pair(left, right, "points", points=points)


def test_the_region_says_which_plane_is_at_zero() -> None:
    """A plate before a background that lies farther away: the plate is aligned, the background keeps its disparity."""
    left, right = sparkles(0.0, side=256), sparkles(9.0, side=256)
    plate = sparkles(0.0, side=256, seed=7), sparkles(2.25, side=256, seed=7)
    left[64:192, 64:192] = plate[0][64:192, 64:192]
    right[64:192, 66:194] = plate[1][64:192, 66:194]
    found = align_pair(picture(left), picture(right), region=(68, 68, 188, 188), block_px=32)
    assert found.shift_px == pytest.approx(2.25, abs=WITHIN_PX)
    inside = np.all(np.abs(found.disparity.middle_px - 120) < 40, axis=1)
    np.testing.assert_allclose(found.disparity.disparity_px[inside, 0], 0.0, atol=0.1)
    assert found.disparity.horizontal["px"].high == pytest.approx(6.75, abs=0.1)


def test_flat_versions() -> None:
    left, centre, right = (picture(sparkles(dx, sd=1.2)) for dx in (0.0, 2.5, 5.0))
    found = align_pair(left, right)
    assert found.flat("left").is_flat
    np.testing.assert_array_equal(found.flat("right").left, found.right)
    middle, step = found.flat_from_centre(centre, left)
    assert middle.left.shape == found.left.shape
    assert step["view"] == "center"
    # The centre view ends where the part does: five columns are interpolated from its edge.
    np.testing.assert_allclose(middle.left[:, 5:-5], found.left[:, 5:-5], atol=3e-3 * found.left.max())
    assert isinstance(found.stereo, StereoImage)


NOISE: dict[str, Callable[[np.random.Generator], Floats]] = {
    "white": lambda rng: rng.normal(10.0, 1.0, (96, 96)),
    "shaded": lambda rng: np.exp(-np.hypot(*np.mgrid[-1:1:96j, -1:1:96j])) * 20 + rng.normal(0.0, 0.1, (96, 96)),
    "counted": lambda rng: rng.poisson(3.0, (96, 96)).astype(np.float64),
    "sparkles": lambda rng: sparkles(0.0, side=96, count=300, seed=int(rng.integers(2**31))),
}


@pytest.mark.parametrize("kind", NOISE)
def test_pictures_with_nothing_in_common_are_refused(kind: str) -> None:
    rng = np.random.default_rng(3)
    for _ in range(3):
        message = refusal(picture(NOISE[kind](rng)), picture(NOISE[kind](rng)))
        # A few sparkles laid onto others, and a shading that both have, are more than noise, and agree nowhere else.
        few = kind in ("shaded", "sparkles") and "agree in too few places" in message
        assert few or "nothing in common" in message


@pytest.mark.parametrize("level", [0.0, 1e4])
def test_flat_pictures_are_refused(level: float) -> None:
    flat = np.full((64, 80, 3), level, np.float32)
    assert "flat" in refusal(flat, flat)
    slope = flat + np.linspace(0, 1e-7 * level, 80, dtype=np.float32)[None, :, None]
    assert "flat" in refusal(slope, slope)
    assert align_pair(flat, flat, "offset", offset_px=(1.0, 0.0)).disparity.used == 0


def test_pictures_that_repeat_are_refused() -> None:
    rng = np.random.default_rng(4)
    tile = np.tile(rng.uniform(1.0, 10.0, (16, 16)), (10, 10))
    assert "repeat" in refusal(picture(tile), picture(np.roll(tile, 3, axis=1)))
    found = register(tile, np.roll(tile, 3, axis=1), most_px=(7, 7))
    np.testing.assert_allclose(found.shift_px, (3.0, 0.0), atol=WITHIN_PX)


def test_wrong_pictures_are_refused() -> None:
    good = picture(sparkles(0.0, side=64))
    bad = good.copy()
    bad[3, 4, 0] = np.nan
    assert "right picture are NaN or infinite" in refusal(good, bad)
    assert "64 × 63" in refusal(good, good[:-1])
    assert refusal(good[:20], good[:20]) == "the left picture is 64 × 20 pixels"
    assert "shape" in refusal(good[:, :, :2], good)
    assert "one channel" in refusal(good[:, :, 0], good[:, :, 0])
    assert "offset_px is None" in refusal(good, good, "offset")
    assert "common to both" in refusal(good, good, "offset", offset_px=(40.0, 0.0))
    assert "no points" in refusal(good, good, "points")
    assert "method is 'guess'" in refusal(good, good, "guess")
    assert "region" in refusal(good, good, region=(0, 0, 100, 64))
    assert "too small" in refusal(good, good, region=(0, 0, 10, 64))
    assert "luminance_weights" in refusal(good, good, luminance_weights=(0.0, 0.0, 0.0))
    assert "interpolation is 'best'" in refusal(good, good, interpolation="best")
    with pytest.raises(StimulusError, match="block_px is 8"):
        measure_disparity(good, good, block_px=8)


def test_disparities_of_blocks() -> None:
    """A step in depth, a flat part and a part that only noise fills."""
    rng = np.random.default_rng(5)
    left, right = sparkles(0.0, side=256, count=1500), sparkles(0.0, side=256, count=1500)
    right[:128] = sparkles(1.5, side=256, count=1500)[:128]
    for one in (left, right):
        one[128:192, :128] = 5.0
        one[192:, :128] = rng.normal(5.0, 1.0, (64, 128))
    found = measure_disparity(left, right, block_px=32)
    assert found.blocks == 64
    assert found.flat == 8
    assert found.uncertain == pytest.approx(8, abs=2)
    upper = found.middle_px[:, 1] < 96  # the blocks next to the step hold both
    np.testing.assert_allclose(found.disparity_px[upper, 0], 1.5, atol=0.02)
    # The local mean reaches 16 px into what lies beside: noise of its own for each eye.
    np.testing.assert_allclose(found.disparity_px[found.middle_px[:, 1] > 192, 0], 0.0, atol=0.02)
    np.testing.assert_allclose(found.disparity_px[:, 1], 0.0, atol=0.05)
    assert found.false_alarm.max() <= 1e-5
    assert found.standard_error_px.shape == found.disparity_px.shape == (found.used, 2)


def test_phase_correlation_against_brute_force() -> None:
    """The peak lies where the sum of products does that a loop over shifts finds."""
    rng = np.random.default_rng(6)
    one = rng.normal(0.0, 1.0, (40, 48)).astype(np.float32)
    two = np.roll(one, (-4, 7), axis=(0, 1))
    window = np.outer(hann(40), hann(48))
    peak = find_peak(correlation(one * window, two * window), (20, 20))
    sums = {
        (dx, dy): float(np.sum(one * np.roll(two, (-dy, -dx), (0, 1)))) for dx in range(-9, 10) for dy in range(-9, 10)
    }
    assert peak.shift_px == max(sums, key=sums.__getitem__) == (7, -4)


@pytest.mark.parametrize("interpolation", ["sinc", "cubic", "linear"])
@pytest.mark.parametrize("fraction", [0.0, 0.1, -0.25, 0.5])
def test_interpolation(interpolation: Interpolation, fraction: float) -> None:
    taps = weights(fraction, interpolation)
    assert taps.sum() == pytest.approx(1.0)
    phase = 2 * np.pi * 0.125 * np.arange(64)
    wave = np.tile(5.0 + np.sin(phase), (4, 1))
    moved = sampled(wave, (fraction, 0.0), interpolation)[0, 16:48] - 5.0
    amplitude = float(transfer(fraction, 0.125, interpolation))
    expected = np.sin(phase + 2 * np.pi * 0.125 * fraction)[16:48] * amplitude
    np.testing.assert_allclose(moved, expected, atol=0.012 if interpolation == "sinc" else 0.06)
    assert np.sum(sampled(wave, (0.0, fraction), interpolation)) == pytest.approx(np.sum(wave))


def test_no_negative_light_is_made() -> None:
    dark = np.zeros((40, 40, 3), np.float32)
    dark[20, 20] = 1000.0
    found, negative = cut(dark, (4.5, 4.25), (30, 30), "sinc")
    assert found.min() == 0.0
    assert negative > 0
    kept, none = cut(dark - 1.0, (4.5, 4.25), (30, 30), "sinc")
    assert kept.min() < -1.0
    assert none == 0


@pytest.mark.nightly
def test_the_shipped_plate_lies_at_zero_and_moves_as_it_was_moved(plate_views: dict[str, Floats32]) -> None:
    still = register(plate_views["left"], plate_views["0.0"])
    # Each eye sees sparkles of its own: the plane is found as well as the ones in common allow.
    assert still.correlation < 0.9
    np.testing.assert_allclose(still.shift_px, 0.0, atol=0.04)
    for name in ("0.25", "-0.5", "3.25"):
        moved = register(plate_views["left"], plate_views[name])
        np.testing.assert_allclose(np.subtract(moved.shift_px, still.shift_px), (float(name), 0.0), atol=WITHIN_PX)
    report = measure_disparity(plate_views["left"], plate_views["0.0"], viewing=Viewing(PITCH_MM, 700.0))
    assert report.used > 0.9 * report.blocks
    assert abs(report.horizontal["px"].median) < 0.05


def test_vertical_is_measured_even_where_it_is_left() -> None:
    found = align_pair(picture(sparkles(0.0)), picture(sparkles(2.0, 0.5)), correct_vertical=False)
    assert found.vertical_px == pytest.approx(0.5, abs=0.005)
    assert found.disparity.vertical["px"].median == pytest.approx(0.5, abs=0.02)
    assert found.disparity.horizontal["px"].median == pytest.approx(0.0, abs=0.02)


@settings(max_examples=15, deadline=None)
@given(dx=st.floats(-6.0, 6.0), dy=st.floats(-3.0, 3.0), seed=st.integers(0, 1000), noise=st.sampled_from([0.0, 0.02]))
def test_swapping_the_eyes_negates(dx: float, dy: float, seed: int, noise: float) -> None:
    rng = np.random.default_rng(seed)
    left, right = (
        sparkles(x, y, side=80, seed=seed) + rng.normal(0.0, noise, (80, 80)) for x, y in ((0.0, 0.0), (dx, dy))
    )
    one, two = register(left, right), register(right, left)
    # The same sums in another order, stopped at 1e-4 px.
    np.testing.assert_allclose(one.shift_px, np.negative(two.shift_px), atol=2e-6)
    np.testing.assert_allclose(one.shift_px, (dx, dy), atol=WITHIN_PX)
    assert one.standard_error_px == pytest.approx(two.standard_error_px, rel=1e-3)


@pytest.mark.nightly
@settings(max_examples=15, deadline=None)
@given(dx=st.floats(-20.0, 20.0), dy=st.floats(-20.0, 20.0), shift=st.floats(-3.0, 3.0), seed=st.integers(0, 1000))
def test_shifting_both_shifts_nothing(dx: float, dy: float, shift: float, seed: int) -> None:
    still = register(*(sparkles(x, side=112, seed=seed) for x in (0.0, shift)))
    moved = register(*(sparkles(dx + x, dy, side=112, seed=seed) for x in (0.0, shift)))
    np.testing.assert_allclose(moved.shift_px, still.shift_px, atol=WITHIN_PX / 2)  # other sparkles enter at the edges


def test_the_spread_of_blocks_is_told_apart_from_their_noise() -> None:
    """One plane and noise: the blocks scatter by what their standard errors say."""
    rng = np.random.default_rng(7)
    clean = sparkles(0.0, side=384, count=3400)
    left, right = (clean + rng.normal(0.0, 1.0, clean.shape) for _ in range(2))
    found = measure_disparity(left, right)
    assert found.used == 36
    told = np.sqrt(np.mean(found.standard_error_px**2))
    # 72 disparities: their root mean square is known to 8.3 %; each standard error rests on 36 squares or fewer.
    assert np.sqrt(np.mean(found.disparity_px**2)) == pytest.approx(told, rel=0.25)
