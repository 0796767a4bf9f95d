"""SSIM and the peak signal-to-noise ratio, of luminances as values in which equal steps are equally seen: PU21.

R. K. Mantiuk and M. Azimi 2021, "PU21: A novel perceptually uniform encoding for adapting existing quality metrics for
HDR" [Mantiuk2021]. The encoding is that for banding and glare, which the authors recommend; 100 cd/m² becomes 256, so
that measures made for codes of 0 to 255 on a display of 100 cd/m² can be taken as they are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from documents.arrays import Floats32
from stimuli.errors import StimulusError
from stimuli.measures import MapMeasure, ViewingConditions
from stimuli.pictures import Rows, bands_with_margin

# p1 to p7 of the encoding for banding and glare, as published with the article.
_P = (0.353487901, 0.3734658629, 8.277049286e-05, 0.9062562627, 0.09150303166, 0.9099517204, 596.3148142)
LOWEST_CD_M2, HIGHEST_CD_M2 = 0.005, 10_000.0
# The peak of ratios in dB, and the range of values of SSIM, in PU21's units: those of 100 cd/m².
PEAK = 256.0


def pu21_encoded(luminance_cd_m2: ArrayLike) -> NDArray[np.float64]:
    """Return PU21's values of luminances [Mantiuk2021].

    Parameters
    ----------
    luminance_cd_m2
        Luminances in cd/m², of any shape; below 0.005 and above 10,000, where the encoding ends, they take its ends.

    Returns
    -------
    numpy.ndarray
        Perceptually uniform values, 0 to 595.4, of the same shape: 256 for 100 cd/m².

    Examples
    --------
    >>> pu21_encoded([0.0, 0.1, 100.0, 10_000.0]).round(1).tolist()
    [0.0, 5.7, 256.4, 595.4]
    """
    p1, p2, p3, p4, p5, p6, p7 = _P
    light = np.clip(np.asarray(luminance_cd_m2, dtype=np.float64), LOWEST_CD_M2, HIGHEST_CD_M2) ** p4
    return np.asarray(np.maximum(p7 * (((p1 + p2 * light) / (1.0 + p3 * light)) ** p5 - p6), 0.0))


def pu21_decoded(values: ArrayLike) -> NDArray[np.float64]:
    """Return the luminances of PU21's values: undoes `pu21_encoded`.

    Parameters
    ----------
    values
        Perceptually uniform values, of any shape; below 0 and above 595.4 they are taken as these.

    Returns
    -------
    numpy.ndarray
        Luminances in cd/m², 0.005 to 10,000, of the same shape.

    Examples
    --------
    >>> float(pu21_decoded(pu21_encoded(42.0)).round(9))
    42.0
    """
    p1, p2, p3, p4, p5, p6, p7 = _P
    # Beyond the ends the formula has a pole, and comes back from it in the dark.
    encoded = np.clip(np.asarray(values, dtype=np.float64), 0.0, pu21_encoded(HIGHEST_CD_M2))
    share = (encoded / p7 + p6) ** (1.0 / p5)
    light = np.maximum((share - p1) / (p2 - p3 * share), 0.0) ** (1.0 / p4)
    return np.asarray(np.clip(light, LOWEST_CD_M2, HIGHEST_CD_M2))


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
    symmetric = True
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
    symmetric = True
    map_title = "difference of PU21 values"

    def error_map(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> Floats32:
        """Return the size of each pixel's difference in PU21's units, float32 (height, width)."""
        errors = np.empty(reference_XYZ.shape[:2], dtype=np.float32)
        for band, _, _ in bands_with_margin(reference_XYZ.shape, 0):
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
