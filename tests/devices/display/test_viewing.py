"""Viewing geometry against the thesis's own figures and against plain trigonometry.

Contrast sensitivity: against colour-science's Barten 1999, and what must be true at any light.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from colour.contrast import (
    contrast_sensitivity_function_Barten1999,
    pupil_diameter_Barten1999,
    retinal_illuminance_Barten1999,
    sigma_Barten1999,
)
from hypothesis import given
from hypothesis import strategies as st

from devices.display import (
    FinestDetail,
    contrast_sensitivity,
    disparity_arcmin,
    finest_visible,
    minimum_resolution,
    mm_from_px,
    nyquist_resolution,
    pixels_per_degree,
    px_from_mm,
    size_mm,
    visible,
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


@pytest.mark.parametrize("luminance", [0.01, 1.0, 100.0, 1000.0])
@pytest.mark.parametrize("field", [0.5, 10.0, 60.0])
def test_against_colour_science(luminance: float, field: float) -> None:
    frequencies = np.geomspace(0.1, 60.0, 40)
    pupil = pupil_diameter_Barten1999(luminance, field, field)
    theirs = contrast_sensitivity_function_Barten1999(
        frequencies,
        sigma=sigma_Barten1999(0.5 / 60, 0.08 / 60, pupil),
        X_0=field,
        E=retinal_illuminance_Barten1999(luminance, pupil, True),
    )
    np.testing.assert_allclose(contrast_sensitivity(frequencies, luminance, field), theirs, rtol=1e-12)


@given(st.floats(0.01, 5000.0), st.floats(0.2, 50.0))
def test_more_light_and_two_eyes_see_more(luminance: float, frequency: float) -> None:
    one = float(contrast_sensitivity(frequency, luminance, 5.0))
    assert float(contrast_sensitivity(frequency, 2 * luminance, 5.0)) > one
    assert float(contrast_sensitivity(frequency, luminance, 5.0, eyes=1)) == pytest.approx(one / np.sqrt(2), rel=1e-12)


@pytest.mark.parametrize("luminance", [0.05, 20.0, 300.0])
def test_the_finest_visible_is_where_the_sensitivity_crosses(luminance: float) -> None:
    for contrast in (0.02, 0.3, 1.0):
        finest = finest_visible(luminance, contrast)
        # The search ends within 2^-40 of a step.
        assert contrast * float(contrast_sensitivity(finest, luminance)) == pytest.approx(1.0, abs=1e-6)
        assert visible(contrast, 0.99 * finest, luminance)
        assert not visible(contrast, 1.01 * finest, luminance)
    assert finest_visible(luminance, 1e-5) == 0.0


def test_the_sentences_both_ways() -> None:
    near, far = FinestDetail.of(44.0, 130.0), FinestDetail.of(160.0, 130.0)
    assert "(22 cycles per degree)" in near.sentences()[0]
    assert near.sentences()[1].endswith("in lines 2 pixels wide or more")
    assert far.sentences()[0].endswith("too fine to be seen at any contrast")
    assert FinestDetail.of(18.0, 130.0).sentences()[1].endswith("down to one pixel")


def test_wrong_input() -> None:
    with pytest.raises(DeviceError, match="is 0 cycles per degree"):
        contrast_sensitivity([1.0, 0.0], 100.0)
    with pytest.raises(DeviceError, match="luminance is -3 cd/m²"):
        contrast_sensitivity(1.0, -3.0)
    with pytest.raises(DeviceError, match="field is inf degrees"):
        contrast_sensitivity(1.0, 1.0, np.inf)
    with pytest.raises(DeviceError, match="3 eyes"):
        contrast_sensitivity(1.0, 1.0, eyes=3)
    with pytest.raises(DeviceError, match="0 to 1"):
        visible(1.5, 1.0, 100.0)
