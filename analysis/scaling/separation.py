"""Whether a finite maximum exists: no way to infinity along which every answer only grows more likely.

All laws here have concave log likelihoods, so that a finite maximum exists unless some direction (a, t, δ) of
strengths, log tie parameter and order effect exists with

    a_i − a_j ± δ ≥ t for every pair of which i was preferred over j at least once (+ where i was shown first),
    |a_i − a_j ± δ| ≤ t for every pair that was tied at least once (t stands for 2 log ν in Davidson's law),

at least one of them not met as an equality. Without ties and order this is Ford's condition [Ford1957]: the graph of
wins must be strongly connected. For generalised linear models, and strengths a = X β made of factors, see [Albert1984].
Counts that link all items are recognised by their graph; the rest is a linear programme [Konis2007].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.scaling.counts import Counts
from documents import Finding
from documents.arrays import Floats

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Groups = tuple[tuple[int, ...], ...]
AGREES = 0.5
DIRECTION_ROUNDING = 1e-5
MOST_NAMED = 8
MOST_DENSE_ITEMS = 256


@dataclass(frozen=True, slots=True)
class Separation:
    """Why there is no finite maximum: ``groups`` of item indices, best first, that nothing links, and sentences."""

    groups: Groups
    sentences: tuple[str, ...]


def strong_groups(wins: Floats | csr_array) -> Groups:
    """Part the items into strongly connected groups, such that no group loses to a later one.

    Parameters
    ----------
    wins
        Shape (n, n), dense or sparse: counts at or above zero.
    """
    groups, labels, (above, below) = _components(wins, "strong")
    winner, loser = labels[above], labels[below]
    apart = winner != loser
    beaten_by: dict[int, set[int]] = {label: set() for label in range(len(groups))}
    for over, under in set(zip(winner[apart].tolist(), loser[apart].tolist(), strict=True)):
        beaten_by[under].add(over)
    return tuple(groups[label] for label in TopologicalSorter(beaten_by).static_order())


def compared_groups(wins: Floats | csr_array) -> Groups:
    """Part the items into groups that were never compared with each other, directly or through others.

    Parameters
    ----------
    wins
        Shape (n, n), dense or sparse: counts at or above zero.

    Returns
    -------
    tuple[tuple[int, ...], ...]
        The items of each group, in ascending order; groups in the order of their first items.

    Examples
    --------
    >>> import numpy as np
    >>> compared_groups(np.array([[0, 3, 0], [0, 0, 0], [0, 0, 0]]))
    ((0, 1), (2,))
    """
    # Most often all items hang together. That is seen without SciPy, which takes long to load.
    if isinstance(wins, np.ndarray) and len(wins) and _all_reached(((wins > 0) | (wins.T > 0))[None])[0]:
        return (tuple(range(len(wins))),)
    return tuple(_components(wins, "weak")[0])


def are_apart(counts: Counts) -> bool:
    """Say whether some items were never compared with the others, not even through others."""
    total = counts.total[0]
    return len(compared_groups(_graph(counts, total, total))) > 1


def _components(
    wins: Floats | csr_array, connection: Literal["strong", "weak"]
) -> tuple[list[tuple[int, ...]], NDArray[np.int32], tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Return groups of items, each item's group, and the items of each kind of win."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    graph = csr_array(wins > 0)
    number, labels = connected_components(graph, directed=True, connection=connection)
    order = np.argsort(labels, kind="stable")
    ends = np.searchsorted(labels[order], np.arange(1, number))
    edges = graph.tocoo()
    groups = [tuple(group.tolist()) for group in np.split(order, ends)]
    return groups, labels, (edges.row.astype(np.intp), edges.col.astype(np.intp))


def are_connected(wins: Floats) -> NDArray[np.bool_]:
    """Say of each of B win matrices, shape (B, n, n), whether its graph is strongly connected. Shape (B,)."""
    beaten = wins > 0
    return _all_reached(beaten) & _all_reached(beaten.transpose(0, 2, 1))


def _all_reached(edges: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Say of each graph, shape (B, n, n), whether ways lead from its first node to all others. Shape (B,)."""
    reached = edges[:, 0].copy()
    reached[:, 0] = True
    while not reached.all():
        further = reached | (reached[:, None, :] @ edges)[:, 0]
        if (further == reached).all():
            break
        reached = further
    return np.asarray(reached.all(axis=1))


