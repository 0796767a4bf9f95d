"""Permutation tests in which each observer's answers stay together.

If two conditions do not differ, each observer might as well have given the answers to one of them to the other: the
sign of each observer's difference is free [Fisher1935].
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

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
