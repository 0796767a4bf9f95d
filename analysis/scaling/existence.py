"""Whether a maximum exists: no way to infinity along which every answer only grows more likely.

All laws here have concave log likelihoods, so that a finite maximum exists unless some direction (a, t, δ) of
strengths, log tie parameter and order effect exists with

    a_i − a_j ± δ ≥ t for every pair of which i was preferred over j at least once (+ where i was shown first),
    |a_i − a_j ± δ| ≤ t for every pair that was tied at least once (t stands for 2 log ν in Davidson's law),

at least one of them not met as an equality. Without ties and order this is Ford's condition [Ford1957]; for
generalised linear models see [Albert1984]. Counts that keep all items together are recognised by their graph; the rest
is a linear programme.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.scaling.cells import Cells
from analysis.scaling.separation import Groups, compared_groups, strong_groups

Floats = NDArray[np.float64]
SLACK = 1e-4
LEVEL = 1e-5


@dataclass(frozen=True, slots=True)
class Separation:
    """Why there is no maximum: ``groups`` of item indices, best first, that nothing holds together, and sentences."""

    groups: Groups
    sentences: tuple[str, ...]


def find_separation(cells: Cells, items: Sequence[str], *, ties: bool, prior: bool = False) -> Separation | None:
    """Say why the likelihood of ``cells`` has no finite maximum; None if it has one.

    Parameters
    ----------
    ties
        Whether the law has a tie parameter; some answer is then a tie.
    prior
        Whether a prior holds the strengths: then only the law's parameter and the order effect can run away.
    """
    wins = _graph(cells, np.ones(len(cells.first), dtype=bool))
    if not prior:
        met = _graph(cells, np.ones(len(cells.first), dtype=bool), tied=True)
        apart = compared_groups(met)
        if len(apart) > 1:
            return Separation(apart, _never_compared(apart, items))
        if not cells.ordered and not ties:
            groups = strong_groups(wins)
            return None if len(groups) == 1 else Separation(groups, _drawing_apart(groups, items, ""))
    one_sided = _one_sided(cells)
    if one_sided:
        return Separation((tuple(range(cells.n)),), (one_sided,))
    if _held_by_graph(cells, wins):
        return None
    if cells.ordered and not prior and _order_follows_items(cells):
        return Separation(
            tuple((item,) for item in range(cells.n)),
            ("Each pair was only shown in one order, so that order and strength cannot be told apart.",),
        )
    direction = _direction(cells, ties=ties, prior=prior)
    return None if direction is None else _explained(direction, items)


def _one_sided(cells: Cells) -> str | None:
    """Return what all answers have in common that sends a parameter beside the strengths to infinity."""
    if not cells.won.any() and not cells.lost.any():
        return "Every answer is a tie: nothing tells the items apart."
    if cells.ordered and not (cells.won.any() and cells.lost.any()):
        return f"The item shown {'first' if cells.won.any() else 'second'} won every comparison that was decided."
    return None


def _held_by_graph(cells: Cells, wins: Floats) -> bool:
    if not cells.ordered:
        return len(strong_groups(wins)) == 1
    return all(len(strong_groups(_graph_by_place(cells, place))) == 1 for place in ("first", "second"))


def _graph(cells: Cells, chosen: NDArray[np.bool_], *, tied: bool = False) -> Floats:
    n = cells.n
    even = cells.tied if tied else np.zeros_like(cells.tied)
    graph = np.bincount(cells.first * n + cells.second, (cells.won + even) * chosen, n * n)
    graph += np.bincount(cells.second * n + cells.first, (cells.lost + even) * chosen, n * n)
    return np.asarray(graph.reshape(n, n), dtype=np.float64)


def _graph_by_place(cells: Cells, place: str) -> Floats:
    """Return who won against whom when shown ``first`` or ``second``."""
    n, shown_first = cells.n, place == "first"
    winner, loser = (cells.first, cells.second) if shown_first else (cells.second, cells.first)
    counts = np.bincount(winner * n + loser, cells.won if shown_first else cells.lost, n * n)
    return np.asarray(counts.reshape(n, n), dtype=np.float64)


def _order_follows_items(cells: Cells) -> bool:
    """Say whether numbers a exist with a_i − a_j = 1 wherever i was shown before j."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order

    n = cells.n
    both = np.r_[cells.first, cells.second], np.r_[cells.second, cells.first]
    graph = coo_array((np.ones(len(both[0])), both), shape=(n, n)).tocsr()
    order, before = breadth_first_order(graph, 0, directed=False)
    shown_before = set(zip(cells.first.tolist(), cells.second.tolist(), strict=True))
    level = np.zeros(n)
    for item in order[1:].tolist():
        parent = int(before[item])
        level[item] = level[parent] + (1 if (item, parent) in shown_before else -1)
    return bool((level[cells.first] - level[cells.second] == 1).all())