def separated_items(groups: Groups) -> tuple[int, ...]:
    """Return the items outside the one largest group; all of them where no group is larger than the others."""
    largest = max(groups, key=len, default=())
    rivals = sum(len(group) == len(largest) for group in groups)
    if len(groups) < 2:
        return ()
    kept = set(largest) if rivals == 1 else set()
    return tuple(sorted(item for group in groups for item in group if item not in kept))


def separation_sentences(groups: Groups, wins: Floats | csr_array, items: Sequence[str]) -> list[str]:
    """Say in sentences how the groups are separated, one sentence for each boundary between groups."""
    from scipy.sparse import csr_array

    compared = compared_groups(wins)
    sentences = [
        f"{_names(group, items)}: never compared with the other items."
        for group in compared
        if len(group) < len(items) and not _is_the_rest(group, compared)
    ]
    place = np.empty(len(items), dtype=np.intp)
    for number, group in enumerate(groups):
        place[list(group)] = number
    edges = csr_array(wins).tocoo()
    across = (place[edges.row] != place[edges.col]) & (edges.data > 0)
    won, lost = np.zeros(len(groups)), np.zeros(len(groups))
    above: list[set[int]] = [set() for _ in groups]
    below: list[set[int]] = [set() for _ in groups]
    for winner, loser, count in zip(
        *(part[across].tolist() for part in (edges.row, edges.col, edges.data)), strict=True
    ):
        won[place[winner]] += count
        lost[place[loser]] += count
        below[place[winner]].add(loser)
        above[place[loser]].add(winner)
    for group, wins_over, losses, over, under in zip(groups, won, lost, above, below, strict=True):
        if wins_over and not losses:
            what = f"never lost to any of the other items ({wins_over:g} wins)."
        elif losses and not wins_over:
            what = f"never won against any of the other items ({losses:g} losses)."
        elif wins_over and losses:
            better, worse = _names(sorted(over - under), items), _names(sorted(under - over), items)
            what = f"never won against {better}, never lost to {worse}."
        else:
            continue
        if not _is_the_rest(group, groups):
            sentences.append(f"{_names(group, items)}: {what}")
    return sentences


def find_separation(counts: Counts, items: Sequence[str], *, ties: bool, prior: bool = False) -> Separation | None:
    """Say why the likelihood of ``counts`` has no finite maximum; None if it has one.

    Parameters
    ----------
    counts
        With a batch of one.
    ties
        Whether the law has a tie parameter; some answer is then a tie.
    prior
        Whether a prior keeps the strengths finite: only the law's parameter and the order effect can then run away.
    """
    if not counts.ordered and counts.n <= MOST_DENSE_ITEMS and are_connected(counts.wins())[0]:
        return None
    won, lost, tied = counts.won[0], counts.lost[0], counts.tied[0]
    wins = _graph(counts, won, lost)
    if not prior:
        apart = compared_groups(_graph(counts, won + tied, lost + tied))
        if len(apart) > 1:
            return Separation(apart, _never_compared(apart, items))
        if not counts.ordered and not ties:
            # Ford's condition: wins link all items both ways.
            groups = strong_groups(wins)
            if len(groups) == 1:
                return None
            return Separation(groups, (_drawing_apart(groups, items, ""), *separation_sentences(groups, wins, items)))
    if not won.any() and not lost.any():
        return _together(counts.n, "Every answer is a tie: nothing distinguishes the items.")
    if counts.ordered and not (won.any() and lost.any()):
        place = "first" if won.any() else "second"
        return _together(counts.n, f"The item shown {place} won every comparison that was decided.")
    if _linked_by_graph(counts, wins):
        return None
    if counts.ordered and not prior and _order_follows_items(counts):
        return Separation(
            tuple((item,) for item in range(counts.n)),
            ("Each pair was only shown in one order, so that order and strength cannot be distinguished.",),
        )
    direction = recession(counts, np.empty((counts.n, 0)) if prior else _one_each(counts.n), ties=ties)
    if direction is None:
        return None
    return _explained(np.zeros(counts.n) if prior else np.r_[0.0, direction[:-2]], direction[-2:], items)


