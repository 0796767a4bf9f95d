"""Comparisons from arrays of who won: of no known order and without ties, each counted once, unless it is said."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons import Comparisons
from analysis.comparisons.comparisons import from_arrays


def answered(
    items: int | tuple[str, ...], winner: NDArray[Any], loser: NDArray[Any], observers: int = 1, **more: Any
) -> Comparisons:
    """Return answers; ``items`` and ``observers`` are names or numbers of them, ``more`` as `from_arrays` has it."""
    names = tuple(map(str, range(items))) if isinstance(items, int) else items
    plain = {
        "observer": np.zeros(len(winner), dtype=np.intp),
        "count": np.ones(len(winner)),
        "winner_was_first": np.full(len(winner), -1, dtype=np.int8),
        "tie": np.zeros(len(winner), dtype=np.bool_),
    }
    return from_arrays(names, tuple(map(str, range(observers))), winner=winner, loser=loser, **{**plain, **more})
