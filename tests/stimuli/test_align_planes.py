"""Homographies and turned cameras, against points projected one by one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from documents.arrays import Floats, Floats32
from stimuli.align import Viewing, align_pair, focal_px, homography_from_points, rectify_toe_in, register, warp
from stimuli.align.homography import mapped
from stimuli.align.toe_in import keystone, toe_in_homography
from stimuli.errors import StimulusError
from stimuli.pictures import Eye
from tests.compiled_loops import not_in_numpy

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
    np.testing.assert_allclose(mapped(found.matrix, places), mapped(matrix, places), atol=1e-6)
    assert found.residual_px < 1e-6


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
    found = homography_from_points(places, mapped(MATRIX, places) + away)
    # 80 readings less 8 parameters, of standard deviation 0.3 each way.
    assert found.residual_px == pytest.approx(0.3 * np.sqrt(2 * 72 / 80), rel=0.2)


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
