"""One effect as a line of a table: estimate, intervals, and what it does to odds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.classes.multiplicity import two_sided_p
from analysis.scaling.fit import TWO_SIDED_95


@dataclass(frozen=True, slots=True)
class Effect:
    """The effect of a level, or of a number, on the strength.

    Attributes
    ----------
    factor, level
        Its factor and level; for numbers the level is "per unit" or "per doubling".
    reference
        The level with which it is compared; None for numbers and for sum coding, where it is the mean of all levels.
    estimate
        In nats.
    se, low, high, p
        Standard error by the model, 95 % interval by the normal law, and two-sided p of no effect.
    robust_se, robust_low, robust_high, robust_p
        The same by the sandwich clustered by observer, with Student's law of one degree of freedom less than there
        are observers [Cameron2015]; None with fewer than two observers, or where they hardly differ.
    """

    factor: str
    level: str
    reference: str | None
    estimate: float
    se: float
    low: float
    high: float
    p: float
    robust_se: float | None
    robust_low: float | None
    robust_high: float | None
    robust_p: float | None

    @property
    def odds_factor(self) -> float:
        """What the effect multiplies the odds of being preferred by: exp(estimate), infinite if too large."""
        with np.errstate(over="ignore"):
            return float(np.exp(self.estimate))

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON, also a row of a table."""
        odds = self.odds_factor
        return {
            "factor": self.factor,
            "level": self.level,
            "reference": self.reference,
            "estimate": self.estimate,
            "se": self.se,
            "low": self.low,
            "high": self.high,
            "p": self.p,
            "robust_se": self.robust_se,
            "robust_low": self.robust_low,
            "robust_high": self.robust_high,
            "robust_p": self.robust_p,
            "odds_factor": odds if np.isfinite(odds) else None,
        }


def effect(
    factor: str, level: str, reference: str | None, estimate: float, se: float, robust_se: float | None, observers: int
) -> Effect:
    """Return the effect with its intervals; ``robust_se`` None where there is no sandwich."""
    from scipy.special import stdtrit

    low, high = estimate - TWO_SIDED_95 * se, estimate + TWO_SIDED_95 * se
    p = _p(estimate, se, None)
    if robust_se is None:
        return Effect(factor, level, reference, estimate, se, low, high, p, None, None, None, None)
    reach = float(stdtrit(observers - 1, 0.975)) * robust_se
    robust_p = _p(estimate, robust_se, observers - 1)
    ends = (estimate - reach, estimate + reach)
    return Effect(factor, level, reference, estimate, se, low, high, p, robust_se, *ends, robust_p)


def _p(estimate: float, se: float, df: float | None) -> float:
    return float(two_sided_p(np.array(abs(estimate) / se), df))
