"""Tests of conditions that the same observers answered; permutations exchange conditions within whole observers.

Under the null hypothesis the sign of each observer's difference is random [Fisher1935]. `scipy.stats.permutation_test`
gives the same exact p values; up to 16 observers it takes 30 times as long, and beyond them it draws other signs, which
would change earlier results.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

import numpy as np

from analysis.classes.conclusions import Conclusion, concluded
from analysis.classes.multiplicity import holm
from analysis.series.agreement import kendall_w, kendall_w_p, ranks
from analysis.series.observer_means import Estimated, means
from documents.arrays import Floats
from documents.text import JsonResult

MOST_EXACT = 16
DRAWS = 100_000
SEED = 1935
COCHRAN_DRAWS, COCHRAN_SEED = 20_000, 1950
_BLOCK_NUMBERS = 4_000_000
_ROUNDING = 1e-11


def p_by_flips(differences: Floats, statistic: Callable[[Floats], Floats], draws: int = DRAWS) -> float:
    """Return the p value of a statistic under random signs of the observers' differences.

    Up to 16 observers with any difference, all combinations of signs are enumerated and p is exact. Beyond, it is
    (1 + b) / (1 + draws), where b of the random combinations are at least as large, from a fixed seed and rows in
    sorted order, so that neither the order of the observers nor their names matter.

    Parameters
    ----------
    differences
        Shape (observers, k): first condition minus second.
    statistic
        Takes sums over the observers, shape (B, k), and returns B numbers; larger is further from no difference.
    """
    rows = differences[(differences != 0).any(axis=1)]
    if not len(rows):
        return 1.0
    # A row and its negative are equivalent: the first number that is not 0 is made positive before sorting.
    first = np.take_along_axis(rows, (rows != 0).argmax(axis=1)[:, None], axis=1)
    canonical = rows * np.sign(first)
    canonical = canonical[np.lexsort(canonical.T)]
    seen = float(statistic(rows.sum(axis=0)[None])[0])
    # Sums that are equal up to rounding count as equal, also where they cancel to almost 0.
    reach = seen - _ROUNDING * max(abs(seen), float(statistic(np.abs(rows).sum(axis=0)[None])[0]))
    as_large = total = 0
    for signs in _signs(len(rows), draws):
        as_large += int((statistic(signs @ canonical) >= reach).sum())
        total += len(signs)
    return as_large / total if len(rows) <= MOST_EXACT else (as_large + 1) / (total + 1)


def _signs(observers: int, draws: int) -> Iterable[Floats]:
    """Return blocks of rows of −1 and 1: all combinations, or random ones; few enough are kept for the next test."""
    rows = 2**observers if observers <= MOST_EXACT else draws
    return _kept_signs(observers, draws) if rows * observers <= _BLOCK_NUMBERS else _make_signs(observers, draws)


@lru_cache(maxsize=2)
def _kept_signs(observers: int, draws: int) -> tuple[Floats, ...]:
    return tuple(_make_signs(observers, draws))


def _make_signs(observers: int, draws: int) -> Iterator[Floats]:
    if observers <= MOST_EXACT:
        numbers = np.arange(2**observers)
        yield np.where((numbers[:, None] >> np.arange(observers)) & 1, 1.0, -1.0)
        return
    random = np.random.default_rng(SEED)
    block = max(1, _BLOCK_NUMBERS // observers)
    for start in range(0, draws, block):
        shape = min(block, draws - start), observers
        bits = np.unpackbits(np.frombuffer(random.bytes(-(-shape[0] * shape[1] // 8)), np.uint8))
        yield bits[: shape[0] * shape[1]].reshape(shape).astype(np.float64) * 2 - 1


def mean_difference_p(differences: Floats, draws: int = DRAWS) -> float:
    """Return the two-sided p value of the mean of ``differences``, shape (observers,), being 0."""
    return p_by_flips(np.asarray(differences, np.float64)[:, None], lambda sums: np.abs(sums[:, 0]), draws)


def quadratic_form(differences: Floats) -> Callable[[Floats], Floats]:
    """Return Stuart and Maxwell's statistic as a function of sums; signs do not change the variance."""
    inverse = np.linalg.pinv(differences.T @ differences, rcond=1e-10, hermitian=True)
    return lambda sums: np.asarray(((sums @ inverse) * sums).sum(axis=1))


def stuart_maxwell(differences: Floats) -> tuple[float, int]:
    """Return Stuart and Maxwell's statistic and its degrees of freedom.

    Parameters
    ----------
    differences
        Shape (observers, k): how often each observer chose each of k categories under the first condition, minus under
        the second. With one choice each this is the classical test of marginal homogeneity; with several, the variance
        is that between observers.
    """
    sums = differences.sum(axis=0)
    variance = differences.T @ differences
    return float(quadratic_form(differences)(sums[None])[0]), int(
        np.linalg.matrix_rank(variance, tol=1e-10 * max(1.0, variance.max()))
    )


