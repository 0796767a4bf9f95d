"""The rows of the factors' figure, which are the rows of the table behind it: every level, the reference too."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from analysis.factors.result import FactorEffects
from analysis.factors.rows import Effect
from analysis.factors.values import Factor


@dataclass(frozen=True, slots=True)
class DrawnRow:
    """One row: an effect in nats with both intervals; the effect of a number is that of its range among the items.

    Attributes
    ----------
    factor, level
        Its factor, and the level or the range, such as "0.125 to 1".
    is_reference
        Whether it is the level that the others are compared with; its estimate is 0 and it has no intervals.
    estimate, interval, robust_interval
        In nats; an interval is None where there is none.
    p, robust_p
        As in `analysis.factors.rows.Effect`.
    """

    factor: str
    level: str
    is_reference: bool
    estimate: float
    interval: tuple[float, float] | None
    robust_interval: tuple[float, float] | None
    p: float | None
    robust_p: float | None

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON, also a row of a table."""
        return {
            "factor": self.factor,
            "level": self.level,
            "is_reference": self.is_reference,
            "estimate": self.estimate,
            **_ends("low", "high", self.interval),
            "p": self.p,
            **_ends("robust_low", "robust_high", self.robust_interval),
            "robust_p": self.robust_p,
        }


def drawn_rows(found: FactorEffects) -> tuple[DrawnRow, ...]:
    """Return the rows, factor by factor; none where there is no finite maximum."""
    return tuple(row for factor in found.factors for row in _of_factor(factor, found))


def _of_factor(factor: Factor, found: FactorEffects) -> Iterator[DrawnRow]:
    mine = [effect for effect in found.effects if effect.factor == factor.name]
    if mine and mine[0].reference is not None:
        yield DrawnRow(factor.name, mine[0].reference, True, 0.0, None, None, None, None)
    for effect in mine:
        yield _row(effect, *_reach(factor, effect))


def _reach(factor: Factor, effect: Effect) -> tuple[str, float]:
    """Return what the row is called and what its effect in nats is multiplied by."""
    if factor.kind == "categorical":
        return effect.level, 1.0
    low, high = min(map(float, factor.values)), max(map(float, factor.values))
    ends = (2**low, 2**high) if factor.kind == "log2" else (low, high)
    return f"{ends[0]:.3g} to {ends[1]:.3g}", high - low


def _row(effect: Effect, level: str, reach: float) -> DrawnRow:
    robust = None
    if effect.robust_low is not None and effect.robust_high is not None:
        robust = effect.robust_low * reach, effect.robust_high * reach
    interval = effect.low * reach, effect.high * reach
    estimate = effect.estimate * reach
    return DrawnRow(effect.factor, level, False, estimate, interval, robust, effect.p, effect.robust_p)


def _ends(low: str, high: str, interval: tuple[float, float] | None) -> dict[str, float | None]:
    ends = interval or (None, None)
    return {low: ends[0], high: ends[1]}
