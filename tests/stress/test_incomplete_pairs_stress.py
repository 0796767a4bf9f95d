"""Shared pairs pushed to the edges: drawn sets of pairs, all places, from the fewest pairs that link to all."""

from __future__ import annotations

import random
from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.scaling import compared_groups
from runner.blocks.incomplete_pairs import PLACES, designs, fewest_pairs
from runner.blocks.orders import Pair

pytestmark = pytest.mark.stress


def sets(count: int, pairs: list[Pair]) -> list[tuple[int, ...]]:
    """Return what pairs link."""
    compared: NDArray[np.float64] = np.zeros((count, count))
    for pair in pairs:
        compared[pair] = 1.0
    return sorted(tuple(part) for part in compared_groups(compared))


def test_any_pairs_are_shared_evenly_and_each_part_links_what_all_link() -> None:
    for seed in range(60):
        rng = random.Random(seed)
        count = rng.randrange(2, 16)
        every = list(combinations(range(count), 2))
        pairs = sorted(rng.sample(every, rng.randint(1, len(every))))
        whole = sets(count, pairs)
        fewest = fewest_pairs(count, pairs)
        assert fewest == count - len(whole)
        each = rng.choice((fewest, rng.randint(fewest, len(pairs)), len(pairs)))
        times = np.zeros(len(pairs), dtype=np.int64)
        parts = list(designs(count, pairs, each, f"seed {seed}", PLACES))
        for part in parts:
            assert len(set(part)) == len(part) == each
            assert sets(count, [pairs[index] for index in part]) == whole
            times[part] += 1
        assert times.sum() == PLACES * each


@pytest.mark.parametrize("count", [4, 8, 20, 60])
@pytest.mark.parametrize("share", [0.0, 0.05, 0.3, 0.9, 1.0])
def test_of_all_pairs_none_is_compared_much_oftener_than_another_at_any_number_of_observers(
    count: int, share: float
) -> None:
    """By one at most; by two where there are hardly more pairs than link the stimuli."""
    pairs = list(combinations(range(count), 2))
    each = max(count - 1, round(share * len(pairs)))
    times = np.zeros(len(pairs), dtype=np.int64)
    most = 0
    for part in designs(count, pairs, each, "seed", PLACES):
        times[part] += 1
        most = max(most, int(np.ptp(times)))
    print(f"{count} stimuli, {each} of {len(pairs)}: at most {most}")
    assert most <= (2 if each < 1.5 * count else 1)
