"""Resampling against twins that visit every pair of pixels, and what a display's pixels keep of a picture."""

from __future__ import annotations

import itertools
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from documents import InputError
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage, display_resolution, resample_picture
from stimuli.pictures.resampling import Filter, area_weights, axis_weights, resample
from stimuli.pictures.resolution import Resolution


# Resampling against twins that visit every pair of pixels.
def area_weights_plain(pixels: int, length_mm: float, pixel_pitch_mm: float) -> NDArray[np.float64]:
    """The slow obvious twin: the overlap of every display pixel with every pixel."""
    count = max(1, round(length_mm / pixel_pitch_mm))
    weights = np.zeros((count, pixels))
    for i in range(count):
        low, high = (i - count / 2) * pixel_pitch_mm, (i + 1 - count / 2) * pixel_pitch_mm
        for j in range(pixels):
            start, end = (j / pixels - 0.5) * length_mm, ((j + 1) / pixels - 0.5) * length_mm
            weights[i, j] = max(0.0, min(high, end) - max(low, start)) / pixel_pitch_mm
    return weights


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 60), st.floats(0.5, 50), st.floats(0.3, 20))
def test_weights_equal_the_plain_twin(pixels: int, length_mm: float, pitch_mm: float) -> None:
    weights = area_weights(pixels, length_mm, pitch_mm)
    np.testing.assert_allclose(weights.toarray(), area_weights_plain(pixels, length_mm, pitch_mm), rtol=0, atol=1e-9)


@pytest.mark.parametrize("pitch", [0.0, -0.1, float("nan"), 1e-9])
def test_a_pitch_that_cannot_be_is_refused(pitch: float) -> None:
    with pytest.raises(StimulusError, match="pixel_pitch_mm"):
        area_weights(10, 150.0, pitch)


# Smoother filters

SMOOTH: tuple[Filter, ...] = ("linear", "cubic")


def spline(t: NDArray[np.float64], filter: Filter) -> NDArray[np.float64]:
    a = np.abs(t)
    if filter == "linear":
        return np.asarray(np.maximum(0, 1 - a))
    return np.asarray(np.where(a < 1, 2 / 3 - a**2 + a**3 / 2, np.where(a < 2, (2 - a) ** 3 / 6, 0)))


def weights_plain(pixels: int, length_mm: float, pitch_mm: float, filter: Filter) -> NDArray[np.float64]:
    """The slow obvious twin: sum splines over fine steps, and mirror them at the ends."""
    count = max(1, round(length_mm / pitch_mm))
    size = length_mm / pixels
    fine = 4000
    end = 0.5 * min(count * pitch_mm, length_mm)
    x = (np.arange(fine) + 0.5) / fine * 2 * end - end
    if size <= pitch_mm:
        knots, step, other, other_step = count, pitch_mm, pixels, size
    else:
        knots, step, other, other_step = pixels, size, count, pitch_mm
    cell = np.clip(np.floor(x / other_step + other / 2), 0, other - 1).astype(int)
    weights = np.zeros((knots, other))
    for k in range(-3, knots + 3):
        places = (k - (knots - 1) / 2) * step
        mirrored = k % (2 * knots)
        mirrored = mirrored if mirrored < knots else 2 * knots - 1 - mirrored
        np.add.at(weights[mirrored], cell, spline((x - places) / step, filter) * 2 * end / fine / pitch_mm)
    return weights if size <= pitch_mm else weights.T


@pytest.mark.parametrize("filter", SMOOTH)
@pytest.mark.parametrize(
    ("pixels", "length", "pitch"), [(50, 10.0, 0.77), (7, 10.0, 0.77), (1, 3.0, 0.9), (9, 3.0, 5.0), (13, 13.0, 1.02)]
)
def test_smooth_weights_equal_the_plain_twin(pixels: int, length: float, pitch: float, filter: Filter) -> None:
    plain = weights_plain(pixels, length, pitch, filter)
    weights = axis_weights(pixels, length, pitch, filter)
    # A step of the twin's sum may fall on either side of a pixel's edge.
    np.testing.assert_allclose(weights.toarray(), plain, rtol=0, atol=4e-3 * max(1.0, length / pixels / pitch))


def test_an_unknown_filter_is_refused() -> None:
    with pytest.raises(StimulusError, match="no filter 'lanczos'"):
        axis_weights(10, 150.0, 0.3, "lanczos")  # type: ignore[arg-type]  # a wrong word on purpose


