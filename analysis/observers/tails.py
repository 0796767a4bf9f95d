"""The chance of a statistic at most as large as the one observed, for statistics that move in steps.

Where a statistic has few values, no test of it holds its level exactly. Three p values follow from one tail: the
plain one, which errs by being too large; mid-p, which counts the value observed half and is right on average; and the
randomised one, which is uniform under chance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_NO_SKEW = 1e-6


@dataclass(frozen=True, slots=True)
class Tail:
    """Chance ``below`` of a smaller value and ``at`` of the same, each 0 to 1; ``exact`` or by a law of moments.

    ``least_p`` is the smallest p that could have come out: where there are few answers, even the best are no proof. It
    is 0 by a law of moments, which needs many answers anyway.
    """

    below: float
    at: float
    exact: bool
    least_p: float

    @property
    def p(self) -> float:
        """Chance of a value at most as large."""
        return min(1.0, self.below + self.at)

    @property
    def mid_p(self) -> float:
        """The same with the value itself counted half."""
        return min(1.0, self.below + self.at / 2)

    def randomised_p(self, share: float) -> float:
        """Return a p value that is uniform under chance if ``share`` was drawn evenly from 0 to 1."""
        return min(1.0, self.below + share * self.at)

    def to_json(self) -> dict[str, Any]:
        """Return the p values and whether they are exact."""
        return {"p": self.p, "mid_p": self.mid_p, "exact": self.exact, "least_p": self.least_p}


def from_chances(chances: Floats, index: int) -> Tail:
    """Return the exact tail at ``index`` of a statistic with ``chances``, shape (k,), that sum to 1."""
    least = float(chances[chances > 0][0])
    return Tail(float(chances[:index].sum()), float(chances[index]), exact=True, least_p=least)


def from_moments(value: float, half_step: float, mean: float, variance: float, third: float) -> Tail:
    """Return the tail by `lower_tail`, corrected for continuity: values lie 2 · ``half_step`` apart."""
    edges = np.array([value - half_step, value + half_step]) - mean
    below, p = lower_tail(edges, np.full(2, variance), np.full(2, third))
    return Tail(float(below), float(p - below), exact=False, least_p=0.0)


def lower_tail(deviation: Floats, variance: Floats, third: Floats) -> Floats:
    """Return the chance of a value at most ``deviation`` above its mean, by the law that shares its first moments.

    The law is χ² moved and stretched, or mirrored, so that mean, variance and third central moment agree (Pearson's
    type III): that of Kendall's own approximations [Kendall1940]. Without skewness it is the normal law.

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
