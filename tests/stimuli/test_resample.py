"""Area resampling against a twin that visits every pair of pixels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from stimuli.errors import StimulusError
from stimuli.resample import area_weights, resample


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


@given(st.integers(1, 60), st.floats(0.5, 50), st.floats(0.3, 20))
def test_weights_equal_the_plain_twin(pixels: int, length_mm: float, pitch_mm: float) -> None:
    weights = area_weights(pixels, length_mm, pitch_mm)
    np.testing.assert_allclose(weights.toarray(), area_weights_plain(pixels, length_mm, pitch_mm), rtol=0, atol=1e-9)


def test_the_plate_on_the_rig_keeps_its_light() -> None:
    columns, rows = area_weights(2190, 150, 0.2768), area_weights(1460, 100, 0.2768)
    assert (columns.shape[0], rows.shape[0]) == (542, 361)
    image = np.random.default_rng(0).uniform(0, 100, (1460, 2190)).astype(np.float32)
    image[[0, 1, -1, -2]] = 0  # what 361 display pixels crop
    small = resample(image, rows, columns)
    light = image.sum(dtype=np.float64) * (150 / 2190) * (100 / 1460)
    assert small.sum() * 0.2768**2 == pytest.approx(light, rel=1e-6)
    np.testing.assert_allclose(np.asarray(columns.sum(axis=1))[1:-1], 1.0, atol=1e-12)


def test_the_same_grid_changes_nothing() -> None:
    image = np.random.default_rng(0).uniform(0, 1, (5, 8))
    rows, columns = area_weights(5, 5.0, 1.0), area_weights(8, 8.0, 1.0)
    np.testing.assert_allclose(resample(image, rows, columns), image, atol=1e-12)


@pytest.mark.parametrize("pitch", [0.0, -0.1, float("nan"), 1e-9])
def test_a_pitch_that_cannot_be_is_refused(pitch: float) -> None:
    with pytest.raises(StimulusError, match="pixel_pitch_mm"):
        area_weights(10, 150.0, pitch)
