"""A difference of two pictures and its standard error, by the jackknife over places [Efron1981].

The measure is computed again without each place in both pictures, so that what both have in common cancels in the error
as it does in the difference.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from documents.arrays import Floats


@dataclass(frozen=True, slots=True)
class EyesPair:
    """One measure of both pairs of views: their values, the rendering's minus the photograph's, and its error."""

    photo: float
    rendering: float
    difference: float
    standard_error: float


def jackknife(rows: Floats, measure: Callable[[Floats], float]) -> tuple[float, float]:
    """Return a measure of rows (n, k) and its standard error by leaving out one row at a time."""
    count = len(rows)
    without = np.array([measure(np.delete(rows, number, axis=0)) for number in range(count)])
    with np.errstate(invalid="ignore"):
        error = np.sqrt((count - 1) / count * np.sum((without - without.mean()) ** 2))
    return measure(rows), float(error)


def jackknifed(
    photo: Floats, rendering: Floats, measures: Mapping[str, Callable[[Floats], float]]
) -> dict[str, EyesPair]:
    """Return measures of sums over squares (n, k) of both pairs, those that either has, with their errors."""
    totals = photo.sum(axis=0), rendering.sum(axis=0)
    count = len(photo)
    pairs = {}
    for name, measure in measures.items():
        values = [measure(total) for total in totals]
        if np.isnan(values).all():
            continue  # neither picture has what it measures
        without = np.array(
            [measure(totals[1] - rendering[number]) - measure(totals[0] - photo[number]) for number in range(count)]
        )
        error = float(np.sqrt((count - 1) / count * np.sum((without - without.mean()) ** 2)))
        pairs[name] = EyesPair(values[0], values[1], values[1] - values[0], error)
    return pairs
