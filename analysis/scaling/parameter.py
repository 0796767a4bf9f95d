"""A parameter beside the strengths: estimate, interval, and what it does to odds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

TWO_SIDED_95 = 1.959963984540054


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a fitted law.

    Attributes
    ----------
    name
        ``nu`` or ``eta`` (ties), or ``order`` (what being shown first adds).
    estimate, se
        On the scale on which it was fitted: log ν, log η, or δ, in the units of the strengths.
    low, high
        95 % interval of ``estimate``, ± 1.96 se.
    factor
        exp(estimate) with the ends of its interval: ν, η, or what being shown first multiplies the odds
        by; None for an order effect in Thurstone's law, which has no odds.
    """

    name: str
    estimate: float
    se: float
    is_factor: bool = True

    @property
    def low(self) -> float:
        """Lower end."""
        return self.estimate - TWO_SIDED_95 * self.se

    @property
    def high(self) -> float:
        """Upper end."""
        return self.estimate + TWO_SIDED_95 * self.se

    @property
    def factor(self) -> tuple[float, float, float] | None:
        """Estimate, lower and upper end as factors; η is never below 1, and an end too large to write is infinite."""
        if not self.is_factor:
            return None
        with np.errstate(over="ignore"):
            value, low, high = (float(np.exp(number)) for number in (self.estimate, self.low, self.high))
        return value, max(low, 1.0) if self.name == "eta" else low, high

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        told: dict[str, Any] = {"name": self.name, "estimate": self.estimate, "se": self.se}
        told |= {"low": self.low, "high": self.high}
        if self.factor is not None:
            ends = (number if math.isfinite(number) else None for number in self.factor)
            told |= dict(zip(("factor", "factor_low", "factor_high"), ends, strict=True))
        return told