def _direction(cells: Cells, *, ties: bool, prior: bool) -> Floats | None:
    """Return a direction (a, t, δ) along which the likelihood never falls and somewhere rises, or None."""
    from scipy.optimize import linprog
    from scipy.sparse import csr_array

    n = cells.n
    won, lost, tied = cells.won > 0, cells.lost > 0, cells.tied > 0
    kinds = ((won, 1.0, -1.0), (lost, -1.0, -1.0), (tied, 1.0, 1.0), (tied, -1.0, 1.0))
    first = np.concatenate([cells.first[chosen] for chosen, _, _ in kinds])
    second = np.concatenate([cells.second[chosen] for chosen, _, _ in kinds])
    sign = np.concatenate([np.full(int(chosen.sum()), side) for chosen, side, _ in kinds])
    tie = np.concatenate([np.full(int(chosen.sum()), part) for chosen, _, part in kinds])
    rows = np.arange(len(first))
    entries = np.r_[sign, -sign, tie, sign * cells.ordered]
    places = np.r_[rows, rows, rows, rows], np.r_[first, second, np.full(len(rows), n), np.full(len(rows), n + 1)]
    matrix = csr_array((entries, places), shape=(len(rows), n + 2))
    reach = 0.0 if prior else 1.0
    bounds = [(0.0, 0.0), *[(-reach, reach)] * (n - 1), (0.0, float(ties)), (-1.0, 1.0)]
    if not cells.ordered:
        bounds[-1] = (0.0, 0.0)
    constraints: Any = -matrix  # the stubs do not know that they may be sparse
    found = linprog(-matrix.sum(axis=0), constraints, np.zeros(len(rows)), bounds=bounds, method="highs")
    direction = np.asarray(found.x)
    return direction if (matrix @ direction).max() > SLACK else None


def _explained(direction: Floats, items: Sequence[str]) -> Separation:
    n = len(items)
    theta, tie, order = direction[:n], direction[n] > LEVEL, direction[n + 1]
    aside = " and ties grow more likely" if tie else ""
    if order > LEVEL:
        aside += " and the first place gains"
    elif order < -LEVEL:
        aside += " and the second place gains"
    groups = _levels(theta)
    if len(groups) > 1:
        return Separation(groups, _drawing_apart(groups, items, aside))
    return Separation(groups, (f"The answers are fitted ever better without end{aside}.",))


def _levels(theta: Floats) -> Groups:
    order = np.argsort(-theta, kind="stable")
    cuts = np.flatnonzero(-np.diff(theta[order]) > LEVEL) + 1
    return tuple(tuple(sorted(group.tolist())) for group in np.split(order, cuts))


def _drawing_apart(groups: Groups, items: Sequence[str], aside: str) -> tuple[str, ...]:
    above = ", then ".join(_names(group, items) for group in groups[:4])
    rest = ", and so on" if len(groups) > 4 else ""
    return (f"The answers are fitted ever better as the items draw apart{aside}: {above}{rest}, best first.",)


def _never_compared(groups: Groups, items: Sequence[str]) -> tuple[str, ...]:
    largest = max(groups, key=len)
    return tuple(
        f"{_names(group, items)}: never compared with the other items."
        for group in groups
        if group is not largest or all(len(other) == len(group) for other in groups)
    )


def _names(group: Sequence[int], items: Sequence[str], most: int = 6) -> str:
    names = [f"'{items[item]}'" for item in group[:most]]
    return ", ".join(names) + (f" and {len(group) - most} more" if len(group) > most else "")
