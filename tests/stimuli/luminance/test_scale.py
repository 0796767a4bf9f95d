"""One factor for a picture: what it changes, and what it must leave alone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.colour import xyY_from_XYZ
from stimuli.errors import StimulusError
from stimuli.luminance import factor_to, mean_luminance_cd_m2, scaled_picture, white_luminance_cd_m2
from stimuli.luminance.scale import factor_series, grey_picture, greyscale, max_luminance_cd_m2, scaled
from stimuli.pictures import StereoImage, XYZImage


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


def test_scaling_and_grey_commute(pair: StereoImage) -> None:
    one = scaled_picture(grey_picture(pair, (0.31, 0.33)), 1.33)
    other = grey_picture(scaled_picture(pair, 1.33), (0.31, 0.33))
    np.testing.assert_allclose(one.right, other.right, rtol=3e-7)


def test_maximum_is_of_either_eye(pair: StereoImage) -> None:
    assert max_luminance_cd_m2(pair) == max(pair.left[..., 1].max(), pair.right[..., 1].max())
