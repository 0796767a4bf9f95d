"""The verdict in a sentence."""

from __future__ import annotations

from analysis.validation.verdict import Verdict


def decision_sentence(verdict: Verdict) -> str:
    """Return the verdict in a sentence or two."""
    fails, unsaid = len(verdict.having("fails")), len(verdict.having("cannot say"))
    if verdict.decision == "validated":
        return "Validated: within the limits, the rendering is the photograph."
    if verdict.decision == "not validated":
        return f"Not validated: {fails} {'limit is' if fails == 1 else 'limits are'} not kept."
    return f"It cannot be said: {unsaid} {'thing is' if unsaid == 1 else 'things are'} not known well enough."
