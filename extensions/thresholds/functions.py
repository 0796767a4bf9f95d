"""Psychometric functions: the probability of a right (or "yes") answer by the level of a stimulus.

p(x) = γ + (1 − γ − λ) F(β (x − α)) with threshold α, slope β, guess rate γ and lapse rate λ. x is the level's decimal
logarithm, or the level itself where levels are 0 or below. At α, F is 1/2 (logistic, normal) or 1 − 1/e (Weibull).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from documents.arrays import Floats


@dataclass(frozen=True, slots=True)
class Psychometric:
    """A shape F, rising from 0 to 1 with z = β (x − α), and F(0), ``at_threshold``.

    ``rise`` is how far z goes from F = 0.1 to F = 0.9.
    """

    name: str
    shape: Callable[[Floats], Floats]
    at_threshold: float
    rise: float

    def probability(
        self, x: ArrayLike, threshold: ArrayLike, slope: ArrayLike, guess: ArrayLike, lapse: ArrayLike
    ) -> Floats:
        """Return the probability of a right answer, 0 to 1; the arguments' shapes are broadcast.

        ``x`` and ``threshold`` are on the axis, ``slope`` is per unit of it; ``guess`` and ``lapse`` are rates.
        """
        x, threshold, slope = (np.asarray(each, np.float64) for each in (x, threshold, slope))
        guess, lapse = np.asarray(guess, np.float64), np.asarray(lapse, np.float64)
        return np.asarray(guess + (1.0 - guess - lapse) * self.shape(slope * (x - threshold)))


def _logistic(z: Floats) -> Floats:
    from scipy.special import expit

    return np.asarray(expit(z), np.float64)


def _normal(z: Floats) -> Floats:
    from scipy.special import ndtr

    return np.asarray(ndtr(z), np.float64)


def _weibull(z: Floats) -> Floats:
    return np.asarray(-np.expm1(-(10.0 ** np.minimum(z, 3.0))))


# The slope of the Weibull function is its exponent where x is the decimal logarithm of the level.
FUNCTIONS: Mapping[str, Psychometric] = MappingProxyType(
    {
        "weibull": Psychometric("weibull", _weibull, 1.0 - np.exp(-1.0), 1.3395),
        "logistic": Psychometric("logistic", _logistic, 0.5, 4.3944),
        "normal": Psychometric("normal", _normal, 0.5, 2.5631),
    }
)
