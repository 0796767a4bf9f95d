"""Every pair once per repeat, sides balanced, no stimulus twice running."""

import itertools
import random
import time
from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from runner.blocks import Draw, Pair, spaced
from runner.blocks.orders import grouped_order, pair_order, repeated
from tests.runner.every_kind import setting

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


@given(st.integers(2, 12), st.integers(1, 4), SEEDS, SEEDS)
def test_sides_balance_over_a_session_and_between_neighbours(
    count: int, repeats: int, side_seed: str, order_seed: str
) -> None:
    order = pair_order(count, repeats, side_seed, order_seed)
    trials = Counter(item for pair in order for item in pair)
    first = Counter(pair[0] for pair in order)
    assert all(trials[item] == repeats * (count - 1) for item in range(count))
    assert all(abs(2 * first[item] - trials[item]) <= 1 for item in range(count))
    neighbour = pair_order(count, repeats, side_seed, f"{order_seed}, another", flip=True)
    assert Counter((second, first) for first, second in neighbour) == Counter(order)


@pytest.mark.parametrize(("count", "within_s"), [(100, 1.0), pytest.param(300, 10.0, marks=pytest.mark.nightly)])
def test_the_order_of_many_stimuli_is_soon_drawn(count: int, within_s: float) -> None:
    """A processor's seconds, so that others at work on the machine do not count."""
    began_s = time.process_time()
    order = pair_order(count, 1, "side", "order")
    assert time.process_time() - began_s < within_s
    assert len(order) == count * (count - 1) // 2
    assert _neighbours_sharing(order) == 0


@given(st.integers(5, 14), st.integers(1, 2), SEEDS)
def test_no_stimulus_comes_twice_running(count: int, repeats: int, seed: str) -> None:
    assert _neighbours_sharing(pair_order(count, repeats, seed, seed)) == 0


def test_the_order_of_one_seed_is_what_it_was() -> None:
    """A session is resumed under the order it began with, so the order must not change with the program."""
    assert pair_order(4, 1, "side", "order") == [(2, 3), (1, 0), (2, 1), (0, 3), (3, 1), (0, 2)]


def test_pairs_of_sets_change_sides_with_each_repeat_and_no_item_comes_twice_running() -> None:
    sets = {pair: scene for scene in range(4) for pair in itertools.combinations(range(4 * scene, 4 * scene + 4), 2)}
    order = grouped_order(sets, 4, "side", "order")
    repeats = [set(order[start : start + 24]) for start in range(0, 96, 24)]
    swapped = {(second, first) for first, second in repeats[0]}
    assert repeats == [repeats[0], swapped, repeats[0], swapped]
    assert _neighbours_sharing(order) == 0


def test_neighbours_take_opposite_sides_and_each_the_other_in_a_second_sitting() -> None:
    flips = [[setting(observer=code, draw=Draw(sitting=n)).flips_sides for n in (1, 2, 3)] for code in ("01", "02")]
    assert flips == [[True, False, True], [False, True, False]]


def test_observers_are_paired_as_the_rule_of_their_log_says() -> None:
    """By 1, as older logs have it, 2 and 3 belong together; by 2, 1 and 2."""
    numbers = range(1, 7)
    assert [Draw(rule=1).pair_number(observer) for observer in numbers] == [0, 1, 1, 2, 2, 3]
    assert [Draw().pair_number(observer) for observer in numbers] == [0, 0, 1, 1, 2, 2]


# Orders in which neighbours differ wherever that is possible, and which are drawn from all of them.


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