def cochran(rows: Floats) -> tuple[float | None, float | None]:
    """Return Cochran's Q and the p value of the permutation test that exchanges conditions within observers.

    `scipy.stats.permutation_test` has no permutation of k conditions within each observer in one call: its pairings
    need one array for each observer, and its draws differ, which would change earlier results.

    Parameters
    ----------
    rows
        Shape (observers, k): how often each observer answered yes under each of k conditions; classically 0 or 1.

    Returns
    -------
    Q = (k − 1) · S · (between conditions) / (within observers), in sums of squares; None where no observer's answers
    differ. The p value is from 20,000 draws with a fixed seed: its standard error is 0.0015 near 0.05.
    """
    k = rows.shape[1]
    centred = rows - rows.mean(axis=1, keepdims=True)
    within = float((centred**2).sum())
    if within <= 0:
        return None, None
    varying = centred[(centred != 0).any(axis=1)]
    statistic = (k - 1) * float((varying.sum(axis=0) ** 2).sum()) / within
    random = np.random.default_rng(COCHRAN_SEED)
    varying = np.sort(varying, axis=1)
    varying = varying[np.lexsort(varying.T)]
    draws = COCHRAN_DRAWS
    sums = np.zeros((draws, k))
    for row in varying:
        sums += random.permuted(np.broadcast_to(row, (draws, k)), axis=1)
    permuted = (k - 1) * (sums**2).sum(axis=1) / within
    return statistic, float((1 + (permuted >= statistic - 1e-9 * max(1.0, statistic)).sum()) / (1 + draws))


def nemenyi_p(ratings: Floats) -> Floats:
    """Return Nemenyi's p value of each pair of conditions [Nemenyi1963], shape (conditions, conditions).

    √2 times the distance of mean ranks, over √(k (k + 1) / (6 S)), by the studentised range distribution of k. There is
    no correction for ties: with many ties the test is conservative.
    """
    from scipy.stats import studentized_range

    observers, k = ratings.shape
    each = ranks(ratings).mean(axis=0)
    q = np.abs(each[:, None] - each) * np.sqrt(2) / np.sqrt(k * (k + 1) / (6 * observers))
    p = np.ones((k, k))
    for a, b in combinations(range(k), 2):
        p[a, b] = p[b, a] = float(studentized_range.sf(q[a, b], k, np.inf))
    return p


@dataclass(frozen=True, slots=True)
class PairTest(JsonResult):
    """Two conditions.

    Attributes
    ----------
    one, other
        The conditions.
    difference
        Mean of ``one`` minus ``other`` over the observers, with its interval.
    effect
        Cohen's d_z: that mean over the standard deviation of the observers' differences; None where they do not vary.
    higher, lower
        How many observers rated ``one`` higher, and lower, than ``other``.
    p, p_holm
        Two-sided, by random signs of the observers' differences; adjusted for all pairs [Holm1979].
    p_nemenyi
        By the distance of mean ranks [Nemenyi1963], adjusted for all pairs.
    """

    one: str
    other: str
    difference: Estimated
    effect: float | None
    higher: int
    lower: int
    p: float
    p_holm: float
    p_nemenyi: float


@dataclass(frozen=True, slots=True)
class RatingTest(JsonResult):
    """Friedman's test of all conditions, and each pair of them.

    ``statistic`` is Friedman's χ², corrected for ties, with ``df`` degrees of freedom; ``w`` is Kendall's W of the same
    ranks, the effect size. None where every observer rates all conditions equally.
    """

    scale: str
    conditions: tuple[str, ...]
    observers: int
    statistic: float | None
    df: int
    p: float | None
    w: float | None
    pairs: tuple[PairTest, ...]

    @property
    def conclusions(self) -> tuple[Conclusion, ...]:
        """What is concluded of each pair of conditions, in points of the scale."""
        return tuple(
            replace(
                concluded(f"{self.scale}: {pair.one} − {pair.other}", pair.p_holm, None),
                estimate=pair.difference.value,
                low=pair.difference.low,
                high=pair.difference.high,
                unit="points",
            )
            for pair in self.pairs
        )


def rating_test(scale: str, conditions: Sequence[str], ratings: Floats, draws: int = DRAWS) -> RatingTest | None:
    """Test ``ratings``, shape (observers, conditions), each an observer's mean; None with fewer than two of either.

    Friedman's test [Friedman1937] uses ranks within each observer. The pairs are tested twice: by Nemenyi's distances
    of mean ranks, and by a permutation test of the means, which assumes no distribution and no equal variances.
    """
    observers, k = ratings.shape
    if observers < 2 or k < 2:
        return None
    w = kendall_w(ratings)
    nemenyi = nemenyi_p(ratings)
    pairs = list(combinations(range(k), 2))
    differences = np.stack([ratings[:, a] - ratings[:, b] for a, b in pairs], axis=1)
    estimates = means(differences, np.ones(differences.shape))
    p = np.array([mean_difference_p(difference, draws) for difference in differences.T])
    adjusted = holm(p)
    tests = []
    for number, ((a, b), difference) in enumerate(zip(pairs, differences.T, strict=True)):
        spread = float(difference.std(ddof=1))
        tests.append(
            PairTest(
                conditions[a],
                conditions[b],
                estimates[number],
                float(difference.mean()) / spread if spread > 1e-12 * float(np.abs(difference).max()) else None,
                int((difference > 0).sum()),
                int((difference < 0).sum()),
                float(p[number]),
                float(adjusted[number]),
                float(nemenyi[a, b]),
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
