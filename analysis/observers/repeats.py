"""How often each observer says the same again of a pair that was shown more than once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.comparisons.comparisons import Comparisons


@dataclass(frozen=True, slots=True)
class SelfAgreement:
    """Of ``repeated`` pairs that an observer answered more than once, how much the answers agree.

    Every two answers to the same pair are held against each other: ``alike`` of ``twos`` are the same. Answers that
    prefer neither are the same as each other and unlike a preference. Coin tosses agree half of the time.
    """

    repeated: int
    alike: float
    twos: float

    @property
    def share(self) -> float:
        """Share of answers that are the same again, 0 to 1."""
        return self.alike / self.twos

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {"repeated_pairs": self.repeated, "alike": self.alike, "twos": self.twos, "share": self.share}


def self_agreements(comparisons: Comparisons) -> tuple[SelfAgreement | None, ...]:
    """Return each observer's agreement with themselves, as `comparisons.observers` stand; None without repeated pairs.

    Lines whose counts are weights rather than numbers of answers tell nothing about repetitions: they are passed over.
    """
    tied = comparisons.tied
    n = len(comparisons.items)
    winner, loser = np.concatenate([comparisons.winner, tied.one]), np.concatenate([comparisons.loser, tied.other])
    observer = np.concatenate([comparisons.observer, tied.observer])
    count = np.concatenate([comparisons.count, tied.count])
    is_tie = np.arange(len(winner)) >= len(comparisons.winner)
    low, high = np.minimum(winner, loser), np.maximum(winner, loser)
    outcome = np.where(is_tie, 2, winner == high)
    pairs, pair = np.unique((observer * n + low) * n + high, return_inverse=True)
    answers = np.bincount(pair * 3 + outcome, count, len(pairs) * 3).reshape(-1, 3)
    whole = (answers == np.rint(answers)).all(axis=1)
    totals = answers.sum(axis=1)
    again = whole & (totals > 1)
    people, person = len(comparisons.observers), pairs[again] // (n * n)
    repeated = np.bincount(person, minlength=people)
    alike = np.bincount(person, (answers[again] * (answers[again] - 1)).sum(axis=1) / 2, people)
    twos = np.bincount(person, totals[again] * (totals[again] - 1) / 2, people)
    lines = zip(repeated.tolist(), alike.tolist(), twos.tolist(), strict=True)
    return tuple(SelfAgreement(*line) if line[0] else None for line in lines)
