"""ꟻLIP and SSIM on the shipped study's pictures, and on a real stereo photograph, against their own implementations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from skimage.metrics import structural_similarity

from devices.colour import linear_srgb_matrix
from devices.eyes import AnyEye
from extensions.measures import pu21_encoded
from stimuli.measures import MeasureTable, ViewingConditions, measure_pictures
from stimuli.pictures import StereoImage, read_exr
from tests.kept import known

NAMES = ("flip", "hdr-flip", "pu-ssim")


def equal_to_the_reference(
    table: MeasureTable, eye: AnyEye, reference: NDArray[np.float32], test: NDArray[np.float32]
) -> None:
    """Each pixel's ꟻLIP, the means and SSIM within 1e-6."""
    evaluate = pytest.importorskip("flip_evaluator").evaluate
    white, density = table.viewing.white_XYZ, table.viewing.pixels_per_degree
    linear = [np.maximum(one @ linear_srgb_matrix(white).T, 0).astype(np.float32) for one in (reference, test)]
    for name, kind in (("flip", "LDR"), ("hdr-flip", "HDR")):
        errors, _, _ = evaluate(*linear, kind, inputsRGB=False, applyMagma=False, parameters={"ppd": density})
        got = table[name].eyes[eye]
        np.testing.assert_allclose(known(got.error_map), errors[..., 0], rtol=0, atol=1e-6)
        assert got.value == pytest.approx(float(errors.mean(dtype=np.float64)), abs=1e-6)
        assert 0.005 < got.value < 0.8
    theirs = structural_similarity(
        *(pu21_encoded(one[..., 1]) for one in (reference, test)),
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        data_range=256,
    )
    assert table["pu-ssim"].eyes[eye].value == pytest.approx(float(theirs), abs=1e-6)


def _lit(XYZ: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the middle of a picture at a mean luminance of 20 cd/m², without the negative light of its encoding."""
    middle = XYZ[260:370, 280:420]
    return np.asarray(np.maximum(middle * (20.0 / float(middle[..., 1].mean())), 0), dtype=np.float32)


@pytest.mark.shared_data
def test_a_real_pair_beside_its_blurred_copy(shared_data: Path) -> None:
    pytest.importorskip("flip_evaluator")
    photograph = read_exr(shared_data / "data/stereo/Adjuster.exr", "rec709")
    reference = StereoImage(_lit(photograph.left), _lit(photograph.right))
    test = StereoImage(*(gaussian_filter(one, (0.7, 0.7, 0)) for one in (reference.left, reference.right)))
    viewing = ViewingConditions(45.0, np.array([90.0, 100.0, 120.0]))
    table = measure_pictures(reference, test, NAMES, viewing)
    equal_to_the_reference(table, "left", reference.left, test.left)
    equal_to_the_reference(table, "right", reference.right, test.right)
