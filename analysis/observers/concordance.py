"""How well observers agree with each other: Kendall's coefficient u [Kendall1940], and two tests of it.

Two observers agree on a pair if their verdicts are the same. u is the share of agreements among all cases of two
observers who answered the same pair, minus the share of disagreements: 1 if all agree, about 0 by chance, never much
below. A tie counts 0. Without ties and gaps this is Kendall's u.

Two tests have different null hypotheses. The first is random answers: every verdict is a coin toss. Observers with
preferences of their own do not toss coins: their verdicts, and so their agreements, are correlated. The second is
unrelated preferences: each observer keeps their own judgement with its consistency, but the items' names are permuted
independently for each observer. Where pairs were compared within groups, such as scenes, the pairs of all groups count,
and names are permuted within a group.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.comparisons import Comparisons, split_scales
from analysis.observers.consistency import Verdicts, verdicts
from analysis.observers.tails import Tail, from_chances, from_moments
from documents.arrays import Floats
from documents.text import JsonResult

SHUFFLES = 9999
MOST_STEPS = 50_000_000
SEED = 1940
_MOST_NUMBERS = 300_000_000
_FEWEST_SHUFFLES = 999
_BLOCK = 1_000_000


@dataclass(frozen=True, slots=True)
class ChiSquare:
    """Kendall's χ² of agreement, 1 off for continuity, its degrees of freedom (in general no whole number), and p."""

    statistic: float
    df: float
    p: float


@dataclass(frozen=True, slots=True)
class Concordance(JsonResult):
    """Agreement between observers.

    Attributes
    ----------
    u
        Kendall's coefficient, or its extension to ties and gaps.
    least
        The smallest possible u with this number of observers and ties.
    observers
        How many observers share at least one pair with another.
    agreements, disagreements, shared
        How often two observers had the same verdict, opposite ones, or both answered the same pair.
    chance
        Probability of at least this agreement if each verdict is a coin toss; None where there are only ties.
    chi_square
        Kendall's approximation of the same; None with ties or gaps, or for 2 observers.
    strangers_p
        Probability of at least this agreement between observers with unrelated preferences, by permuted names of the
        items; None unless every observer compared every two items.
    shuffles
        How many permutations that is from; 0 without it.
    """

    u: float
    least: float
    observers: int
    agreements: int
    disagreements: int
    shared: int
    chance: Tail | None
    chi_square: ChiSquare | None
    strangers_p: float | None
    shuffles: int = 0
    json_keys: ClassVar = {"least": "least_u", "chance": "test", "shuffles": None}


