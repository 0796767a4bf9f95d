"""Which items no finite strength can hold: Ford's condition [Ford1957].

A maximum of the Bradley-Terry likelihood exists, and is unique, if and only if the items cannot be parted into two
groups of which one never loses to the other: the graph of wins must be strongly connected.
"""

from __future__ import annotations

from collections.abc import Sequence
from graphlib import TopologicalSorter
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Groups = tuple[tuple[int, ...], ...]


def strong_groups(wins: NDArray[np.float64]) -> Groups:
    """Part the items into strongly connected groups, such that no group loses to a later one.

    Parameters
    ----------
    wins
        Shape (n, n), counts at or above zero.
    """
    groups, labels = _components(wins, "strong")
    winner, loser = labels[np.nonzero(wins > 0)[0]], labels[np.nonzero(wins > 0)[1]]
    beaten_by: dict[int, set[int]] = {label: set() for label in range(len(groups))}
    for above, below in set(zip(winner[winner != loser].tolist(), loser[winner != loser].tolist(), strict=True)):
        beaten_by[below].add(above)
    return tuple(groups[label] for label in TopologicalSorter(beaten_by).static_order())


def compared_groups(wins: NDArray[np.float64]) -> Groups:
    """Part the items into groups that were never compared with each other."""
    return tuple(_components(wins, "weak")[0])


def _components(
    wins: NDArray[np.float64], connection: Literal["strong", "weak"]
) -> tuple[list[tuple[int, ...]], NDArray[np.int32]]:
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    number, labels = connected_components(csr_matrix((wins > 0).astype(np.int8)), directed=True, connection=connection)
    return [tuple(int(item) for item in np.flatnonzero(labels == label)) for label in range(number)], labels


def are_connected(wins: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Say of each of B win matrices, shape (B, n, n), whether its graph is strongly connected. Shape (B,)."""
    n = wins.shape[1]
    reach = ((wins > 0) | np.eye(n, dtype=bool)).astype(np.float32)
    length = 1
    while length < n - 1:
        reach = np.minimum(reach @ reach, 1)
        length *= 2
    return np.asarray((reach > 0).all(axis=(1, 2)))


def separated_items(groups: Groups) -> tuple[int, ...]:
    """Return the items outside the one largest group; all of them where no group is larger than the others."""
    largest = max(groups, key=len, default=())
    rivals = sum(len(group) == len(largest) for group in groups)
    if len(groups) < 2:
        return ()
    kept = largest if rivals == 1 else ()
    return tuple(sorted(item for group in groups for item in group if item not in kept))


def explain(groups: Groups, wins: NDArray[np.float64], items: Sequence[str]) -> list[str]:
    """Say in sentences how the groups are separated, one sentence for each boundary between groups."""
    sentences = []
    for group in compared_groups(wins):
        if len(group) < len(items):
            sentences.append(f"{_list(group, items)}: never compared with the other items.")
    for group in groups:
        others = [item for item in range(len(items)) if item not in group]
        won = wins[np.ix_(group, others)].sum()
        lost = wins[np.ix_(others, group)].sum()
        if won and not lost:
            sentences.append(f"{_list(group, items)}: never lost to any of the other items ({won:g} wins).")
        elif lost and not won:
            sentences.append(f"{_list(group, items)}: never won against any of the other items ({lost:g} losses).")
        elif won and lost:
            above = [item for item in others if wins[item, group].sum() and not wins[group, item].sum()]
            below = [item for item in others if wins[group, item].sum() and not wins[item, group].sum()]
            sentences.append(
                f"{_list(group, items)}: never won against {_list(above, items)}, never lost to {_list(below, items)}."
            )
    return sentences


def _list(group: Sequence[int], items: Sequence[str], most: int = 8) -> str:
    names = [f"'{items[item]}'" for item in group[:most]]
    if len(group) > most:
        names.append(f"{len(group) - most} more")
    return ", ".join(names)
