"""Tests of conditions that the same observers answered, in which each observer's answers stay together.

If two conditions do not differ, each observer might as well have given the answers to one of them to the other: the
sign of each observer's difference is free [Fisher1935]. `scipy.stats.permutation_test` gives the same exact p values;
up to 16 observers it takes 30 times as long, and beyond them it draws other signs, which would change earlier results.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
MOST_EXACT = 16
DRAWS = 100_000
SEED = 1935
_BLOCK_NUMBERS = 4_000_000
_ROUNDING = 1e-11


def p_by_flips(differences: Floats, statistic: Callable[[Floats], Floats]) -> float:
    """Return the chance of a statistic at least as large as the one seen, if signs are free.

    Up to 16 observers who differ at all, every combination of signs is gone through and the chance is exact; beyond, it
    is (1 + b) / (1 + 100,000), b of as many random ones being as large, from a fixed seed and rows in sorted order, so
    that neither the observers' order nor their names matter.

    Parameters
    ----------
    differences
        Shape (observers, k): one condition less the other.
    statistic
        Takes sums over the observers, shape (B, k), and returns B numbers, the larger the further from no difference.
    """
    rows = differences[(differences != 0).any(axis=1)]
    if not len(rows):
        return 1.0
    # A row and its negative are the same evidence: the first number that is not 0 is made positive before sorting.
    first = np.take_along_axis(rows, (rows != 0).argmax(axis=1)[:, None], axis=1)
    canonical = rows * np.sign(first)
    canonical = canonical[np.lexsort(canonical.T)]
    seen = float(statistic(rows.sum(axis=0)[None])[0])
    # Sums that are equal but for rounding count as equal, also where they cancel out to next to nothing.
    reach = seen - _ROUNDING * max(abs(seen), float(statistic(np.abs(rows).sum(axis=0)[None])[0]))
    as_large = total = 0
    for signs in _signs(len(rows)):
        as_large += int((statistic(signs @ canonical) >= reach).sum())
        total += len(signs)
    return as_large / total if len(rows) <= MOST_EXACT else (as_large + 1) / (total + 1)


def _signs(observers: int) -> Iterator[Floats]:
    """Yield blocks of rows of −1 and 1: all there are, or random ones."""
    if observers <= MOST_EXACT:
        numbers = np.arange(2**observers)
        yield np.where((numbers[:, None] >> np.arange(observers)) & 1, 1.0, -1.0)
        return
    random = np.random.default_rng(SEED)
    block = max(1, _BLOCK_NUMBERS // observers)
    for start in range(0, DRAWS, block):
        shape = min(block, DRAWS - start), observers
        bits = np.unpackbits(np.frombuffer(random.bytes(-(-shape[0] * shape[1] // 8)), np.uint8))
        yield bits[: shape[0] * shape[1]].reshape(shape).astype(np.float64) * 2 - 1


def mean_difference_p(differences: Floats) -> float:
    """Return the two-sided p value of the mean of ``differences``, shape (observers,), being 0."""
    return p_by_flips(np.asarray(differences, np.float64)[:, None], lambda sums: np.abs(sums[:, 0]))


def quadratic_form(differences: Floats) -> Callable[[Floats], Floats]:
    """Return Stuart and Maxwell's statistic of sums; no sign changes the variance."""
    inverse = np.linalg.pinv(differences.T @ differences, rcond=1e-10, hermitian=True)
    return lambda sums: np.asarray(((sums @ inverse) * sums).sum(axis=1))


def stuart_maxwell(differences: Floats) -> tuple[float, int]:
    """Return Stuart and Maxwell's statistic and its degrees of freedom.

    Parameters
    ----------
    differences
        Shape (observers, k): how often each observer chose each of k categories under one condition, less under the
        other. With one choice each it is the classical test of marginal homogeneity; with several, the variance is the
        one among observers.
    """
    sums = differences.sum(axis=0)
    variance = differences.T @ differences
    return float(quadratic_form(differences)(sums[None])[0]), int(
        np.linalg.matrix_rank(variance, tol=1e-10 * max(1.0, variance.max()))
    )


def cochran(rows: Floats) -> tuple[float | None, float | None]:
    """Return Cochran's Q and its p value by exchanging conditions within observers.

    Parameters
    ----------
    rows
        Shape (observers, k): how often each observer said yes under each of k conditions; 0 or 1 in the classical test.

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
    random = np.random.default_rng(1950)
    varying = np.sort(varying, axis=1)
    varying = varying[np.lexsort(varying.T)]
    draws = 20_000
    sums = np.zeros((draws, k))
    for row in varying:
        sums += random.permuted(np.broadcast_to(row, (draws, k)), axis=1)
    drawn = (k - 1) * (sums**2).sum(axis=1) / within
    return statistic, float((1 + (drawn >= statistic - 1e-9 * max(1.0, statistic)).sum()) / (1 + draws))


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
