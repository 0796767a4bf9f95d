"""The letter display against its slow twin, pair by pair on sets, and against every graph of few items."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.classes.classes import TooManyClasses, letter_display
from tests.choice import nightly

Differs = NDArray[np.bool_]


def absorbed_pair_by_pair(differs: Differs) -> set[frozenset[int]]:
    """Insert and absorb as Piepho states it: split every column that holds both items of a pair that differs."""
    columns = {frozenset(range(len(differs)))}
    for first, second in np.argwhere(np.triu(differs, 1)).tolist():
        halves = {column - {item} for column in columns if {first, second} <= column for item in (first, second)}
        columns = {column for column in columns if not {first, second} <= column} | halves
        columns = {column for column in columns if not any(column < other for other in columns)}
    return columns


def swept_plainly(columns: set[frozenset[int]]) -> set[frozenset[int]]:
    """Leave out, smallest first, each column and then each membership whose pairs the other columns hold as well."""

    def spared(item: int, column: frozenset[int], others: list[frozenset[int]]) -> bool:
        return all(any({item, mate} <= other for other in others) for mate in column)

    kept = sorted(columns, key=lambda column: (len(column), sorted(column)))
    for column in list(kept):
        others = [other for other in kept if other is not column]
        if all(spared(item, column, others) for item in column):
            kept = others
    for place, column in enumerate(kept):
        for item in sorted(column):
            if spared(item, kept[place], kept[:place] + kept[place + 1 :]):
                kept[place] = kept[place] - {item}
    return set(kept)


def graph(n: int, edges: list[bool]) -> Differs:
    differs = np.zeros((n, n), dtype=bool)
    differs[np.triu_indices(n, 1)] = edges
    return differs | differs.T


def check(differs: Differs) -> None:
    """Hold the display against its definition: every alike pair together, no other; nothing that can be spared."""
    letters = letter_display(differs)
    together = {pair for letter in letters for pair in combinations(sorted(letter), 2)}
    assert together == {pair for pair in combinations(range(len(differs)), 2) if not differs[pair]}
    assert set().union(*letters) == set(range(len(differs)))
    for letter in letters:
        others = [other for other in letters if other is not letter]
        for item in letter:
            assert not all(any({item, mate} <= other for other in others) for mate in letter)
    assert set(letters) == swept_plainly(absorbed_pair_by_pair(differs))
    assert len(set(letters)) == len(letters)


@pytest.mark.parametrize("n", [2, 3, 4, *nightly(5)])
def test_every_graph_of_few_items(n: int) -> None:
    pairs = n * (n - 1) // 2
    for number in range(2**pairs):
        check(graph(n, [bool(number >> bit & 1) for bit in range(pairs)]))


@given(st.sampled_from([6, 7]).flatmap(lambda n: st.tuples(st.just(n), st.binary(min_size=21, max_size=21))))
def test_random_graphs_of_six_and_seven_items(case: tuple[int, bytes]) -> None:
    n, chance = case
    check(graph(n, [byte < 128 for byte in chance[: n * (n - 1) // 2]]))


def test_four_hundred_items_in_a_row() -> None:
    """Items that differ when more than 20 places apart: 380 classes, one for each run of 21 neighbours."""
    place = np.arange(400)
    differs = np.abs(place[:, None] - place) > 20
    letters = letter_display(differs)
    held = np.zeros((400, 400), dtype=bool)
    for letter in letters:
        held[np.ix_(sorted(letter), sorted(letter))] = True
    assert len(letters) == 380
    assert (held == ~differs).all()


def test_more_classes_than_anyone_reads_are_refused_soon() -> None:
    """Of 3k items, of which each differs from two others only, there are 3 to the power of k classes."""
    items = 60
    differs = np.zeros((items, items), dtype=bool)
    for first in range(0, items, 3):
        differs[first : first + 3, first : first + 3] = ~np.eye(3, dtype=bool)
    with pytest.raises(TooManyClasses, match="more than 2000 classes"):
        letter_display(differs)
