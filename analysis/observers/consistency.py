"""How consistent each observer is: circular triads, A over B, B over C and yet C over A [Kendall1940].

Kendall's coefficient ζ = 1 − T / T_max is 1 without circular triads and 0 where there are as many as possible. It is
defined for designs in which every two items were compared. The test works for any design: it is the probability of at
most T circular triads if each verdict is a coin toss, by enumeration where that is feasible, else by the distribution
with the same mean, variance and skewness, which for complete designs is Kendall's χ² (with a conservative continuity
correction, T + ½). Ties stay ties: a triad with ties counts as the share of the ways to break them that make it
circular. Where pairs were compared within groups, such as scenes, T and T_max are sums over the groups.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from math import comb, prod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.comparisons import Comparisons, split_scales
from analysis.observers.tails import Tail, from_chances, from_moments
from documents.arrays import Flags, Floats
from documents.text import JsonResult

Verdicts = NDArray[np.int8]
Scores = tuple[int, ...]

MOST_COINS = 12  # pairs up to which every outcome is enumerated
EXACT_UP_TO = 10  # items, all compared, up to which tournaments are counted


@dataclass(frozen=True, slots=True)
class Consistency(JsonResult):
    """One observer's circular triads.

    Attributes
    ----------
    circular
        T: a whole number unless there are ties.
    triads
        How many triads of items were all compared with each other; by chance, a quarter of them is circular.
    zeta
        Kendall's ζ, at most 1; None unless every two items that the observer saw, of one group where there are groups,
        were compared, or below 3 items.
    ties
        How many pairs are tied.
    test
        The probability of at most T circular triads by coin tosses; None where no toss could change T.
    """

    circular: float
    triads: int
    zeta: float | None
    ties: int
    test: Tail | None
    json_keys: ClassVar = {"circular": "circular_triads"}


def consistencies(comparisons: Comparisons) -> tuple[Consistency, ...]:
    """Return each observer's consistency, in the order of ``comparisons.observers``, over all groups."""
    by_scale = [verdicts(part) for _, part in split_scales(comparisons)]
    return tuple(
        _consistency([(verdict, compared) for _, verdict, compared in own]) for own in zip(*by_scale, strict=True)
    )


def kendall_zeta(verdict: Verdicts, compared: Flags) -> Consistency:
    """Return the consistency of one observer's ``verdict`` on the pairs ``compared``, as `verdicts` yields both."""
    return _consistency([(verdict, compared)])


def _consistency(blocks: Sequence[tuple[Verdicts, Flags]]) -> Consistency:
    """Return the consistency over ``blocks`` of verdicts and compared pairs, such as those of each group."""
    circular, triads, ties, complete = 0.0, 0, 0, True
    most = sum(most_circular_triads(len(verdict)) for verdict, _ in blocks)
    for verdict, compared in blocks:
        linked = compared.astype(np.float64)
        triads += round(float(np.trace(linked @ linked @ linked)) / 6)
        circular += float(circular_triads(verdict[None], compared)[0])
        pairs = int(compared.sum()) // 2
        ties += pairs - int(np.count_nonzero(verdict)) // 2
        complete = complete and pairs == comb(len(verdict), 2)
    zeta = 1 - circular / most if complete and most else None
    larger = [block for block in blocks if len(block[0]) > 2]
    return Consistency(circular, triads, zeta, ties, _test(larger, circular, triads))


def circular_triads(verdict: Verdicts, compared: Flags) -> Floats:
    """Count the circular triads of each set of verdicts. Shapes (B, n, n) and (n, n) to (B,).

    trace(P³) / 3, with P 1 where the row's item is preferred, ½ where tied, and 0 otherwise.
    """
    chance = np.where(compared, (verdict + 1.0) / 2, 0.0)
    return np.asarray(np.einsum("bij,bji->b", chance @ chance, chance) / 3)


def most_circular_triads(n: int) -> int:
    """Return the most circular triads that n items, all compared, can make."""
    return (n**3 - (n if n % 2 else 4 * n)) // 24


