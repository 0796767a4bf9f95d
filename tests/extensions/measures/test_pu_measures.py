"""SSIM and PSNR on PU21's values; what ColorVideoVDP refuses."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

from extensions.measures import pu21_decoded, pu21_encoded
from extensions.measures.cvvdp import ColorVideoVDP
from stimuli.errors import StimulusError
from stimuli.measures import (
    PicturePair,
    ViewingConditions,
    measure_named,
    measure_pairs,
    measure_pictures,
)
from stimuli.pictures import StereoImage, rows

VIEWING = ViewingConditions(45.0, np.array([95.0, 100.0, 108.9]))
GREY = np.full((32, 32, 3), 40.0, dtype=np.float32)

# SSIM and the signal-to-noise ratio on PU21's values: the encoding, and both against slow and obvious twins.


def wang_2004(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """The definition, window by window: an 11 × 11 Gaussian of 1.5 pixels, K1 = 0.01, K2 = 0.03, L = 256."""
    axis = np.exp(-0.5 * (np.arange(-5, 6) / 1.5) ** 2)
    window = np.outer(axis, axis) / np.outer(axis, axis).sum()
    c1, c2 = (0.01 * 256) ** 2, (0.03 * 256) ** 2
    values = []
    for y in range(5, first.shape[0] - 5):
        for x in range(5, first.shape[1] - 5):
            a, b = (picture[y - 5 : y + 6, x - 5 : x + 6] for picture in (first, second))
            mean_a, mean_b = (window * a).sum(), (window * b).sum()
            var_a, var_b = (window * (a - mean_a) ** 2).sum(), (window * (b - mean_b) ** 2).sum()
            cov = (window * (a - mean_a) * (b - mean_b)).sum()
            values.append(
                (2 * mean_a * mean_b + c1) * (2 * cov + c2) / ((mean_a**2 + mean_b**2 + c1) * (var_a + var_b + c2))
            )
    return float(np.mean(values))


def pair(seed: int = 1) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    rng = np.random.default_rng(seed)
    reference = np.exp(rng.uniform(-2.0, 7.0, (6, 8, 3))).repeat(6, axis=0).repeat(6, axis=1)
    reference = (reference * rng.uniform(0.8, 1.2, reference.shape)).astype(np.float32)
    return reference, (reference * rng.normal(1.0, 0.08, reference.shape)).clip(0).astype(np.float32)


def test_the_published_ends_and_the_anchor() -> None:
    # The ends that the authors' own encoder states, 5.4705e-10 and 595.3939, and 100 cd/m² near 256.
    low, anchor, high = pu21_encoded([0.005, 100.0, 10_000.0])
    assert low == pytest.approx(5.4705e-10, abs=5e-13)
    assert high == pytest.approx(595.3939, abs=5e-5)
    assert anchor == pytest.approx(256.0, abs=0.5)
    np.testing.assert_array_equal(pu21_encoded([0.0, 1e6]), [low, high])


@given(st.floats(0.005, 10_000.0), st.floats(1.0001, 1.5))
def test_decoding_undoes_encoding_and_more_light_is_more(luminance: float, factor: float) -> None:
    value = float(pu21_encoded(luminance))
    assert float(pu21_decoded(value)) == pytest.approx(luminance, rel=1e-6)
    if luminance * factor <= 10_000.0:
        assert float(pu21_encoded(luminance * factor)) > value


def test_psnr_is_that_of_scikit_image_at_a_peak_of_256() -> None:
    reference, test = pair()
    encoded = [pu21_encoded(picture[..., 1]) for picture in (reference, test)]
    got = measure_named("pu-psnr").measure(reference, test, VIEWING).value
    # The map is kept in single precision.
    assert got == pytest.approx(float(peak_signal_noise_ratio(*encoded, data_range=256)), abs=1e-5)


def test_identical_pictures_and_both_eyes() -> None:
    reference, test = pair()
    row = measure_pictures(
        StereoImage(reference, test), StereoImage(reference, reference.copy()), ["pu-psnr"], VIEWING
    )["pu-psnr"]
    assert row.eyes["left"].value == float("inf")
    assert row.binocular == pytest.approx(row.eyes["right"].value + 10 * np.log10(2), abs=1e-9)
    assert row.to_json()["left"] is None
    assert row.to_json()["identical"] is None
    same = measure_pictures(reference, reference, ["pu-psnr", "pu-ssim"], VIEWING)
    assert same["pu-psnr"].eyes["both"].value == float("inf")
    assert same["pu-ssim"].eyes["both"].value == 1.0


def test_pictures_smaller_than_the_window() -> None:
    small = np.full((10, 40, 3), 5.0)
    with pytest.raises(StimulusError, match="40 × 10 pixels"):
        measure_pictures(small, small, ["pu-ssim"], VIEWING)


def test_pixels_that_count_only_near_the_edge() -> None:
    reference, test = pair()
    counted = np.zeros(reference.shape[:2], dtype=bool)
    counted[0] = True
    with pytest.raises(StimulusError, match="6 pixels from the edge"):
        measure_pairs({"both": PicturePair(reference, test, counted=counted)}, ["pu-ssim"], VIEWING)


def test_values_beyond_the_ends_are_decoded_as_the_ends() -> None:
    np.testing.assert_allclose(pu21_decoded([-5.0, 0.0, 600.0, 1e4, np.inf]), [0.005, 0.005, 1e4, 1e4, 1e4], rtol=1e-9)


@pytest.mark.parametrize("band_pixels", [1 << 19, 48 * 20])
def test_ssim_is_that_of_the_definition_and_of_scikit_image(monkeypatch: pytest.MonkeyPatch, band_pixels: int) -> None:
    reference, test = pair()
    encoded = [pu21_encoded(picture[..., 1]) for picture in (reference, test)]
    monkeypatch.setattr(rows, "BAND_PIXELS", band_pixels)
    got = measure_named("pu-ssim").measure(reference, test, VIEWING).value
    assert got == pytest.approx(wang_2004(*encoded), abs=1e-6)
    theirs = structural_similarity(
        *encoded, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=256
    )
    assert got == pytest.approx(float(theirs), abs=1e-7)
    assert 0.3 < got < 0.999


def test_a_package_that_cannot_be_loaded_is_one_message(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(StimulusError, match="ColorVideoVDP cannot be loaded") as raised:
        ColorVideoVDP().measure(GREY, GREY, ViewingConditions(45.0))
    assert "torchvision" in str(raised.value)


def test_too_far_away() -> None:
    with pytest.raises(StimulusError, match="check the viewing distance"):
        ColorVideoVDP().measure(GREY, GREY, ViewingConditions(1e5))
