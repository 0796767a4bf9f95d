"""Pairs aligned: known shifts, rolls, scales and planes come back; what cannot be aligned is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr

from devices.display import disparity_arcmin
from devices.eyes import Eye
from documents.arrays import Floats, Floats32
from stimuli.align import (
    Viewing,
    align_pair,
    focal_px,
    homography_from_points,
    measure_disparity,
    rectify_toe_in,
    register,
    straighten,
    warp,
)
from stimuli.align.homography import mapped
from stimuli.align.interpolate import Interpolation, cut, sampled, transfer, weights
from stimuli.align.phase import correlation, find_peak, hann
from stimuli.align.roll_scale import fit_roll_scale
from stimuli.align.toe_in import keystone, toe_in_homography
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage
from tests.compiled_loops import not_in_numpy
from tests.kept import known

# Pairs aligned: known shifts come back, what cannot be aligned is refused.

ROOT = Path(__file__).parents[2]
WITHIN_PX = 0.02  # promised
PITCH_MM = 0.277


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


def test_an_aligned_pair_is_at_zero_and_cropped_alike() -> None:
    left, right = picture(sparkles(0.0, sd=1.2)), picture(sparkles(5.3, -1.6, sd=1.2))
    found = align_pair(left, right, viewing=Viewing(PITCH_MM, 700.0))
    assert found.shift_px == pytest.approx(5.3, abs=0.005)
    assert found.vertical_px == pytest.approx(-1.6, abs=0.005)
    assert known(found.residual_px) < 0.005
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


def test_vertical_is_measured_even_where_it_is_left() -> None:
    found = align_pair(picture(sparkles(0.0)), picture(sparkles(2.0, 0.5)), correct_vertical=False)
    assert found.vertical_px == pytest.approx(0.5, abs=0.005)
    assert found.disparity.vertical["px"].median == pytest.approx(0.5, abs=0.02)
    assert found.disparity.horizontal["px"].median == pytest.approx(0.0, abs=0.02)


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


# Homographies and turned cameras, against points projected one by one.

SIZE_PX = (320, 240)
EYES: tuple[Eye, Eye] = ("left", "right")
MATRIX = np.array([[1.02, 0.015, -3.0], [-0.01, 0.99, 4.0], [2e-5, -1e-5, 1.0]])


def spots(places: Floats, size_px: tuple[int, int] = SIZE_PX, sd_px: float = 2.0) -> Floats32:
    """Gaussian spots at ``places`` (n, 2) on an even ground, as three equal channels."""
    x, y = (np.arange(length)[None, :] for length in size_px)
    light = np.linspace(10.0, 40.0, len(places))
    across, down = (np.exp(-0.5 * ((at - places[:, i : i + 1]) / sd_px) ** 2) for i, at in enumerate((x, y)))
    plane = 4.0 + (down * light[:, None]).T @ across
    return np.repeat(plane[:, :, None], 3, axis=2).astype(np.float32)


def scattered(count: int = 500, seed: int = 0) -> Floats:
    return np.random.default_rng(seed).uniform((-60.0, -60.0), (SIZE_PX[0] + 60.0, SIZE_PX[1] + 60.0), (count, 2))


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(4, 12))
def test_a_homography_comes_back(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    corners = np.array([[0.0, 0.0], [300.0, 10.0], [20.0, 200.0], [310.0, 230.0]])
    places = np.concatenate([corners, rng.uniform(0.0, 200.0, (count - 4, 2))])
    matrix = MATRIX + rng.normal(0.0, 1.0, (3, 3)) * [[0.05, 0.05, 5.0], [0.05, 0.05, 5.0], [1e-5, 1e-5, 0.0]]
    found = homography_from_points(places, mapped(matrix, places))
    np.testing.assert_allclose(mapped(found, places), mapped(matrix, places), atol=1e-6)


@pytest.mark.parametrize(
    "places",
    [[[0, 0], [1, 0], [2, 0], [3, 0]], [[0, 0], [5, 5], [10, 10], [3, 0]], [[0, 0], [1, 0], [0, 1]], [[0, np.nan]] * 4],
)
def test_corners_that_fix_nothing_are_refused(places: list[list[float]]) -> None:
    with pytest.raises(StimulusError) as caught:
        homography_from_points(places, places)
    assert len(caught.value.findings) == 1


def test_warping_brings_spots_to_their_places() -> None:
    places = scattered()
    found = warp(spots(mapped(MATRIX, places)), MATRIX, SIZE_PX)
    want = spots(places)
    # The homography stretches the spots themselves by up to 3 %.
    np.testing.assert_allclose(found.picture[8:-8, 8:-8], want[8:-8, 8:-8], atol=0.08 * want.max())
    still = warp(want, np.eye(3), SIZE_PX)
    np.testing.assert_allclose(still.picture, want, atol=1e-4)
    assert (still.outside_px, still.negative_px) == (0, 0)
    assert warp(want, np.array([[1, 0, 5], [0, 1, 0], [0, 0, 1.0]]), SIZE_PX).outside_px == 5 * SIZE_PX[1]


def test_register_through_four_corners() -> None:
    """A photograph against a rendering of another size, seen aslant: the shift that the corners leave comes back."""
    places = scattered(400)
    reference = spots(places)
    moving = spots(mapped(MATRIX, places), (350, 260))
    corners = np.array([[10.0, 10.0], [300.0, 12.0], [8.0, 220.0], [305.0, 225.0]])
    found = register(reference, moving, corners=(corners, mapped(MATRIX, corners + (0.4, -0.3))))
    # The corners were marked too far to the right and too high, so that the moving picture comes out the other way.
    np.testing.assert_allclose(found.shift_px, (-0.4, 0.3), atol=0.02)
    assert found.homography is not None
    assert "homography" in found.to_json()
    with pytest.raises(StimulusError, match="320 × 240 pixels and the moving one 350 × 260"):
        register(reference, moving)


def projected(points_mm: Floats, eye_x_mm: float, turn_deg: float, focal_length_px: float) -> Floats:
    """Project points (n, 3) into a camera at ``eye_x_mm``, turned to the right by ``turn_deg``, one by one."""
    angle, found = np.radians(turn_deg), []
    for x, y, z in points_mm - (eye_x_mm, 0.0, 0.0):
        ahead = z * np.cos(angle) + x * np.sin(angle)
        aside = x * np.cos(angle) - z * np.sin(angle)
        found.append(
            ((SIZE_PX[0] - 1) / 2 + focal_length_px * aside / ahead, (SIZE_PX[1] - 1) / 2 + focal_length_px * y / ahead)
        )
    return np.array(found)


def test_turned_cameras_are_made_parallel() -> None:
    """Points on a plate, photographed by turned cameras, come to lie at zero parallax and level."""
    focal, distance, base = 500.0, 700.0, 65.0
    toe_in = np.degrees(np.arctan(base / 2 / distance))
    rng = np.random.default_rng(2)
    plate = np.column_stack([rng.uniform(-250, 250, 500), rng.uniform(-200, 200, 500), np.full(500, distance)])
    left, right = projected(plate, -base / 2, toe_in, focal), projected(plate, base / 2, -toe_in, focal)
    back = [
        mapped(np.linalg.inv(toe_in_homography(eye, toe_in, focal, SIZE_PX)), places)
        for eye, places in zip(EYES, (left, right), strict=True)
    ]
    np.testing.assert_allclose(back[0], back[1], atol=1e-9)
    assert np.abs(left - right)[:, 1].max() > 1.0
    found = rectify_toe_in(spots(left), spots(right), float(toe_in), focal, viewing=Viewing(0.277, 600.0))
    aligned = align_pair(found.left, found.right)
    assert abs(aligned.shift_px) < 0.01
    assert abs(aligned.disparity.vertical["px"].most) < 0.03
    raw = align_pair(spots(left), spots(right))
    assert raw.disparity.vertical["px"].most > 0.5
    assert found.left.shape == (found.crop[3] - found.crop[1], found.crop[2] - found.crop[0], 3)


def test_keystone_by_projecting_the_corners() -> None:
    focal, distance, toe_in = 800.0, 1000.0, 2.0
    base = 2 * distance * np.tan(np.radians(toe_in))
    told = keystone(toe_in, focal, SIZE_PX)
    # The plane's points that parallel cameras of the same scale in the middle see in the corners.
    scale = focal * np.cos(np.radians(toe_in)) / distance
    across, down = (SIZE_PX[0] - 1) / 2 / scale, (SIZE_PX[1] - 1) / 2 / scale
    points = np.array([[x, y, distance] for y in (-down, down) for x in (-across, across)])
    left, right = projected(points, -base / 2, toe_in, focal), projected(points, base / 2, -toe_in, focal)
    np.testing.assert_allclose(np.column_stack([told.horizontal_px, told.vertical_px]), right - left, atol=1e-9)


def test_angles_that_cannot_be_are_refused() -> None:
    left = spots(scattered(5))
    for angle, focal, message in (
        (-1.0, 500.0, "toe_in_deg"),
        (60.0, 500.0, "toe_in_deg"),
        (1.0, 0.0, "focal_length_px"),
        (40.0, 100.0, "no part"),
        (44.9, 130.0, "no part"),
    ):
        with pytest.raises(StimulusError, match=message):
            rectify_toe_in(left, left, angle, focal)
    assert focal_px(7360, 39.6) == pytest.approx(7360 / 35.9 * 49.86, rel=0.01)  # a lens of 50 mm on full frame
    with pytest.raises(StimulusError, match="field_of_view_deg"):
        focal_px(100, 180.0)


@pytest.mark.parametrize("shift", [(0.4, 24.3), (-7.25, 3.0), (300.5, -2.0)])
def test_a_compiled_shift_is_that_of_numpy(shift: tuple[float, float]) -> None:
    """Also beyond the edges, and where light would fall below 0."""
    light = np.random.default_rng(4).uniform(0.0, 9.0, (70, 90, 3)).astype(np.float32)
    matrix = np.array([[1.0, 0.0, shift[0]], [0.0, 1.0, shift[1]], [0.0, 0.0, 1.0]])
    slow = warp(light, matrix, (80, 75))
    with not_in_numpy("stimuli.align.warping_loops"):
        fast = warp(light, matrix, (80, 75))
    np.testing.assert_allclose(fast.picture, slow.picture, rtol=0, atol=4e-6)
    assert fast.outside_px == slow.outside_px
    assert fast.picture.min() >= 0.0


def test_residual_of_more_than_four_corners() -> None:
    places = scattered(40)
    away = np.random.default_rng(1).normal(0.0, 0.3, places.shape)
    moved = mapped(MATRIX, places) + away
    off = mapped(homography_from_points(places, moved), places) - moved
    # 80 readings less 8 parameters, of standard deviation 0.3 each way.
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) == pytest.approx(0.3 * np.sqrt(2 * 72 / 80), rel=0.2)


def test_parallel_cameras_are_left_alone() -> None:
    left = spots(scattered())
    found = rectify_toe_in(left, left, 0.0, 500.0)
    np.testing.assert_allclose(found.left, left, atol=1e-4)
    assert found.crop == (0, 0, *SIZE_PX)
    np.testing.assert_allclose(found.keystone.vertical_px, 0.0, atol=1e-9)
    assert "vertical_arcmin" not in found.keystone.to_json()


@pytest.mark.parametrize("shift_px", [(0.4, 0.0), (-3.7, 2.25), (12.5, -30.9), (5.0, 0.0), (1e3, 1e3)])
def test_a_shift_along_rows_and_columns_is_the_shift_at_once(shift_px: tuple[float, float]) -> None:
    """The slow twin takes every place by itself, as any homography does."""
    picture = np.random.default_rng(5).gamma(0.3, 10.0, (340, 90, 2)).astype(np.float32)
    matrix = np.array([[1.0, 0.0, shift_px[0]], [0.0, 1.0, shift_px[1]], [0.0, 0.0, 1.0]])
    quick = warp(picture, matrix, (100, 300))
    plain = warp(picture, matrix * 2.0, (100, 300))  # the same homography, and not seen as a shift
    np.testing.assert_allclose(quick.picture, plain.picture, rtol=0, atol=2e-6 * picture.max())
    assert quick.outside_px == plain.outside_px


# Roll and scale between the cameras of a pair: measured from vertical disparities, and undone.

SIDE = 288
# What interpolating between the rounds adds to noise: a hundredth of a pixel at the edge.
ROUNDS_DEG = float(np.degrees(0.01 / (SIDE / 2)))


@cache
def view(
    roll_deg: float = 0.0,
    scale: float = 1.0,
    shift: tuple[float, float] = (0.0, 0.0),
    *,
    depth_px: float = 0.0,
    noise: float = 0.0,
    seed: int = 0,
) -> Floats32:
    """Return sparkles as a camera sees them that is turned clockwise, enlarges and is shifted, about the middle.

    ``depth_px`` scatters their places across, as flakes at several depths would; each is integrated over pixels.
    """
    rng = np.random.default_rng(7)
    count = SIDE**2 // 80
    places = rng.uniform(-60, SIDE + 60, (2, count)) - (SIDE - 1) / 2
    light = rng.lognormal(0.0, 0.7, count) * 20.0
    angle = np.radians(roll_deg)
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    x, y = turn @ places + (SIDE - 1) / 2 + np.array(shift)[:, None]
    x = x + depth_px * np.random.default_rng(8).normal(size=count)
    edges = np.arange(SIDE + 1) - 0.5
    across, down = (np.diff(ndtr((edges - place[:, None]) / 0.9), axis=1) for place in (x, y))
    plane = 3.6 + (down * light[:, None]).T @ across
    plane += noise * plane.max() * np.random.default_rng(seed).normal(size=plane.shape)
    picture = np.repeat(plane[:, :, None], 3, axis=2).astype(np.float32)
    picture.setflags(write=False)
    return picture


@pytest.mark.parametrize(
    ("roll_deg", "scale", "shift"),
    [
        (-0.5, 0.998, (25.2, 1.2)),
        pytest.param(1.5, 1.01, (40.0, 3.0), marks=pytest.mark.nightly),
    ],
)
def test_a_known_roll_and_scale_come_back_and_are_undone(
    roll_deg: float, scale: float, shift: tuple[float, float]
) -> None:
    left, right = view(noise=0.01, seed=1), view(roll_deg, scale, shift, noise=0.01, seed=2)
    made = straighten(left, right)
    assert made.applied
    assert made.roll_scale.roll_deg == pytest.approx(roll_deg, abs=max(4 * made.roll_scale.roll_se_deg, ROUNDS_DEG))
    assert made.roll_scale.scale == pytest.approx(scale, abs=max(4 * made.roll_scale.scale_se, 3e-5))
    assert made.roll_scale.roll_se_deg < 0.01
    aligned = align_pair(made.left, made.right)
    assert aligned.shift_px == pytest.approx(shift[0], abs=0.4)  # each view is turned about its own middle by half
    left_over = aligned.disparity.vertical["px"]
    assert max(abs(left_over.low), abs(left_over.high)) < 0.1
    assert json.loads(json.dumps(made.steps)) == [dict(one) for one in made.steps]


def test_depth_and_noise_are_taken_for_no_roll() -> None:
    left, right = view(noise=0.01, seed=3), view(depth_px=0.5, noise=0.01, seed=4)
    made = straighten(left, right)
    assert not made.applied
    np.testing.assert_array_equal(made.left, left)
    np.testing.assert_array_equal(made.right, right)
    assert made.crop == (0, 0, SIDE, SIDE)
    assert made.roll_scale.roll_deg == pytest.approx(0.0, abs=4 * made.roll_scale.roll_se_deg)


@settings(max_examples=40, deadline=None)
@given(
    roll=st.floats(-0.01, 0.01), growth=st.floats(-0.01, 0.01), middle=st.floats(-3, 3), seed=st.integers(0, 2**32 - 1)
)
def test_a_few_blocks_that_are_wrong_draw_nothing(roll: float, growth: float, middle: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform(0, [600, 400], (60, 2))
    from_middle = places - (299.5, 199.5)
    vertical = middle + roll * from_middle[:, 0] + growth * from_middle[:, 1]
    vertical[:6] += rng.uniform(-16, 16, 6)
    found = known(fit_roll_scale(places, vertical, (600, 400)))
    assert np.radians(found.roll_deg) == pytest.approx(np.arctan2(roll, 1 + growth), abs=2e-4)
    assert found.scale == pytest.approx(np.hypot(1 + growth, roll), abs=2e-4)


def test_a_shift_can_be_given() -> None:
    left, right = view(), view(0.4, shift=(45.0, 0.5))
    made = straighten(left, right, offset_px=(43.0, 1.0))
    assert made.roll_scale.roll_deg == pytest.approx(0.4, abs=ROUNDS_DEG)
    with pytest.raises(StimulusError, match="too little in common"):
        straighten(left, right, offset_px=(280.0, 0.0))


def test_what_tells_nothing_is_none() -> None:
    row = np.column_stack([np.arange(32.0, 700, 64), np.full(11, 100.0)])
    assert fit_roll_scale(row, np.zeros(11), (704, 200)) is None
    assert fit_roll_scale(row[:5], np.zeros(5), (704, 200)) is None
    assert measure_disparity(view()[:64], view()[:64]).roll_scale is None


def test_what_cannot_be_straightened_is_refused() -> None:
    noise = np.random.default_rng(1)
    left, right = (noise.normal(10, 1, (SIDE, SIDE, 3)).astype(np.float32) for _ in range(2))
    with pytest.raises(StimulusError, match=r"nothing in common|agree in too few"):
        straighten(left, right)
    strip = slice(100, 180)
    with pytest.raises(StimulusError, match="blocks have a vertical disparity") as caught:
        straighten(view()[strip], view(0.1)[strip])
    assert caught.value.findings[0].remedy
    with pytest.raises(StimulusError, match=r"differ|size"):
        straighten(view(), view()[1:])
    with pytest.raises(StimulusError, match="one channel"):
        straighten(view()[..., 0], view()[..., 0])


def test_the_report_of_an_aligned_pair_tells_roll_and_scale() -> None:
    found = known(align_pair(view(), view(0.2, 1.001)).disparity.roll_scale)
    assert found.certain
    assert found.roll_deg == pytest.approx(0.2, abs=4 * found.roll_se_deg)
    assert found.scale == pytest.approx(1.001, abs=4 * found.scale_se)
    assert found.roll_se_deg < 0.02
    assert found.corner_px == pytest.approx(np.radians(0.2) * (SIDE - 1) / 2 + 0.001 * (SIDE - 1) / 2, rel=0.1)


@pytest.mark.nightly
def test_large_views_are_averaged_to_measure(monkeypatch: pytest.MonkeyPatch) -> None:
    left, right = view(), view(0.4, 1.002, (6.0, 1.0))
    whole = straighten(left, right).roll_scale
    monkeypatch.setattr("stimuli.align.straightening.MOST_PIXELS", SIDE**2 // 4)
    monkeypatch.setattr("stimuli.align.straightening.BLOCK_PX", 36)
    halved = straighten(left, right, offset_px=(6.0, 1.0), region=(0, 0, SIDE, SIDE))
    assert halved.roll_scale.blocks <= 16  # of 36 averaged pixels
    assert halved.roll_scale.roll_deg == pytest.approx(0.4, abs=5 * ROUNDS_DEG)
    assert halved.roll_scale.corner_px == pytest.approx(whole.corner_px, rel=0.05)
    assert halved.left.shape == straighten(left, right).left.shape


def test_views_that_agree_to_the_last_bit_are_level_and_one_wrong_block_is_not_believed() -> None:
    places = np.stack(np.meshgrid(np.arange(32.0, 600, 64), np.arange(32.0, 400, 64)), axis=-1).reshape(-1, 2)
    vertical = np.full(len(places), 2.0)
    level = known(fit_roll_scale(places, vertical, (600, 400)))
    assert (level.roll_deg, level.scale, level.middle_px) == pytest.approx((0, 1, 2), abs=1e-9)
    vertical[3] += 5
    one_wrong = known(fit_roll_scale(places, vertical, (600, 400)))
    assert (one_wrong.roll_deg, one_wrong.scale, one_wrong.middle_px) == pytest.approx((0, 1, 2), abs=1e-6)
