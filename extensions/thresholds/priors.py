"""What is known of a psychometric function before any answer, relative to the range of the levels, as in [Schutt2016].

The threshold is even on the axis over the levels and half of their range beyond; the logarithm of the slope is normal,
about a rise from 10 to 90 % over a quarter of the range, with a standard deviation of ln 3; lapse rate and (yes/no)
rate of false alarms are Beta(1, 19). The adaptive method and the fit share them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from documents.arrays import Floats
from extensions.thresholds.functions import Psychometric

BEYOND = 0.5  # how far thresholds may lie beyond the levels, in ranges of them
LOG_SPREAD = float(np.log(3.0))
_SHARE_OF_RANGE = 0.25  # over which the function of the prior's middle rises from 10 to 90 %
_RATE_WEIGHT = 18.0  # of Beta(1, 19)


def middle_log_slope(function: Psychometric, span: float) -> float:
    """Return the prior's middle of ln slope for levels that span ``span`` on the axis, above 0."""
    return float(np.log(function.rise / (_SHARE_OF_RANGE * span)))


def log_slope_prior(log_slope: ArrayLike, middle: float) -> Floats:
    """Return the log density of ln slope, but for a constant."""
    return np.asarray(-(((np.asarray(log_slope, np.float64) - middle) / LOG_SPREAD) ** 2) / 2)


def rate_prior(rate: ArrayLike) -> Floats:
    """Return the log density of a rate, 0 to below 1, but for a constant."""
    return np.asarray(_RATE_WEIGHT * np.log1p(-np.asarray(rate, np.float64)))
