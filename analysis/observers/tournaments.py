"""How many circular triads come of tossing a coin for each pair, exactly: all tournaments counted by their scores.

Of n items that were all compared, the number of circular triads depends on the scores alone, on how often each won:
T = C(n, 3) − Σ C(aᵢ, 2) [Kendall1940]. So tournaments need not be listed: items are taken out one by one, and what is
kept is how often the others have won so far, in whatever order, with the chances of Σ C(aᵢ, 2).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import product
from math import comb, prod

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Scores = tuple[int, ...]

EXACT_UP_TO = 10


@cache
def triad_chances(n: int) -> Floats:
    """Return the chance of each number of circular triads, shape (C(n, 3) + 1,), among n items, n at least 1."""
    most = comb(n, 3)
    states: dict[Scores, Floats] = {(0,) * n: np.eye(1, most + 1)[0]}
    for _ in range(n):
        following: dict[Scores, Floats] = {}
        for scores, chances in states.items():
            *rest, taken = scores
            for others, wins, chance in _outcomes(rest):
                pairs = comb(taken + wins, 2)
                moved = np.zeros(most + 1)
                moved[pairs:] = chances[: most + 1 - pairs] * chance
                following[others] = following[others] + moved if others in following else moved
        states = following
    chances = states[()][::-1].copy()
    chances.flags.writeable = False
    return chances


def _outcomes(scores: list[int]) -> Iterator[tuple[Scores, int, float]]:
    """Yield what meeting one more item may leave of ``scores``, how many of them it beats, and the chance of that."""
    values = sorted(set(scores))
    counts = [scores.count(value) for value in values]
    for winners in product(*(range(count + 1) for count in counts)):
        left: list[int] = []
        for value, count, won in zip(values, counts, winners, strict=True):
            left += [value] * (count - won) + [value + 1] * won
        chance = prod(comb(count, won) for count, won in zip(counts, winners, strict=True)) / 2 ** len(scores)
        yield tuple(sorted(left)), len(scores) - sum(winners), chance
