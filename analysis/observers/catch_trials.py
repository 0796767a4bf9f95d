"""Catch trials: who missed an obvious answer, and which place was preferred where there was nothing to prefer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from analysis.comparisons.session_comparisons import KINDS
from analysis.records.session_record import SessionLog


@dataclass(frozen=True, slots=True)
class CatchResults:
    """What the catch trials of some sessions came to.

    ``obvious`` counts pairs with an obvious answer, ``missed`` maps each observer who gave another answer to how often
    they did and to how many such pairs they met. ``identical`` counts stimuli shown beside themselves, ``first`` how
    many of these were answered with the first place and ``second`` with the second; the rest are ties.
    """

    obvious: int
    missed: dict[str, tuple[int, int]]
    identical: int
    first: int
    second: int

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "obvious": self.obvious,
            "missed": {observer: list(counts) for observer, counts in self.missed.items()},
            "identical": {"trials": self.identical, "first": self.first, "second": self.second},
        }


def catch_results(sessions: Sequence[SessionLog]) -> CatchResults:
    """Count the catch trials of ``sessions``, each trial's last attempt; those of a practice do not count."""
    met: dict[str, int] = {}
    missed: dict[str, int] = {}
    same: list[str] = []
    for session in sessions:
        observer = session.header.observer
        for trial in session.trials:
            if trial.kind not in KINDS:
                continue
            if trial.data.get("catch") == "obvious":
                met[observer] = met.get(observer, 0) + 1
                missed[observer] = missed.get(observer, 0) + (trial.data.get("correct") is not True)
            elif trial.data.get("catch") == "identical":
                same.append(str(trial.data.get("answer")))
    failed = {observer: (count, met[observer]) for observer, count in missed.items() if count}
    return CatchResults(sum(met.values()), failed, len(same), same.count("first"), same.count("second"))
