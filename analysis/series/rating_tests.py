"""Do ratings differ between conditions that the same observers rated?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.classes.multiplicity import holm
from analysis.series.concordance import kendall_w, kendall_w_p
from analysis.series.observer_means import Estimate, means
from analysis.series.sign_flips import mean_difference_p

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PairTest:
    """Two conditions.

    Attributes
    ----------
    one, other
        The conditions.
    difference
        Mean of one less other over the observers, with its interval.
    effect
        Cohen's d_z: that mean over the standard deviation of the observers' differences; None where they do not vary.
    higher, lower
        How many observers rated ``one`` higher, and lower, than ``other``.
    p, p_holm
        Two-sided, by flipping observers' signs; adjusted for all pairs [Holm1979].
    p_nemenyi
        By the distance of mean ranks [Nemenyi1963], for all pairs at once.
    """

    one: str
    other: str
    difference: Estimate
    effect: float | None
    higher: int
    lower: int
    p: float
    p_holm: float
    p_nemenyi: float

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "one": self.one,
            "other": self.other,
            "difference": self.difference.to_json(),
            "effect": self.effect,
            "higher": self.higher,
            "lower": self.lower,
            "p": self.p,
            "p_holm": self.p_holm,
            "p_nemenyi": self.p_nemenyi,
        }


@dataclass(frozen=True, slots=True)
class RatingTest:
    """Friedman's test of all conditions, and each pair of them.

    ``statistic`` is Friedman's χ², corrected for ties, with ``df`` degrees of freedom; ``w`` is Kendall's W of the same
    ranks, the effect size. None where every observer rates all conditions alike.
    """

    scale: str
    conditions: tuple[str, ...]
    observers: int
    statistic: float | None
    df: int
    p: float | None
    w: float | None
    pairs: tuple[PairTest, ...]

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "scale": self.scale,
            "conditions": list(self.conditions),
            "observers": self.observers,
            "statistic": self.statistic,
            "df": self.df,
            "p": self.p,
            "w": self.w,
            "pairs": [pair.to_json() for pair in self.pairs],
        }


def rating_test(scale: str, conditions: Sequence[str], ratings: Floats) -> RatingTest | None:
    """Test ``ratings``, shape (observers, conditions), each an observer's mean; None with fewer than two of either.

    Friedman's test [Friedman1937] takes ranks within each observer. The pairs are tested twice: by Nemenyi's distances
    of mean ranks, and by the means themselves, whose permutation test assumes no law and no equal variances.
    """
    observers, k = ratings.shape
    if observers < 2 or k < 2:
        return None
    w = kendall_w(ratings)
    nemenyi = nemenyi_p(ratings)
    pairs = list(combinations(range(k), 2))
    differences = np.stack([ratings[:, one] - ratings[:, other] for one, other in pairs], axis=1)
    estimates = means(differences, np.ones(differences.shape))
    p = np.array([mean_difference_p(difference) for difference in differences.T])
    adjusted = holm(p)
    tests = []
    for number, ((one, other), difference) in enumerate(zip(pairs, differences.T, strict=True)):
        spread = float(difference.std(ddof=1))
        tests.append(
            PairTest(
                conditions[one],
                conditions[other],
                estimates[number],
                float(difference.mean()) / spread if spread > 1e-12 * float(np.abs(difference).max()) else None,
                int((difference > 0).sum()),
                int((difference < 0).sum()),
                float(p[number]),
                float(adjusted[number]),
                float(nemenyi[one, other]),
            )
        )
    return RatingTest(
        scale,
        tuple(conditions),
        observers,
        None if w is None else observers * (k - 1) * w,
        k - 1,
        kendall_w_p(w, observers, k),
        w,
        tuple(tests),
    )


def nemenyi_p(ratings: Floats) -> Floats:
    """Return Nemenyi's p value of each pair of conditions [Nemenyi1963], shape (conditions, conditions).

    √2 times the distance of mean ranks, over √(k (k + 1) / (6 S)), by the law of the studentised range of k; without a
    correction for ties, which makes it cautious where there are many.
    """
    from scipy.stats import rankdata, studentized_range

    observers, k = ratings.shape
    ranks = rankdata(ratings, axis=1).mean(axis=0)
    q = np.abs(ranks[:, None] - ranks) * np.sqrt(2) / np.sqrt(k * (k + 1) / (6 * observers))
    p = np.ones((k, k))
    for one, other in combinations(range(k), 2):
        p[one, other] = p[other, one] = float(studentized_range.sf(q[one, other], k, np.inf))
    return p
