"""ꟻLIP and SSIM on a real stereo photograph against their reference implementations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from skimage.metrics import structural_similarity

from devices.colour import linear_srgb_matrix
from stimuli.measures import ViewingConditions, measure_pictures, pu21_encoded
from stimuli.pictures import StereoImage, read_exr
from stimuli.pictures.stereo_image import Eye

SHARED = Path(__file__).parents[3] / ".." / "shared" / "data" / "stereo"
WHITE = np.array([90.0, 100.0, 120.0])


@pytest.mark.shared_data
@pytest.mark.skipif(not SHARED.is_dir(), reason="the real pictures of ../shared/data are not here")
def test_a_real_pair_beside_its_blurred_copy() -> None:
    evaluate = pytest.importorskip("flip_evaluator").evaluate
    photograph = read_exr(SHARED / "Adjuster.exr", "rec709")
    reference = StereoImage(*(_lit(photograph.eye(eye)) for eye in ("left", "right")))
    test = StereoImage(*(gaussian_filter(reference.eye(eye), (0.7, 0.7, 0)) for eye in ("left", "right")))
    table = measure_pictures(reference, test, ["flip", "hdr-flip", "pu-ssim"], ViewingConditions(45.0, WHITE))
    eyes: tuple[Eye, Eye] = ("left", "right")
    for eye in eyes:
        pictures = [reference.eye(eye), test.eye(eye)]
        linear = [np.maximum(one @ linear_srgb_matrix(WHITE).T, 0).astype(np.float32) for one in pictures]
        for name, kind in (("flip", "LDR"), ("hdr-flip", "HDR")):
            errors, _, _ = evaluate(*linear, kind, inputsRGB=False, applyMagma=False, parameters={"ppd": 45.0})
            got = table[name].eyes[eye]
            assert got.error_map is not None
            np.testing.assert_allclose(got.error_map, errors[..., 0], rtol=0, atol=1e-6)
            assert got.value == pytest.approx(float(errors.mean(dtype=np.float64)), abs=1e-6)
        theirs = structural_similarity(
            *(pu21_encoded(one[..., 1]) for one in pictures),
            gaussian_weights=True,
            sigma=1.5,
            use_sample_covariance=False,
            data_range=256,
        )
        assert table["pu-ssim"].eyes[eye].value == pytest.approx(float(theirs), abs=1e-6)
        assert 0.005 < table["flip"].eyes[eye].value < 0.5


def _lit(XYZ: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the middle of a picture at a mean luminance of 20 cd/m², without the negative light of its encoding."""
    middle = XYZ[260:420, 280:480]
    return np.asarray(np.maximum(middle * (20.0 / float(middle[..., 1].mean())), 0), dtype=np.float32)
