"""Tail probabilities of discrete statistics: the probability of a value at most as large as the observed value.

Where a statistic has few values, no test has exactly its nominal level. Three p values follow from a tail: the plain
p value, which is conservative; mid-p, which counts the observed value half and is right on average; and the randomised
p value, which is uniform under the null hypothesis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from documents.arrays import Floats
from documents.text import JsonResult

_NO_SKEW = 1e-6


@dataclass(frozen=True, slots=True)
class Tail(JsonResult):
    """Probability ``below`` of a smaller value and ``at`` of the same value, 0 to 1; ``exact``, or by moments.

    ``least_p`` is the smallest possible p: with few answers, even perfect answers may not be significant. It is 0 for
    an approximation by moments, which is used for many answers only.
    """

    below: float
    at: float
    exact: bool
    least_p: float
    json_names: ClassVar = "p mid_p exact least_p"

    @property
    def p(self) -> float:
        """Probability of a value at most as large."""
        return min(1.0, self.below + self.at)

    @property
    def mid_p(self) -> float:
        """The same, with the observed value counted half."""
        return min(1.0, self.below + self.at / 2)

    def randomised_p(self, share: float) -> float:
        """Return a p value that is uniform under the null hypothesis if ``share`` is uniform from 0 to 1."""
        return min(1.0, self.below + share * self.at)


def from_chances(chances: Floats, index: int) -> Tail:
    """Return the exact tail at ``index`` of a statistic with probabilities ``chances``, shape (k,), that sum to 1."""
    least = float(chances[chances > 0][0])
    return Tail(float(chances[:index].sum()), float(chances[index]), exact=True, least_p=least)


def from_moments(value: float, half_step: float, mean: float, variance: float, third: float) -> Tail:
    """Return the tail by `lower_tail`, corrected for continuity: values lie 2 · ``half_step`` apart."""
    edges = np.array([value - half_step, value + half_step]) - mean
    below, p = lower_tail(edges, np.full(2, variance), np.full(2, third))
    return Tail(float(below), float(p - below), exact=False, least_p=0.0)


def lower_tail(deviation: Floats, variance: Floats, third: Floats) -> Floats:
    """Return the probability of a value at most ``deviation`` above the mean, by a distribution with equal moments.

    The distribution is a shifted and scaled, or mirrored, χ² with the same mean, variance and third central moment
    (Pearson's type III), as in Kendall's own approximations [Kendall1940]. Without skewness it is the normal.

    Parameters
    ----------
    deviation, variance, third
        Shape (k,) each; ``variance`` above zero.
    """
    from scipy.special import chdtr, chdtrc, ndtr

    skewed = np.abs(third) > _NO_SKEW * variance**1.5
    scale = np.divide(third, 4 * variance, out=np.ones_like(variance), where=skewed)
    df = np.divide(8 * variance**3, third**2, out=np.ones_like(variance), where=skewed)
    chi = np.maximum(deviation / scale + df, 0.0)
    by_chi = np.where(scale > 0, chdtr(df, chi), chdtrc(df, chi))
    return np.asarray(np.where(skewed, by_chi, ndtr(deviation / np.sqrt(variance))))
