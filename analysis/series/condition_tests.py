"""Do choices differ between series, and do neighbouring pictures share them equally?

All tests keep each observer's choices together: an observer who chose from five paints is one piece of evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.classes.multiplicity import holm
from analysis.series.agreement import kendall_w, kendall_w_p
from analysis.series.choices import Choices
from analysis.series.observer_means import Estimate, means
from analysis.series.paired_tests import (
    cochran,
    mean_difference_p,
    nemenyi_p,
    p_by_flips,
    quadratic_form,
    stuart_maxwell,
)

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class KindsTest:
    """Whether choices from series of two kinds fall on the same levels.

    ``statistic`` is Stuart and Maxwell's [Stuart1955] with observers in the place of answers; ``p`` is by exchanging
    the two kinds within observers, ``p_holm`` adjusted for all pairs of kinds. ``shift`` is the mean place (from 0) of
    the choices from ``one`` less that from ``other``.
    """

    one: str
    other: str
    observers: int
    statistic: float
    df: int
    p: float
    p_holm: float
    shift: float

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "one": self.one,
            "other": self.other,
            "observers": self.observers,
            "statistic": self.statistic,
            "df": self.df,
            "p": self.p,
            "p_holm": self.p_holm,
            "shift": self.shift,
        }


@dataclass(frozen=True, slots=True)
class LevelTest:
    """Whether one level is chosen equally often from all kinds of series: Cochran's Q [Cochran1950].

    ``shares`` are by kind. ``p`` is by exchanging kinds within observers, ``p_holm`` adjusted for all levels; None
    where nobody chose that level, or everybody.
    """

    level: float
    shares: tuple[float, ...]
    statistic: float | None
    p: float | None
    p_holm: float | None

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "level": self.level,
            "shares": list(self.shares),
            "statistic": self.statistic,
            "p": self.p,
            "p_holm": self.p_holm,
        }


@dataclass(frozen=True, slots=True)
class NeighboursTest:
    """Whether two neighbouring levels of one kind of series are chosen equally often.

    ``one`` and ``other`` are the levels, ``chosen`` how often each was chosen. ``p`` is by exchanging the two within
    observers, ``p_holm`` adjusted for all neighbours of the kind.
    """

    kind: str
    one: float
    other: float
    chosen: tuple[int, int]
    p: float
    p_holm: float

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "kind": self.kind,
            "one": self.one,
            "other": self.other,
            "chosen": list(self.chosen),
            "p": self.p,
            "p_holm": self.p_holm,
        }


def choice_counts(choices: Choices) -> Floats:
    """Return how often each observer chose each level from each kind, shape (observers, kinds, levels).

    Paints count only as far as they are there for all kinds and were gone through by that observer for each, so that
    kinds are compared on the same paints; repeats are averaged.
    """
    plan = choices.design
    levels = {level: number for number, level in enumerate(plan.levels())}
    kinds = {kind: number for number, kind in enumerate(plan.kinds)}
    paints = {paint: number for number, paint in enumerate(plan.paints)}
    counts = np.zeros((len(choices.observers), len(paints), len(kinds), len(levels)))
    for one in choices.choices:
        series = plan.series[one.series]
        cell = one.observer, paints[series.paint], kinds[series.kind], levels[series.levels[one.index]]
        counts[cell] += 1
    answers = counts.sum(axis=3, keepdims=True)
    counts = np.divide(counts, answers, out=np.zeros_like(counts), where=answers > 0)
    whole = (answers > 0).all(axis=2, keepdims=True)
    return np.asarray((counts * whole).sum(axis=1))


def kinds_tests(choices: Choices) -> tuple[KindsTest, ...]:
    """Compare each two kinds of series by the levels chosen; nothing where their levels are not the same."""
    plan = choices.design
    counts = choice_counts(choices)
    counts = counts[counts.sum(axis=(1, 2)) > 0]
    if len({plan.levels(kind) for kind in plan.kinds}) != 1 or len(counts) < 2:
        return ()
    found = []
    places = np.arange(counts.shape[2])
    for one, other in combinations(range(len(plan.kinds)), 2):
        differences = counts[:, one] - counts[:, other]
        statistic, df = stuart_maxwell(differences)
        p = p_by_flips(differences, quadratic_form(differences))
        shift = float((differences.sum(axis=0) * places).sum() / counts[:, one].sum())
        found.append((plan.kinds[one], plan.kinds[other], len(counts), statistic, df, p, shift))
    adjusted = holm(np.array([one[5] for one in found])) if found else np.zeros(0)
    return tuple(KindsTest(*one[:6], float(q), one[6]) for one, q in zip(found, adjusted, strict=True))


def level_tests(choices: Choices) -> tuple[LevelTest, ...]:
    """Compare all kinds of series by how often each level is chosen."""
    plan = choices.design
    counts = choice_counts(choices)
    counts = counts[counts.sum(axis=(1, 2)) > 0]
    if len(plan.kinds) < 2 or len({plan.levels(kind) for kind in plan.kinds}) != 1 or len(counts) < 2:
        return ()
    found = []
    answers = counts[:, 0].sum()
    for number, level in enumerate(plan.levels()):
        rows = counts[:, :, number]
        statistic, p = cochran(rows)
        found.append((level, tuple((rows.sum(axis=0) / answers).tolist()), statistic, p))
    told = [number for number, one in enumerate(found) if one[3] is not None]
    adjusted = dict(zip(told, holm(np.array([found[number][3] for number in told], np.float64)), strict=True))
    return tuple(
        LevelTest(*one, float(adjusted[number]) if number in adjusted else None) for number, one in enumerate(found)
    )


def neighbours_tests(choices: Choices) -> tuple[NeighboursTest, ...]:
    """Compare each level with the next, within each kind of series.

    That two are chosen equally often does not show that they look the same: they may lie to either side of the best.
    That one is chosen more often shows that observers tell them apart.
    """
    plan = choices.design
    found: list[NeighboursTest] = []
    for kind in plan.kinds:
        levels = plan.levels(kind)
        counts = np.zeros((len(choices.observers), len(levels)))
        for one in choices.choices:
            series = plan.series[one.series]
            if series.kind == kind:
                counts[one.observer, levels.index(series.levels[one.index])] += 1
        tests = []
        for low, _ in pairwise(range(len(levels))):
            difference = counts[:, low + 1] - counts[:, low]
            tests.append(p_by_flips(difference[:, None], lambda sums: np.abs(sums[:, 0])))
        total = counts.sum(axis=0).astype(int).tolist()
        for low, (p, q) in enumerate(zip(tests, holm(np.array(tests)), strict=True)):
            chosen = total[low], total[low + 1]
            found.append(NeighboursTest(kind, levels[low], levels[low + 1], chosen, p, float(q)))
    return tuple(found)


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