def kendall_u(comparisons: Comparisons, shuffles: int = SHUFFLES) -> Concordance | None:
    """Return the agreement between observers, over the pairs of all groups; None if no two answered the same pair.

    ``shuffles`` is the number of permutations for the test against unrelated preferences, from a fixed seed; 0 leaves
    the test out. With many items or observers there are fewer, at least 999.
    """
    parts = [part for _, part in split_scales(comparisons)]
    above = [np.triu_indices(len(part.items), 1) for part in parts]
    answered, decided, balance = ([np.zeros((len(part.items),) * 2, np.int64) for part in parts] for _ in range(3))
    pairs_each = np.zeros(len(comparisons.observers), dtype=np.int64)
    for number, part in enumerate(parts):
        for person, (items, verdict, compared) in enumerate(verdicts(part)):
            place = np.ix_(items, items)
            answered[number][place] += compared
            decided[number][place] += verdict != 0
            balance[number][place] += verdict
            pairs_each[person] += int(compared.sum()) // 2
    answered_pairs, k, lead = (
        np.concatenate([counts[pairs] for counts, pairs in zip(matrices, above, strict=True)])
        for matrices in (answered, decided, balance)
    )
    shared = int((answered_pairs * (answered_pairs - 1)).sum()) // 2
    if not shared:
        return None
    split = (k**2 - lead**2) // 4
    disagreements, decided_twice = int(split.sum()), int((k * (k - 1)).sum()) // 2
    made = _shuffles(parts, shuffles) if (pairs_each == len(k)).all() else 0
    return Concordance(
        u=(decided_twice - 2 * disagreements) / shared,
        least=(decided_twice - 2 * int((k**2 // 4).sum())) / shared,
        observers=_sharing(parts, answered),
        agreements=decided_twice - disagreements,
        disagreements=disagreements,
        shared=shared,
        chance=_chance(k[k > 1], disagreements) if (k > 1).any() else None,
        chi_square=_chi_square(int(k[0]), len(k), decided_twice - disagreements)
        if (k == len(pairs_each)).all()
        else None,
        strangers_p=_strangers_p(parts, balance, made) if made else None,
        shuffles=made,
    )


def _sharing(parts: Sequence[Comparisons], answered: Sequence[NDArray[np.int64]]) -> int:
    share = [
        [bool((counts[np.ix_(items, items)][compared] > 1).any()) for items, _, compared in verdicts(part)]
        for part, counts in zip(parts, answered, strict=True)
    ]
    return int(np.any(share, axis=0).sum())


def _chance(k: NDArray[np.int64], disagreements: int) -> Tail:
    """Return the probability of at most this many disagreements if ``k`` observers toss a coin for each pair."""
    support = int((k**2 // 4).sum())
    if support * int((k // 2 + 1).sum()) <= MOST_STEPS:
        return from_chances(disagreement_chances(k), disagreements)
    together = k * (k - 1)
    mean, variance, third = together.sum() / 4, together.sum() / 8, -(together * (k - 2)).sum() / 8
    half_step = 1.0 if (k % 2).all() else 0.5
    return from_moments(float(disagreements), half_step, float(mean), float(variance), float(third))


def disagreement_chances(k: NDArray[np.int64]) -> Floats:
    """Return the chances of 0, 1, ..., Σ⌊k²/4⌋ disagreements if, pair by pair, ``k`` observers toss a coin each."""
    chances = np.ones(1)
    for people in k.tolist():
        longer = np.zeros(len(chances) + people**2 // 4)
        for for_first in range(people + 1):
            start = for_first * (people - for_first)
            longer[start : start + len(chances)] += chances * (comb(people, for_first) / 2**people)
        chances = longer
    return chances


def _chi_square(m: int, pairs: int, agreements: int) -> ChiSquare | None:
    if m < 3:
        return None
    from scipy.special import chdtrc

    expected = pairs * comb(m, 2) / 2
    statistic = 4 / (m - 2) * (agreements - 1 - expected * (m - 3) / (m - 2))
    df = pairs * m * (m - 1) / (m - 2) ** 2
    return ChiSquare(statistic, df, float(chdtrc(df, max(statistic, 0.0))))


def _shuffles(parts: Sequence[Comparisons], most: int) -> int:
    """Return how many permutations are made of ``most`` that were asked for."""
    numbers = len(parts[0].observers) * sum(len(part.items) ** 2 for part in parts)
    return min(most, max(_FEWEST_SHUFFLES, _MOST_NUMBERS // numbers))


def _strangers_p(parts: Sequence[Comparisons], balance: Sequence[NDArray[np.int64]], shuffles: int) -> float:
    """Return the share of permutations with at least the observed agreement, the observed order among them.

    `scipy.stats.permutation_test` of pairings has the same null distribution and p value. It is not used here: its
    random numbers differ, so the p values of earlier reports would change, and it needs one index array per observer.

    Agreements minus disagreements are half of the sum of squares of ``balance``, of each part (n, n), minus a constant.
    Names are permuted within each part.
    """
    people = len(parts[0].observers)
    sizes = [len(part.items) for part in parts]
    squares = np.zeros(shuffles, dtype=np.int64)
    for number, (part, n) in enumerate(zip(parts, sizes, strict=True)):
        everyone = np.array([verdict for _, verdict, _ in verdicts(part)])
        random = np.random.default_rng([SEED, people, n, *([number] if number else [])])
        block = max(1, _BLOCK // (n * n))
        for start in range(0, shuffles, block):
            size = min(block, shuffles - start)
            summed = np.zeros((size, n, n), dtype=np.int32)
            for verdict in everyone:
                order = random.permuted(np.tile(np.arange(n), (size, 1)), axis=1)
                summed += _renamed(verdict, order)
            squares[start : start + size] += (summed.astype(np.int64) ** 2).sum(axis=(1, 2))
    observed = sum(int((matrix**2).sum()) for matrix in balance)
    return (1 + int((squares >= observed).sum())) / (shuffles + 1)


def _renamed(verdict: Verdicts, order: NDArray[np.intp]) -> Verdicts:
    """Return ``verdict[order[b][:, None], order[b]]`` of each order b. Shapes (n, n) and (B, n) to (B, n, n).

    Whole rows are copied twice, transposed in between: several times as fast as copying single numbers.
    """
    size, n = order.shape
    columns = np.take(verdict.T, order, axis=0).transpose(0, 2, 1).reshape(size * n, n)
    renamed: Verdicts = np.take(columns, order + n * np.arange(size)[:, None], axis=0)
    return renamed