def separation_of_method(
    counts: Counts, items: Sequence[str], *, ties: bool, method: Literal["ml", "firth", "map"]
) -> Separation | None:
    """Say why there is no finite fit by ``method``; None if there is one. Parameters as `find_separation`.

    Firth's penalty, as that by any law, acts as if each answer that some pair had might have been another: it keeps all
    items that comparisons link finite.
    """
    if method != "firth" or not (counts.won.any() or counts.lost.any()):
        return find_separation(counts, items, ties=ties, prior=method == "map")
    total = counts.total
    tied = total if ties else np.zeros_like(total)
    each = Counts(counts.n, counts.first, counts.second, total, total, tied, counts.ordered)
    return find_separation(each, items, ties=ties)


def drawn_apart(counts: Counts, *, ties: bool) -> Floats:
    """Return a direction, shape (n,), in which the strengths of separated counts, a batch of one, run away.

    Strengths that are equal along it, but for 1e-5, stay together.
    """
    if not counts.ordered and not ties:
        direction = np.empty(counts.n)
        for number, group in enumerate(strong_groups(_graph(counts, counts.won[0], counts.lost[0]))):
            direction[list(group)] = -number
        return direction
    found = recession(counts, _one_each(counts.n), ties=ties)
    return np.zeros(counts.n) if found is None else np.r_[0.0, found[:-2]]


def recession(counts: Counts, columns: Floats | csr_array, *, ties: bool = False) -> Floats | None:
    """Return a direction along which no answer grows less likely and some grow more likely; None if there is none.

    With a row of A for each kind of answer: maximise Σ u, 0 ≤ u ≤ 1, u ≤ A x. Any direction can be made so long that u
    reaches 1 wherever an answer agrees with it at all.

    Parameters
    ----------
    counts
        With a batch of one.
    columns
        Shape (n, c), dense or sparse: strengths are ``columns`` times coefficients.
    ties
        Whether there is a tie parameter.

    Returns
    -------
    Shape (c + 2,), at most 1 in size: coefficients, tie parameter and order effect.

    Raises
    ------
    ResultsError
        If the solver gives up.
    """
    from scipy.optimize import linprog
    from scipy.sparse import csr_array, eye_array, hstack, vstack

    won, lost, tied = counts.won[0] > 0, counts.lost[0] > 0, counts.tied[0] > 0
    apart = columns[counts.first] - columns[counts.second]
    kinds = [(won, 1.0, -1.0), (lost, -1.0, -1.0)]
    if ties:
        kinds += [(tied, 1.0, 1.0), (tied, -1.0, 1.0)]
    further = [
        np.full((int(chosen.sum()), 2), (tie * ties, side * float(counts.ordered))) for chosen, side, tie in kinds
    ]
    if isinstance(apart, np.ndarray):
        rows = [np.hstack([side * apart[chosen], own]) for (chosen, side, _), own in zip(kinds, further, strict=True)]
        agreeing = csr_array(np.unique(np.vstack(rows), axis=0))
    else:
        pairs = vstack([side * csr_array(apart)[np.flatnonzero(chosen)] for chosen, side, _ in kinds])
        agreeing = hstack([pairs, csr_array(np.vstack(further))], format="csr")
    number, width = agreeing.shape
    # The linear programme in (x, u): maximise Σ u with u − A x ≤ 0 and 0 ≤ u ≤ 1; x free, a tie parameter not negative.
    cost = np.concatenate([np.zeros(width), -np.ones(number)])
    free: tuple[float | None, float | None] = (None, None)
    beside = [(0.0, None) if ties else (0.0, 0.0), free if counts.ordered else (0.0, 0.0)]
    bounds = [free] * (width - 2) + beside + [(0.0, 1.0)] * number
    limits = hstack([-agreeing, eye_array(number)], format="csr")
    solved = linprog(cost, limits, np.zeros(number), bounds=bounds, method="highs")
    if solved.x is None:
        what = f"whether the effects have a finite maximum could not be decided: {solved.message}"
        raise ResultsError(Finding(what, remedy="leave a factor out, or use fewer levels"))
    direction = np.asarray(solved.x, dtype=np.float64)[:width]
    if float((agreeing @ direction).max(initial=0.0)) < AGREES:
        return None
    return np.asarray(direction / np.abs(direction).max(), dtype=np.float64)


