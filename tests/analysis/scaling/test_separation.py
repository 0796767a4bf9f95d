"""Ford's condition, against reachability by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.scaling import are_connected, compared_groups
from analysis.scaling.separation import explain, separated_items, strong_groups


def graphs(n: int = 6) -> st.SearchStrategy[NDArray[np.float64]]:
    return st.lists(st.sampled_from([0, 0, 0, 1, 2]), min_size=n * n, max_size=n * n).map(
        lambda values: np.array(values, dtype=float).reshape(n, n) * (1 - np.eye(n))
    )


def reaches(wins: NDArray[np.float64], start: int) -> set[int]:
    met, waiting = {start}, [start]
    while waiting:
        for item in np.flatnonzero(wins[waiting.pop()] > 0).tolist():
            if item not in met:
                met.add(item)
                waiting.append(item)
    return met


@given(graphs())
def test_groups_are_what_reaches_each_other_and_no_group_loses_to_a_later_one(wins: NDArray[np.float64]) -> None:
    groups = strong_groups(wins)
    reach = [reaches(wins, item) for item in range(6)]
    place = {item: number for number, group in enumerate(groups) for item in group}
    assert sorted(place) == list(range(6))
    for a in range(6):
        for b in range(6):
            assert (place[a] == place[b]) == (b in reach[a] and a in reach[b])
            if wins[a, b]:
                assert place[a] <= place[b]
    assert are_connected(wins[None])[0] == (len(groups) == 1)


@given(graphs())
def test_compared_groups_do_not_look_at_who_won(wins: NDArray[np.float64]) -> None:
    groups = compared_groups(wins)
    assert {frozenset(group) for group in groups} == {frozenset(reaches(wins + wins.T, item)) for item in range(6)}


@pytest.mark.parametrize(
    ("groups", "items"),
    [
        (((0, 1, 2),), ()),
        ((), ()),
        (((0,), (1, 2, 3)), (0,)),
        (((2,), (0, 1), (3,)), (2, 3)),
        (((0, 1), (2, 3)), (0, 1, 2, 3)),
        (((1,), (0,)), (0, 1)),
    ],
)
def test_separated_items_stand_outside_the_one_largest_group(
    groups: tuple[tuple[int, ...], ...], items: tuple[int, ...]
) -> None:
    assert separated_items(groups) == items


def test_sentences_say_who_never_lost_or_won_or_met_the_others() -> None:
    chain = np.array([[0, 2, 0], [0, 0, 3], [0, 0, 0]], dtype=float)
    assert explain(strong_groups(chain), chain, "abc") == [
        "'a': never lost to any of the other items (2 wins).",
        "'b': never won against 'a', never lost to 'c'.",
        "'c': never won against any of the other items (3 losses).",
    ]
    apart = np.zeros((3, 3))
    apart[0, 1] = apart[1, 0] = 1
    assert explain(strong_groups(apart), apart, "abc") == [
        "'a', 'b': never compared with the other items.",
        "'c': never compared with the other items.",
    ]
