"""A verdict: the limits that a rendering must keep to be validated, and every reason for the decision."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from documents import Finding
from documents.text.json_values import json_fields
from stimuli.errors import StimulusError

Outcome = Literal["passes", "fails", "cannot say", "noted"]
Decision = Literal["validated", "not validated", "cannot say"]


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of a verdict.

    Parameters
    ----------
    delta_e
        ΔE00 up to which two colours count as equal: 1.0 ± 0.4 of Berns and Hou for car paint, thesis Section 5.5.
    above_limit_percent
        So many percent of the pixels may differ by more, as the eye resolves them.
    registration_residual_px
        Pictures that lie further apart are not compared pixel by pixel.
    sparkle_relative, sparkle_z, sparkle_relative_se
        Sparkle differs if it does by more than this share and by more than so many standard errors; if a share's
        standard error is larger than the last, the verdict is open.
    disparity_px
        So far may the disparities of photograph and rendering lie apart.
    stands_out_delta_xy, stands_out_luminance, stands_out_z
        A region whose chromaticity, or share of luminance, departs from that of the others by more is named.
    """

    delta_e: float = 1.4
    above_limit_percent: float = 5.0
    registration_residual_px: float = 0.25
    sparkle_relative: float = 0.10
    sparkle_z: float = 2.58
    sparkle_relative_se: float = 0.25
    disparity_px: float = 0.5
    stands_out_delta_xy: float = 0.001
    stands_out_luminance: float = 0.01
    stands_out_z: float = 3.0

    def __post_init__(self) -> None:
        for name, value in json_fields(self).items():
            if not 0 < value < float("inf"):
                raise StimulusError(Finding(f"the limit '{name}' is {value}", remedy="a finite number above 0"))

    def to_json(self) -> dict[str, float]:
        """Return the limits by name."""
        return json_fields(self)


@dataclass(frozen=True, slots=True)
class Reason:
    """One thing that was judged: ``value`` against ``limit`` (None where there is none), and a ``sentence`` on it."""

    subject: str
    measure: str
    outcome: Outcome
    sentence: str
    value: float | None = None
    limit: float | None = None
    unit: str = ""

    def to_json(self) -> dict[str, float | str | None]:
        """Return it as plain JSON."""
        return {
            "subject": self.subject,
            "measure": self.measure,
            "outcome": self.outcome,
            "said": self.sentence,
            "value": self.value,
            "limit": self.limit,
            "unit": self.unit,
        }


def decimals(value: float, count: int) -> str:
    """Return a number with ``count`` decimals; zero has no sign."""
    text = f"{value:.{count}f}"
    return text.lstrip("-") if float(text) == 0 else text


@dataclass(frozen=True, slots=True)
class Verdict:
    """``decision`` with every reason, failures first."""

    decision: Decision
    reasons: tuple[Reason, ...]
    limits: Limits

    def having(self, outcome: Outcome) -> tuple[Reason, ...]:
        """Return the reasons of one outcome."""
        return tuple(reason for reason in self.reasons if reason.outcome == outcome)

    def to_json(self) -> dict[str, Any]:
        """Return it as plain JSON."""
        return {
            "decision": self.decision,
            "reasons": [reason.to_json() for reason in self.reasons],
            "limits": self.limits.to_json(),
        }


def together(verdicts: Mapping[str, Verdict]) -> Verdict:
    """Return the verdict on several pairs, such as both eyes', by name: one that is not validated decides.

    Raises
    ------
    ValueError
        If there is none.
    """
    if not verdicts:
        raise ValueError("no verdicts")
    reasons = [
        replace(reason, subject=f"{name}: {reason.subject}", sentence=f"{name}: {reason.sentence}")
        for name, verdict in verdicts.items()
        for reason in verdict.reasons
    ]
    return decided(reasons, next(iter(verdicts.values())).limits)


def decided(reasons: list[Reason], limits: Limits) -> Verdict:
    """Return the verdict that follows from the reasons: one failure is enough for "not validated"."""
    order: tuple[Outcome, ...] = ("fails", "cannot say", "noted", "passes")
    ordered = tuple(sorted(reasons, key=lambda reason: order.index(reason.outcome)))
    outcomes = {reason.outcome for reason in reasons}
    decision: Decision = "validated"
    if "fails" in outcomes:
        decision = "not validated"
    elif "cannot say" in outcomes or "passes" not in outcomes:
        decision = "cannot say"
    return Verdict(decision, ordered, limits)
