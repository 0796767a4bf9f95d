"""How consistent each observer is: circular triads, A over B, B over C and yet C over A [Kendall1940].

Kendall's coefficient ζ = 1 − T / T_max is 1 where there is none and 0 where there are as many as there can be. It
belongs to designs in which every two items were compared. The test works for any design. It asks for the chance of so
few circular triads if each pair's verdict were the toss of a coin: by enumeration where that is feasible, else by the
law with the same mean, variance and skewness, which for complete designs is Kendall's χ² (with continuity corrected
towards caution, T + ½). Ties stay ties: a triad with ties counts as the share of the ways to break them that make it
circular, as in the mean over fair coins.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.comparisons import Comparisons
from analysis.observers.tails import Tail, from_chances, from_moments
from analysis.observers.tournaments import EXACT_UP_TO, triad_chances
from analysis.observers.verdicts import Flags, Verdicts, verdicts

Floats = NDArray[np.float64]

MOST_COINS = 12


@dataclass(frozen=True, slots=True)
class Consistency:
    """One observer's circular triads.

    Attributes
    ----------
    circular
        T: a whole number unless there are ties.
    triads
        How many threes of items were all compared with each other; by chance, a quarter of them is circular.
    zeta
        Kendall's ζ, at most 1; None unless every two items that the observer met were compared, or below 3 items.
    ties
        How many pairs have no verdict.
    test
        The chance of at most T circular triads by coin tosses; None where no toss could change T.
    """

    circular: float
    triads: int
    zeta: float | None
    ties: int
    test: Tail | None

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "circular_triads": self.circular,
            "triads": self.triads,
            "zeta": self.zeta,
            "ties": self.ties,
            "test": self.test.to_json() if self.test else None,
        }


def consistencies(comparisons: Comparisons) -> tuple[Consistency, ...]:
    """Return each observer's consistency, in the order of ``comparisons.observers``."""
    return tuple(consistency(verdict, compared) for _, verdict, compared in verdicts(comparisons))


def consistency(verdict: Verdicts, compared: Flags) -> Consistency:
    """Return the consistency of one observer's ``verdict`` on the pairs ``compared``, as `verdicts` yields both."""
    n = len(verdict)
    linked = compared.astype(np.float64)
    triads = round(float(np.trace(linked @ linked @ linked)) / 6)
    circular = float(circular_triads(verdict[None], compared)[0])
    pairs = int(compared.sum()) // 2
    ties = pairs - int(np.count_nonzero(verdict)) // 2
    complete = n > 2 and pairs == comb(n, 2)
    zeta = 1 - circular / most_circular_triads(n) if complete else None
    return Consistency(circular, triads, zeta, ties, _test(verdict, compared, circular, triads))


def circular_triads(verdict: Verdicts, compared: Flags) -> Floats:
    """Count the circular triads of each set of verdicts. Shapes (B, n, n) and (n, n) to (B,).

    With P the chance that a pair goes one way, 1, 0 or ½ where tied, and 0 where it was not compared: trace(P³) / 3.
    """
    chance = np.where(compared, (verdict + 1.0) / 2, 0.0)
    return np.asarray(np.einsum("bij,bji->b", chance @ chance, chance) / 3)


def most_circular_triads(n: int) -> int:
    """Return the most circular triads that n items, all compared, can make."""
    return (n**3 - (n if n % 2 else 4 * n)) // 24


def _test(verdict: Verdicts, compared: Flags, circular: float, triads: int) -> Tail | None:
    n = len(verdict)
    coins = int(np.count_nonzero(verdict)) // 2
    variance, third = _spread(verdict, compared)
    if not variance:
        return None
    if coins == comb(n, 2) and n <= EXACT_UP_TO:
        return from_chances(triad_chances(n), round(circular))
    if coins <= MOST_COINS:
        return _enumerated(verdict, compared, circular)
    # A triad with a tie counts 0 or ½, one with more of them ¼ whatever the third verdict is.
    half_step = 0.5 if np.count_nonzero(verdict) == np.count_nonzero(compared) else 0.25
    return from_moments(circular, half_step, triads / 4, variance, third)


def _enumerated(verdict: Verdicts, compared: Flags, circular: float) -> Tail:
    first, second = np.nonzero(np.triu(verdict))
    ways = np.arange(2 ** len(first))
    sign = (2 * ((ways[:, None] >> np.arange(len(first))) & 1) - 1).astype(np.int8)
    tossed = np.zeros((len(ways), *verdict.shape), dtype=np.int8)
    tossed[:, first, second] = sign
    tossed[:, second, first] = -sign
    counts = circular_triads(tossed, compared)
    margin = 1e-6  # T moves by ½ at least
    below, p = (float((counts < circular + edge).mean()) for edge in (-margin, margin))
    return Tail(below, p - below, exact=True, least_p=float((counts < counts.min() + margin).mean()))


def _spread(verdict: Verdicts, compared: Flags) -> tuple[float, float]:
    """Return variance and third central moment of T if each verdict is a coin toss.

    4 T less its mean is a sum, over each two pairs that share an item and lie in a triad, of the product of their
    signs. Such products are uncorrelated, and three of them multiply to 1 only around a triad, or, with sign −1, at an
    item whose three partners were all compared with each other.
    """
    coins = (verdict != 0).astype(np.float64)
    linked = compared.astype(np.float64)
    products = np.trace(coins @ linked @ coins) / 2
    around = np.trace(coins @ coins @ coins) / 6
    return float(products / 16), float((around - _stars(coins > 0, linked)) * 6 / 64)


def _stars(coins: Flags, linked: Floats) -> float:
    """Count the items with three ``coins``, together with those, whose three partners are ``linked`` to each other."""
    if linked.sum() == len(linked) * (len(linked) - 1):
        return float(sum(comb(degree, 3) for degree in coins.sum(axis=1).tolist()))
    parts = [linked[np.ix_(row, row)] for row in coins]
    return float(sum(np.trace(part @ part @ part) for part in parts)) / 6