def _one_each(n: int) -> csr_array:
    """Return the columns of free strengths, shape (n, n − 1), that of the first item 0."""
    from scipy.sparse import csr_array

    return csr_array((np.ones(n - 1), (np.arange(1, n), np.arange(n - 1))), shape=(n, n - 1))


def items_are_linked(counts: Counts) -> bool:
    """Say whether wins alone link all items both ways, so that no strengths of any kind run away."""
    return len(strong_groups(_graph(counts, counts.won[0], counts.lost[0]))) == 1


def _graph(counts: Counts, won: Floats, lost: Floats) -> csr_array:
    """Return who won how often against whom, shape (n, n)."""
    from scipy.sparse import csr_array

    rows, columns = np.r_[counts.first, counts.second], np.r_[counts.second, counts.first]
    graph = csr_array((np.r_[won, lost], (rows, columns)), shape=(counts.n, counts.n))
    graph.eliminate_zeros()
    return graph


def _linked_by_graph(counts: Counts, wins: csr_array) -> bool:
    if not counts.ordered:
        return len(strong_groups(wins)) == 1
    nothing = np.zeros_like(counts.won[0])
    places = (_graph(counts, counts.won[0], nothing), _graph(counts, nothing, counts.lost[0]))
    return all(len(strong_groups(graph)) == 1 for graph in places)


def _order_follows_items(counts: Counts) -> bool:
    """Say whether numbers a exist with a_i − a_j = 1 wherever i was shown before j."""
    from scipy.sparse.csgraph import breadth_first_order

    ones = np.ones(len(counts.first))
    order, before = breadth_first_order(_graph(counts, ones, ones), 0, directed=False)
    shown_before = set(zip(counts.first.tolist(), counts.second.tolist(), strict=True))
    level = np.zeros(counts.n)
    for item in order[1:].tolist():
        parent = int(before[item])
        level[item] = level[parent] + (1 if (item, parent) in shown_before else -1)
    return bool((level[counts.first] - level[counts.second] == 1).all())


def _together(n: int, sentence: str) -> Separation:
    return Separation((tuple(range(n)),), (sentence,))


def _explained(theta: Floats, further: Floats, items: Sequence[str]) -> Separation:
    tie, order = further.tolist()
    aside = " and ties grow more likely" if tie > DIRECTION_ROUNDING else ""
    if order > DIRECTION_ROUNDING:
        aside += " and the first place gains"
    elif order < -DIRECTION_ROUNDING:
        aside += " and the second place gains"
    ranked = np.argsort(-theta, kind="stable")
    cuts = np.flatnonzero(-np.diff(theta[ranked]) > DIRECTION_ROUNDING) + 1
    groups = tuple(tuple(sorted(group.tolist())) for group in np.split(ranked, cuts))
    if len(groups) > 1:
        return Separation(groups, (_drawing_apart(groups, items, aside),))
    return Separation(groups, (f"The likelihood rises without end{aside}.",))


def _drawing_apart(groups: Groups, items: Sequence[str], aside: str) -> str:
    above = ", then ".join(
        f"the other {len(group)} items" if _is_the_rest(group, groups) else _names(group, items) for group in groups[:4]
    )
    rest = ", and so on" if len(groups) > 4 else ""
    return f"The likelihood rises without end as items draw apart{aside}: {above}{rest}, best first."


def _never_compared(groups: Groups, items: Sequence[str]) -> tuple[str, ...]:
    largest = max(groups, key=len)
    return tuple(
        f"{_names(group, items)}: never compared with the other items."
        for group in groups
        if group is not largest or all(len(other) == len(group) for other in groups)
    )


def _is_the_rest(group: Sequence[int], groups: Groups) -> bool:
    """Say whether ``group`` is what the others are apart from: the largest, with too many items to name."""
    return len(group) > MOST_NAMED and all(len(other) < len(group) for other in groups if other is not group)


def _names(group: Sequence[int], items: Sequence[str], most: int = MOST_NAMED) -> str:
    names = [f"'{items[item]}'" for item in group[:most]]
    return ", ".join(names) + (f" and {len(group) - most} more" if len(group) > most else "")
