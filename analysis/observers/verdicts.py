"""What each observer says of each pair, all answers to it together: one of the two, or neither."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.comparisons import Comparisons

Floats = NDArray[np.float64]
Verdicts = NDArray[np.int8]
Flags = NDArray[np.bool_]


def verdicts(comparisons: Comparisons) -> Iterator[tuple[NDArray[np.intp], Verdicts, Flags]]:
    """Yield for each observer the items met, their verdicts, and which pairs they compared.

    The item that was preferred more often has the verdict: of a pair that was shown several times, the majority's. An
    even split is a tie, and so is a pair whose answers all prefer neither; beside others, an answer that prefers
    neither counts half for each and changes nothing.

    Yields
    ------
    items
        Shape (k,): indices of the items that the observer met, ascending.
    verdict
        Shape (k, k), antisymmetric: 1 where the row's item is preferred over the column's, −1 the other way, 0 for a
        tie or no answer.
    compared
        Shape (k, k), symmetric: whether the observer answered the pair at all.
    """
    tied = comparisons.tied
    for person in range(len(comparisons.observers)):
        mine, mine_tied = comparisons.observer == person, tied.observer == person
        winner, loser, count = comparisons.winner[mine], comparisons.loser[mine], comparisons.count[mine]
        one, other = tied.one[mine_tied], tied.other[mine_tied]
        items, places = np.unique(np.concatenate([winner, loser, one, other]), return_inverse=True)
        size = len(items)
        row, column, tied_row, tied_column = np.split(places, np.cumsum([len(winner), len(loser), len(one)]))
        wins = np.bincount(row * size + column, count, size * size).reshape(size, size)
        compared = wins > 0
        compared[tied_row, tied_column] = True
        yield items, np.sign(wins - wins.T).astype(np.int8), compared | compared.T
