"""Discs of several sizes thrown into a circle so that none overlap, as on a pseudoisochromatic plate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def packed(radius: float, sizes: tuple[float, ...], gap: float, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return middles (n, 2) and radii (n,) of discs within a circle of ``radius`` about 0.

    ``sizes`` are the discs' radii, thrown largest first, each into the room that is left; ``gap`` stays free between
    two. The smallest are thrown longest, and fill what is left.
    """
    places, radii = np.empty((0, 2)), np.empty(0)
    for size in sorted(sizes, reverse=True):
        smallest = size == min(sizes)
        room = (radius / (size + gap / 2)) ** 2
        for _ in range(8 if smallest else 2):
            count = int(room * (0.5 if smallest else 0.25)) + 8
            angle, distance = rng.uniform(0, 2 * np.pi, count), (radius - size) * np.sqrt(rng.uniform(0, 1, count))
            thrown = distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
            thrown = thrown[_clear(thrown, places, radii + size + gap)]
            thrown = thrown[_first(thrown, 2 * size + gap)]
            places = np.concatenate([places, thrown])
            radii = np.concatenate([radii, np.full(len(thrown), size)])
    return places, radii


def _clear(thrown: Floats, places: Floats, apart: Floats) -> NDArray[np.bool_]:
    """Return which of ``thrown`` keep their distance from all ``places``."""
    if not len(places):
        return np.ones(len(thrown), dtype=bool)
    return np.asarray((_squares(thrown, places) >= apart**2).all(axis=1))


def _first(thrown: Floats, apart: float) -> NDArray[np.bool_]:
    """Return which of ``thrown`` keep their distance from all that were thrown before them."""
    near = np.triu(_squares(thrown, thrown) < apart**2, k=1)
    return np.asarray(~near.any(axis=0))


def _squares(first: Floats, second: Floats) -> Floats:
    """Return the squares of all distances; a product of matrices would wake every processor for so little."""
    squares = np.subtract.outer(first[:, 0], second[:, 0])
    squares *= squares
    down = np.subtract.outer(first[:, 1], second[:, 1])
    down *= down
    squares += down
    return np.asarray(squares)
