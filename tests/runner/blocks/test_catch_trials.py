"""Catch trials: spread, never first, never two running, clear of their neighbours where that can be, on both sides."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from runner.blocks import Stimuli
from runner.blocks.catch_trials import CatchTrials, PlacedPair, mix_in
from runner.blocks.orders import pair_order

SEEDS = st.text(max_size=6)
PLAIN = [f"s{index}" for index in range(12)]
OBVIOUS = ["s0", "s1"], ["best", "worst"], ["fine", "poor"]


def _others(count: int, repeats: int, side_seed: str, order_seed: str) -> list[PlacedPair]:
    return [PlacedPair(PLAIN[a], PLAIN[b]) for a, b in pair_order(count, repeats, side_seed, order_seed)]


@settings(max_examples=15)
@given(st.integers(2, 12), st.integers(1, 4), SEEDS, SEEDS, st.booleans(), st.data())
def test_they_are_spread_and_leave_the_others_as_they_were(
    count: int, repeats: int, side_seed: str, order_seed: str, flip: bool, data: st.DataObject
) -> None:
    others = _others(count, repeats, side_seed, order_seed)
    number = data.draw(st.integers(1, len(others)))
    identical = data.draw(st.integers(0, number))
    pairs = OBVIOUS[: data.draw(st.integers(1, 3))]
    shown_twice = CatchTrials(pairs=pairs, identical=identical)
    mixed = mix_in(others, shown_twice, number, PLAIN[:count], side_seed, order_seed, flip=flip)
    assert [trial for trial in mixed if not trial.catch] == others
    catch = [trial for trial in mixed if trial.catch]
    assert len(catch) == number
    assert not mixed[0].catch
    assert not any(one.catch and other.catch for one, other in pairwise(mixed))
    same = [trial for trial in catch if trial.catch == "identical"]
    assert len(same) == identical
    assert all(trial.first == trial.second and trial.first in PLAIN[:count] for trial in same)
    obvious = [trial for trial in catch if trial.catch == "obvious"]
    shown = Counter(frozenset(trial.stimuli) for trial in obvious)
    assert max(shown.values(), default=0) - min((shown[frozenset(pair)] for pair in pairs), default=0) <= 1
    better_first = sum(trial.first == trial.better for trial in obvious)
    assert abs(2 * better_first - len(obvious)) <= 1
    # Spread: each equal part of the others, in their order, has one.
    before, heights = 0, []
    for trial in mixed:
        heights += [before] if trial.catch else []
        before += not trial.catch
    for index, height in enumerate(heights):
        assert len(others) * index // number < height <= len(others) * (index + 1) // number


@given(SEEDS, SEEDS, st.integers(1, 12))
def test_the_neighbouring_observer_sees_them_on_the_other_side(side_seed: str, order_seed: str, number: int) -> None:
    catch = CatchTrials(pairs=OBVIOUS)

    def sides(order: str, *, flip: bool) -> Counter[tuple[str, str]]:
        mixed = mix_in(_others(6, 1, "", ""), catch, number, PLAIN[:6], side_seed, order, flip=flip)
        return Counter((trial.first, trial.second) for trial in mixed if trial.catch)

    swapped = {(second, first): times for (first, second), times in sides("another", flip=True).items()}
    assert sides(order_seed, flip=False) == swapped


@given(st.integers(6, 12), st.integers(1, 2), SEEDS)
def test_they_share_no_stimulus_with_their_neighbours_where_there_is_room(count: int, repeats: int, seed: str) -> None:
    """Pairs from outside fit everywhere."""
    others = _others(count, repeats, seed, seed)
    catch = CatchTrials(pairs=OBVIOUS[1:])
    mixed = mix_in(others, catch, len(others) // 5, PLAIN[:count], seed, seed)
    assert not any(set(one.stimuli) & set(other.stimuli) for one, other in pairwise(mixed))


@given(st.integers(8, 12), SEEDS)
def test_a_pair_of_the_block_itself_is_put_between_others(count: int, seed: str) -> None:
    """Of eight stimuli or more, more pairs lack two given ones than have one: two of these stand together."""
    others = _others(count, 1, seed, seed)
    mixed = mix_in(others, CatchTrials(pairs=OBVIOUS[:1]), 1, PLAIN[:count], seed, seed)
    assert not any(set(one.stimuli) & set(other.stimuli) for one, other in pairwise(mixed))


STIMULI = Stimuli({name: {} for name in ("a", "b", "c", "d", "e", "f")})


@pytest.mark.parametrize(
    ("written", "path", "what"),
    [
        ({}, ("catch",), "something to show"),
        ({"every": 5}, ("catch",), "something to show"),
        ({"every": 5, "identical": 1}, ("catch",), "2 of 3 catch trials have no pair"),
        ({"every": 5, "identical": 4, "pairs": [["a", "b"]]}, ("catch", "identical"), "4 of 3"),
        ({"every": 16, "pairs": [["a", "b"]]}, ("catch", "every"), "every 16"),
        ({"identical": 16}, ("catch",), "too many among 15"),
        ({"share": 0.2, "pairs": [["a", "x"]]}, ("catch", "pairs", 0, 1), "no stimulus 'x'"),
        ({"share": 0.2, "pairs": [["a", "a"]]}, ("catch", "pairs", 0, 1), "stands twice"),
    ],
)
def test_faults(written: dict[str, object], path: tuple[object, ...], what: str) -> None:
    (fault,) = CatchTrials.model_validate(written).faults(STIMULI, 15)
    assert fault.path == path
    assert what in fault.message


@pytest.mark.parametrize(
    ("written", "count"),
    [
        ({"every": 5}, 3),
        ({"share": 0.1}, 2),
        ({"share": 0.01}, 1),
        ({}, 1),
        ({"identical": 2}, 3),
    ],
)
def test_how_many(written: dict[str, object], count: int) -> None:
    spec = CatchTrials.model_validate({**written, "pairs": [["a", "b"]]})
    assert spec.count(15) == count
    assert not list(spec.faults(STIMULI, 15))
