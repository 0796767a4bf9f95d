"""Means and shares with intervals that allow for the correlation between an observer's answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.bootstrap import tails
from documents.text import json_fields

Floats = NDArray[np.float64]
REPLICATES = 4000
SEED = 41414
_BLOCK_NUMBERS = 4_000_000


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value with the limits of its interval, None where there is none, and the numbers of answers and observers."""

    value: float | None
    low: float | None
    high: float | None
    answers: int
    observers: int

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return json_fields(self)


def means(total: Floats, count: Floats, *, level: float = 0.95, replicates: int = REPLICATES) -> list[Estimate]:
    """Return Σ total / Σ count over the observers, with an interval by bootstrap over observers.

    The interval is the percentile interval at levels widened for few observers [Hesterberg2015]. Observers are drawn
    from the sorted rows with a fixed seed: the result does not depend on their order or names.

    Parameters
    ----------
    total, count
        Shape (observers, k): the sum of each observer's answers to each of k questions, and how many there are.
    level
        Coverage of the interval, 0 to 1.

    Returns
    -------
    k estimates. No value without an answer; no interval with answers of fewer than two observers, or if fewer than
    three quarters of the bootstrap samples have an answer.
    """
    total, count = np.asarray(total, np.float64), np.asarray(count, np.float64)
    order = np.lexsort(np.hstack([count, total]).T)
    total, count = total[order], count[order]
    observers, columns = total.shape
    samples = np.empty((replicates, columns))
    random = np.random.default_rng(SEED)
    block = max(1, _BLOCK_NUMBERS // observers)
    for start in range(0, replicates, block):
        size = min(block, replicates - start)
        weights = random.multinomial(observers, np.full(observers, 1 / observers), size).astype(np.float64)
        sums, counts = weights @ total, weights @ count
        samples[start : start + size] = np.divide(sums, counts, out=np.full_like(sums, np.nan), where=counts > 0)
    estimates: list[Estimate] = []
    for column in range(columns):
        people = int((count[:, column] > 0).sum())
        answers = float(count[:, column].sum())
        value = float(total[:, column].sum() / answers) if answers > 0 else None
        valid = np.sort(samples[np.isfinite(samples[:, column]), column])[:, None]
        low = high = None
        if value is not None and people > 1 and len(valid) >= 0.75 * replicates:
            tail = np.array([tails.widened((1 - level) / 2, people)])
            low, high = float(tails.lower(valid, tail, 0)[0]), float(tails.upper(valid, 1 - tail, 0)[0])
        estimates.append(Estimate(value, low, high, round(answers), people))
    return estimates


def shares(chosen: Floats, count: Floats, *, level: float = 0.95) -> list[Estimate]:
    """Return Σ chosen / Σ count over the observers, with Wilson's interval [Wilson1927].

    Where observers answered several times, the interval uses the effective number of answers: their number over the
    design effect, which is the variance of the share between observers over that of independent answers [Kish1965],
    and at least 1. Where it cannot be estimated, because the share is 0 or 1, the number of observers is used.

    Parameters
    ----------
    chosen, count
        Shape (observers, k): how often each observer chose each of k, and out of how many choices.

    Returns
    -------
    k estimates; no value without an answer.
    """
    from scipy.special import ndtri

    z2 = float(ndtri((1 + level) / 2)) ** 2
    estimates: list[Estimate] = []
    for column, counts in zip(np.asarray(chosen, np.float64).T, np.asarray(count, np.float64).T, strict=True):
        order = np.lexsort([column, counts])
        times, of = column[order], counts[order]
        answers, people = float(of.sum()), int((of > 0).sum())
        if answers <= 0:
            estimates.append(Estimate(None, None, None, 0, 0))
            continue
        share = float(times.sum()) / answers
        effective = _effective_answers(times, of, share)
        middle = (share + z2 / (2 * effective)) / (1 + z2 / effective)
        half = np.sqrt(z2 * (share * (1 - share) / effective + z2 / (4 * effective**2))) / (1 + z2 / effective)
        low, high = max(0.0, float(middle - half)), min(1.0, float(middle + half))
        estimates.append(Estimate(share, low, high, round(answers), people))
    return estimates


def _effective_answers(chosen: Floats, count: Floats, share: float) -> float:
    """Return the effective number of independent answers."""
    answers, people = count.sum(), (count > 0).sum()
    if count.max() <= 1:
        return float(answers)
    if share <= 0 or share >= 1 or people < 2:
        return float(people)
    among = ((chosen - share * count) ** 2).sum() * people / (people - 1)
    return float(answers / max(1.0, among / (answers * share * (1 - share))))
