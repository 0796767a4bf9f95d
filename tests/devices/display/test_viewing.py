"""Viewing geometry against the thesis's own figures and against plain trigonometry."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.display import (
    disparity_arcmin,
    minimum_resolution,
    mm_from_px,
    nyquist_resolution,
    pixels_per_degree,
    px_from_mm,
    size_mm,
    visual_angle_deg,
)
from devices.errors import DeviceError

positive = st.floats(0.01, 1e5)


def test_the_letters_and_strokes_of_the_snellen_chart() -> None:
    assert float(size_mm(5 / 60, 6096)) == pytest.approx(8.866, abs=2e-3)  # 20 feet; the thesis's 8.86 mm
    assert float(size_mm(1 / 60, 6000)) == pytest.approx(1.745, abs=1e-3)
    assert float(visual_angle_deg(1.7453, 6000)) * 60 == pytest.approx(1.0, abs=1e-4)


def test_the_plate_on_the_rig() -> None:
    angle = float(visual_angle_deg(150, 700))
    assert angle == pytest.approx(12.2310, abs=1e-4)
    assert float(minimum_resolution(angle)) == pytest.approx(733.86, abs=0.01)
    assert float(nyquist_resolution(angle)) == pytest.approx(1467.7, abs=0.1)
    assert pixels_per_degree(0.2768, 700) == pytest.approx(44.139, abs=1e-3)
    assert float(px_from_mm(150, 0.2768)) == pytest.approx(541.908, abs=1e-3)


def test_disparity_is_small_angle_parallax_over_distance() -> None:
    one = float(disparity_arcmin(1, 0.2768, 700))
    assert one == pytest.approx(math.degrees(0.2768 / 700) * 60, rel=3e-3)
    assert float(disparity_arcmin(0, 0.2768, 700)) == 0.0
    assert float(disparity_arcmin(-1, 0.2768, 700)) < 0 < one


def test_parallax_of_the_eyes_distance_is_infinity() -> None:
    whole = float(disparity_arcmin(65.0, 1.0, 700, 65.0))
    assert whole == pytest.approx(60 * 2 * math.degrees(math.atan(32.5 / 700)))


@given(positive, positive)
def test_angle_and_size_undo_each_other(size: float, distance: float) -> None:
    assert float(size_mm(visual_angle_deg(size, distance), distance)) == pytest.approx(size, rel=1e-6)


@given(st.floats(-1e6, 1e6), positive)
def test_pixels_and_millimetres_undo_each_other(length: float, pitch: float) -> None:
    assert float(px_from_mm(mm_from_px(length, pitch), pitch)) == pytest.approx(length, rel=1e-12)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_distance_or_pitch_that_cannot_be_is_refused(value: float) -> None:
    with pytest.raises(DeviceError, match="distance_mm"):
        visual_angle_deg(1, value)
    with pytest.raises(DeviceError, match="distance_mm"):
        size_mm(1, value)
    with pytest.raises(DeviceError, match="pixel_pitch_mm"):
        pixels_per_degree(value, 700)
    with pytest.raises(DeviceError, match="interpupillary_distance_mm"):
        disparity_arcmin(1, 0.3, 700, value)
