"""Every pair once per repeat, sides balanced, no stimulus twice running."""

import itertools
from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from runner.blocks.pair_order import Pair, pair_order

SEEDS = st.text(max_size=8)


def _neighbours_sharing(order: list[Pair]) -> int:
    return sum(bool(set(one) & set(other)) for one, other in itertools.pairwise(order))


@given(st.integers(2, 14), st.integers(1, 3), SEEDS, SEEDS, st.booleans())
def test_every_pair_once_per_repeat_with_balanced_sides(
    count: int, repeats: int, side_seed: str, order_seed: str, flip: bool
) -> None:
    order = pair_order(count, repeats, side_seed, order_seed, flip=flip)
    size = count * (count - 1) // 2
    assert len(order) == repeats * size
    for repeat in range(repeats):
        part = order[repeat * size : (repeat + 1) * size]
        assert len({frozenset(pair) for pair in part}) == size
        first = Counter(pair[0] for pair in part)
        assert all(abs(2 * first[item] - (count - 1)) <= 1 for item in range(count))


@given(st.integers(5, 14), st.integers(1, 2), SEEDS)
def test_no_stimulus_comes_twice_running(count: int, repeats: int, seed: str) -> None:
    assert _neighbours_sharing(pair_order(count, repeats, seed, seed)) == 0


@given(SEEDS, SEEDS)
def test_flipping_swaps_every_side(side_seed: str, order_seed: str) -> None:
    one = set(pair_order(10, 1, side_seed, order_seed))
    other = set(pair_order(10, 1, side_seed, "another order", flip=True))
    assert other == {(second, first) for first, second in one}


def test_same_seed_same_order_other_seed_other_order() -> None:
    assert pair_order(10, 1, "s", "a") == pair_order(10, 1, "s", "a")
    assert pair_order(10, 1, "s", "a") != pair_order(10, 1, "s", "b")


def test_the_order_of_one_seed_is_what_it_was() -> None:
    """A session is resumed under the order it began with, so the order must not change with the program."""
    assert pair_order(4, 1, "side", "order") == [(2, 3), (1, 0), (2, 1), (0, 3), (3, 1), (0, 2)]
