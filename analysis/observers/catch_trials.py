"""Catch trials: pairs with an obvious answer, and pairs of one stimulus with itself, where nothing is to prefer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from analysis.comparisons.session_comparisons import KINDS
from analysis.records.results import sessions_by_observer
from analysis.records.session_record import SessionLog


@dataclass(frozen=True, slots=True)
class CatchAnswers:
    """One observer's catch trials.

    ``right`` of ``obvious`` pairs were answered as they should be. Of ``identical`` pairs of one stimulus with itself,
    ``first`` were answered with the first position and ``second`` with the second; the others prefer neither.
    """

    obvious: int
    right: int
    identical: int
    first: int
    second: int

    @property
    def missed(self) -> int:
        """How many obvious pairs were answered wrongly."""
        return self.obvious - self.right

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {"obvious": self.obvious, "right": self.right, "identical": _identical(self)}


@dataclass(frozen=True, slots=True)
class CatchResults:
    """The catch trials of several observers."""

    by_observer: Mapping[str, CatchAnswers]

    @property
    def missed(self) -> dict[str, tuple[int, int]]:
        """For each observer who missed any obvious pair: how many, and of how many."""
        return {name: (own.missed, own.obvious) for name, own in self.by_observer.items() if own.missed}

    @property
    def obvious(self) -> int:
        """How many obvious pairs there were."""
        return sum(own.obvious for own in self.by_observer.values())

    @property
    def identical(self) -> int:
        """How many pairs of one stimulus with itself there were."""
        return sum(own.identical for own in self.by_observer.values())

    @property
    def first(self) -> int:
        """How many of these were answered with the first position."""
        return sum(own.first for own in self.by_observer.values())

    @property
    def second(self) -> int:
        """How many of these were answered with the second position."""
        return sum(own.second for own in self.by_observer.values())

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        missed = {observer: list(counts) for observer, counts in self.missed.items()}
        return {"obvious": self.obvious, "missed": missed, "identical": _identical(self)}


def catch_answers(sessions: Sequence[SessionLog]) -> CatchAnswers:
    """Count the catch trials of one observer's ``sessions``: the last attempt at each trial, without practice."""
    trials = [trial for session in sessions for trial in session.trials if trial.kind in KINDS]
    obvious = [trial for trial in trials if trial.data.get("catch") == "obvious"]
    same = [str(trial.data.get("answer")) for trial in trials if trial.data.get("catch") == "identical"]
    right = sum(trial.data.get("correct") is True for trial in obvious)
    return CatchAnswers(len(obvious), right, len(same), same.count("first"), same.count("second"))


def catch_results(sessions: Sequence[SessionLog]) -> CatchResults:
    """Count the catch trials of each observer of ``sessions``, as `catch_answers` does."""
    return CatchResults({name: catch_answers(own) for name, own in sessions_by_observer(sessions).items()})


def _identical(counts: CatchAnswers | CatchResults) -> dict[str, int]:
    return {"trials": counts.identical, "first": counts.first, "second": counts.second}
