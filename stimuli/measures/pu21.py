"""PU21: luminance as values in which equal steps are equally seen [Mantiuk2021].

R. K. Mantiuk and M. Azimi 2021, "PU21: A novel perceptually uniform encoding for adapting existing quality metrics for
HDR". The encoding is that for banding and glare, which the authors recommend; 100 cd/m² becomes 256, so that measures
made for codes of 0 to 255 on a display of 100 cd/m² can be taken as they are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
