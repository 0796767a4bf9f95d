"""Orders in which neighbours differ wherever that is possible, and which are drawn from all of them."""

from __future__ import annotations

import random
from collections import Counter
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from runner.blocks import spaced
from runner.blocks.orders import repeated


@given(st.lists(st.sampled_from("abcd"), max_size=30), st.integers(0, 10_000))
def test_as_few_neighbours_as_there_can_be_are_of_one_group(groups: list[str], seed: int) -> None:
    items = list(enumerate(groups))
    order = spaced(items, lambda item: item[1], random.Random(seed))
    assert sorted(order) == items
    clashes = sum(one[1] == other[1] for one, other in pairwise(order))
    most = max(Counter(groups).values(), default=0)
    assert clashes == max(0, most - (len(items) - most) - 1)
    assert order == spaced(items, lambda item: item[1], random.Random(seed))


def test_every_item_comes_first_about_as_often() -> None:
    items = [paint + str(number) for paint in "abcde" for number in range(3)]
    rng = random.Random(1)
    first = Counter(spaced(items, lambda item: item[0], rng)[0] for _ in range(6000))
    assert set(first) == set(items)
    assert 300 < min(first.values()) <= max(first.values()) < 500  # 400 each, within five standard deviations


@given(st.integers(1, 9), st.integers(1, 5), st.integers(0, 10_000))
def test_repeats_hold_everything_once_and_nothing_twice_running(count: int, repeats: int, seed: int) -> None:
    order = repeated(range(count), repeats, random.Random(seed))
    for start in range(0, len(order), count):
        assert sorted(order[start : start + count]) == list(range(count))
    assert count == 1 or all(one != other for one, other in pairwise(order))
