"""SSIM and the peak signal-to-noise ratio, of luminances on perceptually uniform values (PU21)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stimuli.errors import StimulusError
from stimuli.measures.measure import MapMeasure
from stimuli.measures.pu21 import PEAK, pu21_encoded
from stimuli.measures.viewing import ViewingConditions
from stimuli.pictures.rows import Floats32, Rows, bands, bands_with_margin

# The window of SSIM is 11 by 11 pixels: a Gaussian with a standard deviation of 1.5 pixels, cut at 3.5 of them.
_RADIUS_PX = 5
_SD_PX = 1.5


class PuSsim(MapMeasure):
    """The mean of the structural similarity [Wang2004] of luminances on PU21's values.

    Constants as published: K1 = 0.01, K2 = 0.03, an 11 × 11 window of a Gaussian of 1.5 pixels, variances of the
    population, a range of 256. Pixels within 5 of the picture's edge have no whole window, and no value.
    """

    name = "pu-ssim"
    title = "PU21-SSIM"
    unit = ""
    better = "higher"
    identical = 1.0
    source = "Wang2004, Mantiuk2021"
    map_title = "1 − SSIM"
    map_highest = 1.0

    def error_map(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> Floats32:
        """Return 1 − SSIM of each pixel, float32 (height, width); NaN near the edges. Raises StimulusError."""
        from skimage.metrics import structural_similarity

        height, width = reference_XYZ.shape[:2]
        if min(height, width) <= 2 * _RADIUS_PX:
            raise StimulusError.of(
                f"the pictures have {width} × {height} pixels, and the window of SSIM is 11 × 11",
                f"give larger pictures, or leave out '{self.name}'",
            )
        errors = np.full((height, width), np.nan, dtype=np.float32)
        for wanted, read, inner in bands_with_margin((height, width), _RADIUS_PX):
            if read.stop - read.start <= 2 * _RADIUS_PX:
                continue  # rows at the lower edge alone
            values = [pu21_encoded(picture[read][..., 1]) for picture in (reference_XYZ, test_XYZ)]
            _, similar = structural_similarity(
                *values,
                gaussian_weights=True,
                sigma=_SD_PX,
                use_sample_covariance=False,
                data_range=PEAK,
                K1=0.01,
                K2=0.03,
                full=True,
            )
            errors[wanted] = 1.0 - similar[inner]
        for edge in (slice(None, _RADIUS_PX), slice(-_RADIUS_PX, None)):
            errors[edge] = np.nan
            errors[:, edge] = np.nan
        return errors

    def pooled(self, errors: NDArray[np.float32]) -> float:
        """Return the mean SSIM of the pixels that have a value. Raises StimulusError if none has."""
        whole = errors[~np.isnan(errors)]
        if not whole.size:
            raise StimulusError(f"no pixel that counts lies {_RADIUS_PX + 1} pixels from the edge, as SSIM needs")
        return 1.0 - float(whole.mean(dtype=np.float64))


class PuPsnr(MapMeasure):
    """The ratio of a peak of 256 to the root mean square difference of luminances on PU21's values, in dB."""

    name = "pu-psnr"
    title = "PU21-PSNR"
    unit = "dB"
    better = "higher"
    identical = float("inf")
    source = "Mantiuk2021"
    map_title = "difference of PU21 values"

    def error_map(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> Floats32:
        """Return the size of each pixel's difference in PU21's units, float32 (height, width)."""
        errors = np.empty(reference_XYZ.shape[:2], dtype=np.float32)
        for band in bands(reference_XYZ.shape):
            first, second = (pu21_encoded(picture[band][..., 1]) for picture in (reference_XYZ, test_XYZ))
            errors[band] = np.abs(first - second)
        return errors

    def pooled(self, errors: NDArray[np.float32]) -> float:
        """Return the ratio in dB, infinity for no difference."""
        return _decibels(float(np.mean(np.square(errors, dtype=np.float64))) / PEAK**2)

    def binocular(self, values: Sequence[float]) -> float:
        """Return the ratio of the mean square difference of both eyes, in dB."""
        return _decibels(sum(10.0 ** (-value / 10.0) for value in values) / len(values))


def _decibels(share: float) -> float:
    """Return the ratio whose inverse is ``share``, in dB."""
    return -10.0 * float(np.log10(share)) if share > 0 else float("inf")
