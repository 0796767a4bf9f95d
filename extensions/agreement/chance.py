"""How likely so much agreement is of a measure that has nothing to do with the stimuli: permutation tests.

A measure that is noise gives its values to the stimuli in any order with the same probability [Fisher1935]. The p value
is the share of all orders, within each group of stimuli, that agree at least as well as the one that was measured: the
test keeps its level for any number of stimuli and any errors of the observers. With three stimuli p is at least 1/6.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import permutations
from math import factorial, prod

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats

Orders = NDArray[np.intp]
# The agreement of a group, shape (B,), of its stimuli's values in each of B orders, shape (B, n).
Statistic = Callable[[Orders], Floats]
MOST_EXACT = 50_000
DRAWN, FEWER, LARGE = 9_999, 999, 60  # the second where a group has more stimuli than the third
SEED = 1935
TIED = 1e-9


def chance_of_agreement(sizes: Sequence[int], statistics: Sequence[Statistic]) -> float:
    """Return the one-sided p value of the sum of the groups' agreements.

    All orders are counted where there are at most 50,000, otherwise 9,999 (999 above 60 stimuli) are drawn with a fixed
    seed and the measured one counts as one more [Phipson2010].

    Parameters
    ----------
    sizes
        How many stimuli each group has.
    statistics
        For each group, the agreement of values given to the stimuli in other orders.

    Returns
    -------
    float
        Between 0 and 1, never 0.

    Examples
    --------
    >>> scores, values = np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.0, 2.0, 3.0, 5.0])
    >>> p = chance_of_agreement([4], [lambda orders: values[orders] @ scores])
    >>> round(p * 24, 6)
    1.0
    """
    measured = sum(
        float(statistic(np.arange(size)[None])[0]) for size, statistic in zip(sizes, statistics, strict=True)
    )
    exact = prod(factorial(size) for size in sizes) <= MOST_EXACT
    if exact:
        every = np.zeros(1)
        for size, statistic in zip(sizes, statistics, strict=True):
            own = statistic(np.array(list(permutations(range(size))), dtype=np.intp))
            every = (every[:, None] + own).ravel()
        return float((every >= measured - TIED).mean())
    random = np.random.default_rng(SEED)
    as_high = 0
    draws = _draws(sizes)
    for count in _blocks(draws, max(sizes)):
        drawn = np.zeros(count)
        for size, statistic in zip(sizes, statistics, strict=True):
            drawn += statistic(random.permuted(np.tile(np.arange(size), (count, 1)), axis=1))
        as_high += int((drawn >= measured - TIED).sum())
    return (as_high + 1) / (draws + 1)


def least_p(sizes: Sequence[int]) -> float:
    """Return the least p value that so many stimuli in each group can give."""
    orders = prod(factorial(min(size, 20)) for size in sizes)
    return 1 / (orders if orders <= MOST_EXACT else _draws(sizes) + 1)


def _draws(sizes: Sequence[int]) -> int:
    return DRAWN if max(sizes) <= LARGE else FEWER


def _blocks(count: int, size: int) -> Iterator[int]:
    step = max(1, 4_000_000 // size**2)
    while count > 0:
        yield min(step, count)
        count -= step
