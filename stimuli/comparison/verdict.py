"""Is the rendering validated? The numbers held against their limits, every one with its reason.

Colour is judged on the regions' means, and pixel by pixel as the eye resolves it: a difference that only stands between
pixels cancels at the viewing distance and is noted, not failed (the plate of thesis Table 5.5). Sparkle is judged by
`sparkle_reasons`. Where a number that would decide is missing or too uncertain, nothing can be said.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from stimuli.comparison.evidence import Evidence
from stimuli.comparison.judge_colour import colour_reasons
from stimuli.comparison.judge_place import disparity_reasons, registration_reasons
from stimuli.comparison.judge_sparkle import sparkle_reasons
from stimuli.comparison.limits import Limits
from stimuli.comparison.reason import Outcome, Reason
from stimuli.comparison.standing_out import region_notes

Decision = Literal["validated", "not validated", "cannot say"]


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
        return asdict(self)


def judge(evidence: Evidence, limits: Limits | None = None) -> Verdict:
    """Return the verdict on one pair."""
    limits = limits or Limits()
    reasons = [
        *colour_reasons(evidence, limits),
        *sparkle_reasons(evidence.sparkle, limits),
        *registration_reasons(evidence.registration, limits),
        *disparity_reasons(evidence.disparity, limits),
        *region_notes(evidence.regions, limits),
    ]
    return _decided(reasons, limits)


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
        replace(reason, subject=f"{name}: {reason.subject}", said=f"{name}: {reason.said}")
        for name, verdict in verdicts.items()
        for reason in verdict.reasons
    ]
    return _decided(reasons, next(iter(verdicts.values())).limits)


def _decided(reasons: list[Reason], limits: Limits) -> Verdict:
    order: tuple[Outcome, ...] = ("fails", "cannot say", "noted", "passes")
    ordered = tuple(sorted(reasons, key=lambda reason: order.index(reason.outcome)))
    outcomes = {reason.outcome for reason in reasons}
    decision: Decision = "validated"
    if "fails" in outcomes:
        decision = "not validated"
    elif "cannot say" in outcomes or "passes" not in outcomes:
        decision = "cannot say"
    return Verdict(decision, ordered, limits)
