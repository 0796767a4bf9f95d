"""Which place each observer chose: a leaning towards the first position or away from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.comparisons.comparisons import Comparisons


@dataclass(frozen=True, slots=True)
class SideBias:
    """How often an observer chose the position shown first.

    ``first`` of ``answers`` went there, a share of ``first / answers`` with Wilson's 95 % limits ``low`` and ``high``
    [Wilson1927]; ``p`` is the exact two-sided chance of a share as unlikely, if neither place is preferred.
    """

    first: int
    answers: int
    low: float
    high: float
    p: float

    @property
    def share(self) -> float:
        """Share of answers that went to the first position, 0 to 1."""
        return self.first / self.answers

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        limits = [self.low, self.high]
        return {"first": self.first, "answers": self.answers, "share": self.share, "interval": limits, "p": self.p}


def side_biases(comparisons: Comparisons) -> tuple[SideBias | None, ...]:
    """Return each observer's side bias, in the order of ``comparisons.observers``; None where no place was noted.

    A line that counts several times is taken for so many answers, rounded. Where each item stands first as often as
    second, preferences cancel out and the share varies less than the binomial law says: p errs towards caution.
    """
    known = comparisons.winner_was_first >= 0
    observer, count = comparisons.observer[known], comparisons.count[known]
    people = len(comparisons.observers)
    answers = np.bincount(observer, count, people)
    first = np.bincount(observer, count * comparisons.winner_was_first[known], people)
    return tuple(_bias(*line) for line in zip(first.tolist(), answers.tolist(), strict=True))


def _bias(first: float, answers: float) -> SideBias | None:
    from scipy.stats import binomtest

    total = round(answers)
    if not total:
        return None
    chosen = min(total, round(first))
    test = binomtest(chosen, total)
    limits = test.proportion_ci(method="wilson")
    return SideBias(chosen, total, float(limits.low), float(limits.high), float(test.pvalue))
