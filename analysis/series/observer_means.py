"""Means and shares with intervals that know that one observer's answers hang together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.bootstrap import tails

Floats = NDArray[np.float64]
REPLICATES = 4000
SEED = 41414
_BLOCK_NUMBERS = 4_000_000


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value with the ends of its interval (None where there is none) and what it rests on."""

    value: float | None
    low: float | None
    high: float | None
    answers: int
    observers: int

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "value": self.value,
            "low": self.low,
            "high": self.high,
            "answers": self.answers,
            "observers": self.observers,
        }


def means(total: Floats, count: Floats, *, level: float = 0.95, replicates: int = REPLICATES) -> list[Estimate]:
    """Return Σ total / Σ count over the observers, with an interval from observers drawn anew.

    The interval is the bootstrap's percentile interval at levels widened for few observers [Hesterberg2015]. Observers
    are drawn with a fixed seed from the rows in sorted order: neither their order nor their names change a digit.

    Parameters
    ----------
    total, count
        Shape (observers, k): the sum of each observer's answers to each of k questions, and how many there are.
    level
        The chance to hold the truth.

    Returns
    -------
    k estimates. No value without an answer; no interval with answers of fewer than two observers, or where a draw of
    observers without any answer is not rare (fewer than three quarters of the draws have a value).
    """
    total, count = np.asarray(total, np.float64), np.asarray(count, np.float64)
    order = np.lexsort(np.hstack([count, total]).T)
    total, count = total[order], count[order]
    observers, columns = total.shape
    draws = np.empty((replicates, columns))
    random = np.random.default_rng(SEED)
    block = max(1, _BLOCK_NUMBERS // observers)
    for start in range(0, replicates, block):
        size = min(block, replicates - start)
        weights = random.multinomial(observers, np.full(observers, 1 / observers), size).astype(np.float64)
        sums, counts = weights @ total, weights @ count
        draws[start : start + size] = np.divide(sums, counts, out=np.full_like(sums, np.nan), where=counts > 0)
    found: list[Estimate] = []
    for column in range(columns):
        people = int((count[:, column] > 0).sum())
        answers = float(count[:, column].sum())
        value = float(total[:, column].sum() / answers) if answers > 0 else None
        sound = np.sort(draws[np.isfinite(draws[:, column]), column])[:, None]
        low = high = None
        if value is not None and people > 1 and len(sound) >= 0.75 * replicates:
            tail = np.array([tails.widened((1 - level) / 2, people)])
            low, high = float(tails.lower(sound, tail, 0)[0]), float(tails.upper(sound, 1 - tail, 0)[0])
        found.append(Estimate(value, low, high, round(answers), people))
    return found


def shares(chosen: Floats, count: Floats, *, level: float = 0.95) -> list[Estimate]:
    """Return Σ chosen / Σ count over the observers, with Wilson's interval [Wilson1927].

    Where observers answered several times, the answers count for as many as they are worth: their number over the
    design effect, the share's variance among observers over that of independent answers [Kish1965], which is taken for
    1 at least. Where it cannot be seen, because all answers or none are alike, only observers count.

    Parameters
    ----------
    chosen, count
        Shape (observers, k): how often each observer chose each of k, and of how many times.

    Returns
    -------
    k estimates; no value without an answer.
    """
    from scipy.special import ndtri

    z2 = float(ndtri((1 + level) / 2)) ** 2
    found: list[Estimate] = []
    for column, counts in zip(np.asarray(chosen, np.float64).T, np.asarray(count, np.float64).T, strict=True):
        order = np.lexsort([column, counts])
        one, of = column[order], counts[order]
        answers, people = float(of.sum()), int((of > 0).sum())
        if answers <= 0:
            found.append(Estimate(None, None, None, 0, 0))
            continue
        share = float(one.sum()) / answers
        worth = _worth(one, of, share)
        middle = (share + z2 / (2 * worth)) / (1 + z2 / worth)
        half = np.sqrt(z2 * (share * (1 - share) / worth + z2 / (4 * worth**2))) / (1 + z2 / worth)
        low, high = max(0.0, float(middle - half)), min(1.0, float(middle + half))
        found.append(Estimate(share, low, high, round(answers), people))
    return found


def _worth(chosen: Floats, count: Floats, share: float) -> float:
    """Return how many independent answers the observers' answers are worth."""
    answers, people = count.sum(), (count > 0).sum()
    if count.max() <= 1:
        return float(answers)
    if share <= 0 or share >= 1 or people < 2:
        return float(people)
    among = ((chosen - share * count) ** 2).sum() * people / (people - 1)
    return float(answers / max(1.0, among / (answers * share * (1 - share))))