def _test(blocks: Sequence[tuple[Verdicts, Flags]], circular: float, triads: int) -> Tail | None:
    coins = [int(np.count_nonzero(verdict)) // 2 for verdict, _ in blocks]
    variance, third = np.sum([(0.0, 0.0), *(_spread(*block) for block in blocks)], axis=0)
    if not variance:
        return None
    sizes = tuple(len(verdict) for verdict, _ in blocks)
    if max(sizes) <= EXACT_UP_TO and coins == [comb(n, 2) for n in sizes]:
        return from_chances(_joint_triad_chances(tuple(sorted(sizes))), round(circular))
    if sum(coins) <= MOST_COINS:
        verdict, compared = (_block_diagonal(parts) for parts in zip(*blocks, strict=True))
        return _enumerated(verdict, compared, circular)
    # A triad with a tie counts 0 or ½, one with more of them ¼ whatever the third verdict is.
    untied = all(np.count_nonzero(verdict) == np.count_nonzero(compared) for verdict, compared in blocks)
    return from_moments(circular, 0.5 if untied else 0.25, triads / 4, float(variance), float(third))


def _block_diagonal(blocks: Sequence[NDArray[Any]]) -> NDArray[Any]:
    whole = np.zeros((sum(map(len, blocks)),) * 2, dtype=blocks[0].dtype)
    start = 0
    for block in blocks:
        whole[start : start + len(block), start : start + len(block)] = block
        start += len(block)
    return whole


@cache
def _joint_triad_chances(sizes: tuple[int, ...]) -> Floats:
    """Return the chance of each number of circular triads in all of several groups of items, from those of each."""
    chances = np.ones(1)
    for n in sizes:
        chances = np.convolve(chances, triad_chances(n))
    return chances


def _enumerated(verdict: Verdicts, compared: Flags, circular: float) -> Tail:
    first, second = np.nonzero(np.triu(verdict))
    outcomes = np.arange(2 ** len(first))
    sign = (2 * ((outcomes[:, None] >> np.arange(len(first))) & 1) - 1).astype(np.int8)
    tossed = np.zeros((len(outcomes), *verdict.shape), dtype=np.int8)
    tossed[:, first, second] = sign
    tossed[:, second, first] = -sign
    counts = circular_triads(tossed, compared)
    margin = 1e-6  # T moves by ½ at least
    below, p = (float((counts < circular + edge).mean()) for edge in (-margin, margin))
    return Tail(below, p - below, exact=True, least_p=float((counts < counts.min() + margin).mean()))


def _spread(verdict: Verdicts, compared: Flags) -> tuple[float, float]:
    """Return variance and third central moment of T if each verdict is a coin toss.

    4 T minus its mean is a sum, over each two pairs that share an item and lie in a triad, of the product of their
    signs. Such products are uncorrelated, and three of them multiply to 1 only around a triad, or, with sign −1, at an
    item whose three partners were all compared with each other.
    """
    coins = (verdict != 0).astype(np.float64)
    linked = compared.astype(np.float64)
    products = np.trace(coins @ linked @ coins) / 2
    around = np.trace(coins @ coins @ coins) / 6
    return float(products / 16), float((around - _stars(coins > 0, linked)) * 6 / 64)


def _stars(coins: Flags, linked: Floats) -> float:
    """Count items and three of their ``coins`` whose three partners are ``linked`` to each other."""
    if linked.sum() == len(linked) * (len(linked) - 1):
        return float(sum(comb(degree, 3) for degree in coins.sum(axis=1).tolist()))
    parts = [linked[np.ix_(row, row)] for row in coins]
    return float(sum(np.trace(part @ part @ part) for part in parts)) / 6


def verdicts(comparisons: Comparisons) -> Iterator[tuple[NDArray[np.intp], Verdicts, Flags]]:
    """Yield for each observer the items they saw, their verdicts, and which pairs they compared.

    The verdict on a pair that was shown several times is the majority's. An even split is a tie, and so is a pair whose
    answers are all ties; beside other answers, a tie counts half for each item and changes nothing.

    Yields
    ------
    items
        Shape (k,): indices of the items that the observer saw, ascending.
    verdict
        Shape (k, k), antisymmetric: 1 where the row's item is preferred over the column's, −1 the other way, 0 for a
        tie or no answer.
    compared
        Shape (k, k), symmetric: whether the observer answered the pair at all.
    """
    tied = comparisons.tied
    everyone = np.arange(len(comparisons.observers) + 1)
    order, tied_order = (np.argsort(who, kind="stable") for who in (comparisons.observer, tied.observer))
    starts, tied_starts = (
        np.searchsorted(who[rows], everyone)
        for who, rows in ((comparisons.observer, order), (tied.observer, tied_order))
    )
    for person in range(len(comparisons.observers)):
        own = order[starts[person] : starts[person + 1]]
        own_tied = tied_order[tied_starts[person] : tied_starts[person + 1]]
        winner, loser, count = comparisons.winner[own], comparisons.loser[own], comparisons.count[own]
        low, high = tied.item_a[own_tied], tied.item_b[own_tied]
        items, places = np.unique(np.concatenate([winner, loser, low, high]), return_inverse=True)
        size = len(items)
        row, column, tied_row, tied_column = np.split(places, np.cumsum([len(winner), len(loser), len(low)]))
        wins = np.bincount(row * size + column, count, size * size).reshape(size, size)
        compared = wins > 0
        compared[tied_row, tied_column] = True
        yield items, np.sign(wins - wins.T).astype(np.int8), compared | compared.T


@cache
def triad_chances(n: int) -> Floats:
    """Return the chance of each number of circular triads, shape (C(n, 3) + 1,), among n items, n at least 1.

    The number of circular triads depends on the scores alone, on how often each item won: T = C(n, 3) − Σ C(aᵢ, 2)
    [Kendall1940]. Tournaments need not be listed: items are removed one by one, and the state is how often each
    remaining item has won so far, sorted, with the probabilities of Σ C(aᵢ, 2).
    """
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
    """Yield the possible scores after another item is compared, how often that item wins, and the probability."""
    values = sorted(set(scores))
    counts = [scores.count(value) for value in values]
    for winners in product(*(range(count + 1) for count in counts)):
        left: list[int] = []
        for value, count, won in zip(values, counts, winners, strict=True):
            left += [value] * (count - won) + [value + 1] * won
        chance = prod(comb(count, won) for count, won in zip(counts, winners, strict=True)) / 2 ** len(scores)
        yield tuple(sorted(left)), len(scores) - sum(winners), chance