@settings(deadline=None)
@given(st.integers(1, 80), st.floats(0.5, 50), st.floats(0.3, 20), st.sampled_from(["area", "linear", "cubic"]))
def test_every_filter_keeps_light_and_an_even_plane(
    pixels: int, length_mm: float, pitch_mm: float, filter: Filter
) -> None:
    """Whatever the two grids: no weight below 0, and the light of each place as `area_weights` has it."""
    weights = axis_weights(pixels, length_mm, pitch_mm, filter)
    area = area_weights(pixels, length_mm, pitch_mm)
    assert weights.shape == area.shape
    assert weights.data.min() >= 0
    covered = min(length_mm, weights.shape[0] * pitch_mm)
    assert weights.sum() * pitch_mm == pytest.approx(covered, rel=1e-9)
    if length_mm >= weights.shape[0] * pitch_mm * (1 - 1e-12):
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-9)
    if length_mm / pixels <= pitch_mm:
        np.testing.assert_allclose(weights.sum(axis=0), area.sum(axis=0), atol=1e-9)


def test_the_display_s_own_pixels_are_left_as_they_are() -> None:
    picture = np.random.default_rng(0).uniform(0, 9, (20, 30, 3)).astype(np.float32)
    filters: tuple[Filter, ...] = ("area", *SMOOTH)
    for filter in filters:
        same = resample_picture(StereoImage.flat(picture), (30 * 0.27, 20 * 0.27), 0.27, filter)
        assert same.is_flat
        np.testing.assert_allclose(same.left, picture, rtol=1e-6)


def test_bands_of_rows_make_no_difference() -> None:
    image = np.random.default_rng(0).uniform(0, 100, (700, 90)).astype(np.float32)
    filters: tuple[Filter, ...] = ("area", "cubic")
    for filter, pitch in itertools.product(filters, (0.7, 2.3)):
        rows, columns = axis_weights(700, 700, pitch, filter), axis_weights(90, 90, pitch, filter)
        np.testing.assert_allclose(resample(image, rows, columns), rows @ image @ columns.T, rtol=1e-12)


# What a display's pixels keep of a picture: the thesis's figures and Nyquist's.

# The plate of the thesis: 150 × 100 mm at 700 mm, 146 camera pixels per centimetre, on pixels of 0.2768 mm.
PLATE = ((2190, 1460), (150.0, 100.0))


@pytest.fixture
def plate() -> Resolution:
    return display_resolution(*PLATE, 0.2768, 700.0)


def test_both_figures(plate: Resolution) -> None:
    fov = math.degrees(2 * math.atan(150 / 1400))
    assert plate.needed_px[0] == pytest.approx(fov * 60)
    assert plate.nyquist_px[0] == pytest.approx(fov * 120)
    assert plate.display_px == (542, 361)
    per_degree = 2 * 700 * math.tan(math.radians(0.5)) / 0.2768
    assert plate.display_cycles_per_degree == pytest.approx(per_degree / 2)
    assert plate.picture_cycles_per_degree == pytest.approx(per_degree / 2 * 0.2768 * 14.6)


def test_what_is_lost_is_said(plate: Resolution) -> None:
    assert plate.lost_cycles_per_degree == (plate.display_cycles_per_degree, plate.picture_cycles_per_degree)
    assert plate.seen_and_lost == (plate.display_cycles_per_degree, 60.0)
    grid, lost = plate.sentences()
    assert "542 pixels" in grid
    assert "need 1468" in grid
    assert "from 22.1 to 89.2" in lost
    assert "up to 60.0" in lost
    assert json.loads(json.dumps(plate.to_json()))["lost_cycles_per_degree"] == list(plate.lost_cycles_per_degree)


def test_nothing_is_lost_of_a_coarse_picture_or_far_away() -> None:
    coarse = display_resolution((200, 150), (150.0, 100.0), 0.2768, 700.0)
    assert coarse.lost_cycles_per_degree is None
    assert len(coarse.sentences()) == 1
    # The coarser of the two axes is what the picture is sure to hold.
    assert coarse.picture_cycles_per_degree == pytest.approx(
        display_resolution((200, 9000), (150.0, 100.0), 1, 700).picture_cycles_per_degree
    )
    far = display_resolution(*PLATE, 0.2768, 4000.0)
    assert far.lost_cycles_per_degree is not None
    assert far.seen_and_lost is None
    assert "cannot see" in far.sentences()[0]
    between = display_resolution(*PLATE, 0.2768, 1200.0)
    assert "the 60 that eyes resolve need" in between.sentences()[0]
    assert "there is the one pixel per cycle" in between.sentences()[0]
    for one in (coarse, far, between):
        assert "Expression" not in " ".join(one.sentences()), "words for people who do not have the thesis"


@pytest.mark.parametrize(
    ("picture", "size", "pitch", "distance"),
    [((0, 5), (1.0, 1.0), 0.2, 700.0), ((5, 5), (1.0, 1.0), 0.2, 0.0)],
)
def test_what_cannot_be(picture: tuple[int, int], size: tuple[float, float], pitch: float, distance: float) -> None:
    with pytest.raises(InputError):
        display_resolution(picture, size, pitch, distance)
