"""The exact law of circular triads, against all tournaments one by one, and against Kendall's moments."""

from __future__ import annotations

from itertools import combinations, product
from math import comb

import numpy as np
import pytest

from analysis.observers.tournaments import EXACT_UP_TO, triad_chances


def one_by_one(n: int) -> list[int]:
    """Return how many tournaments have 0, 1, 2, ... circular triads: each is built, and its triads looked at."""
    pairs = list(combinations(range(n), 2))
    counts = [0] * (comb(n, 3) + 1)
    for outcome in product((False, True), repeat=len(pairs)):
        beats = {pair: won for pair, won in zip(pairs, outcome, strict=True)}
        counts[sum(beats[a, b] == beats[b, c] != beats[a, c] for a, b, c in combinations(range(n), 3))] += 1
    return counts


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_all_tournaments(n: int) -> None:
    assert (triad_chances(n) * 2 ** comb(n, 2)).tolist() == one_by_one(n)


def test_kendalls_table_for_six() -> None:
    counts = triad_chances(6) * 2**15
    assert counts[:9].tolist() == [720, 960, 2240, 2880, 6240, 3648, 8640, 4800, 2640]
    assert not counts[9:].any()


@pytest.mark.parametrize("n", [7, 8, EXACT_UP_TO])
def test_moments(n: int) -> None:
    chances = triad_chances(n)
    triads = comb(n, 3)
    values = np.arange(triads + 1)
    mean = values @ chances
    assert chances.sum() == pytest.approx(1, abs=1e-14)
    assert mean == pytest.approx(triads / 4)
    assert (values - mean) ** 2 @ chances == pytest.approx(3 * triads / 16)
    assert (values - mean) ** 3 @ chances == pytest.approx(-3 * triads * (n - 4) / 32)
