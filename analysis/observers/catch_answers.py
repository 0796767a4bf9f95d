"""What each observer answered where the answer was known, or where there was nothing to prefer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from analysis.comparisons.session_comparisons import KINDS
from analysis.records.session_record import SessionLog


@dataclass(frozen=True, slots=True)
class CatchAnswers:
    """One observer's catch trials.

    ``right`` of ``obvious`` pairs were answered as they should. Of ``identical`` pairs of one stimulus with itself, so
    many were answered ``first`` and ``second``; the rest prefer neither.
    """

    obvious: int
    right: int
    identical: int
    first: int
    second: int

    @property
    def missed(self) -> int:
        """How many obvious pairs were answered otherwise."""
        return self.obvious - self.right

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        same = {"trials": self.identical, "first": self.first, "second": self.second}
        return {"obvious": self.obvious, "right": self.right, "identical": same}


def catch_answers(sessions: Sequence[SessionLog]) -> CatchAnswers:
    """Count the catch trials of one observer's ``sessions``, each trial's last attempt; practice does not count."""
    trials = [trial for session in sessions for trial in session.trials if trial.kind in KINDS]
    obvious = [trial for trial in trials if trial.data.get("catch") == "obvious"]
    same = [str(trial.data.get("answer")) for trial in trials if trial.data.get("catch") == "identical"]
    right = sum(trial.data.get("correct") is True for trial in obvious)
    return CatchAnswers(len(obvious), right, len(same), same.count("first"), same.count("second"))
