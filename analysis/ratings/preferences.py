"""Stereo or flat: how often each observer chose which version of a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from analysis.kinds.preference import PreferenceRecord
from analysis.records.answered_by import WhoAnswered, who_answered
from analysis.records.session_record import SessionLog

VIEWS = ("stereo", "flat")


@dataclass(frozen=True, slots=True)
class Preferences:
    """The trials of the kind ``preference``: by observer, how often stereo and how often flat was chosen.

    ``who`` says who answered in the sessions. The answers of an observer are correlated: the independent units are the
    observers.
    """

    by_observer: dict[str, tuple[int, int]]
    who: WhoAnswered

    @property
    def stereo(self) -> int:
        """How often the stereo version was chosen."""
        return sum(stereo for stereo, _ in self.by_observer.values())

    @property
    def flat(self) -> int:
        """How often the flat version was chosen."""
        return sum(flat for _, flat in self.by_observer.values())

    @property
    def observers_for_stereo(self) -> int:
        """How many observers chose stereo more often than flat."""
        return sum(stereo > flat for stereo, flat in self.by_observer.values())

    @property
    def observers_for_flat(self) -> int:
        """How many observers chose flat more often than stereo."""
        return sum(flat > stereo for stereo, flat in self.by_observer.values())

    @property
    def sentence(self) -> str:
        """The counts in words."""
        total, people = self.stereo + self.flat, self.who.words(self.by_observer)
        return (
            f"Of {total} preferences between stereo and flat, {self.stereo} are for stereo; of {people}, "
            f"{self.observers_for_stereo} chose stereo more often and {self.observers_for_flat} flat."
        )

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        people = {name: dict(zip(VIEWS, counts, strict=True)) for name, counts in self.by_observer.items()}
        return {"stereo": self.stereo, "flat": self.flat, "observers": people}


def preferences(sessions: Sequence[SessionLog]) -> Preferences:
    """Count the preferences of ``sessions``, each trial's last attempt."""
    chosen: dict[str, list[str]] = {}
    for session in sessions:
        for trial in session.of(PreferenceRecord):
            chosen.setdefault(session.header.observer, []).append(trial.chosen_view)
    counts = {name: (views.count("stereo"), views.count("flat")) for name, views in chosen.items()}
    return Preferences(counts, who_answered(sessions))
