"""A part of all pairs for each observer: balanced over observers, and linking all stimuli for each of them.

A balanced incomplete design. Observers have places 0, 1, 2, ... by their codes. Each place in turn takes the pairs that
those before it took least often: first as many as link what all pairs link (Kruskal's minimum spanning tree, the weight
of a pair being how often it was taken), then the others. Among equals come pairs of the stimuli that this observer has
least often, and then chance by the seed. Nothing is shared between stations: a place's pairs follow from the seed and
the places before it, which every station computes for itself.
"""

from __future__ import annotations

import hashlib
import random
import re
from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from runner.blocks.orders import Pair

PLACES = 120
"""Designs that differ; the observer after the last has the first again."""
_SITTINGS_APART = 49  # has no factor in common with `PLACES`: 120 sittings have 120 places
_NUMBER_AT_THE_END = re.compile(r"[0-9]+$", re.ASCII)


def place_of(observer: str, sitting: int = 1) -> int:
    """Return an observer's place, from 0 to `PLACES` - 1: by the number that ends the code, else drawn from the code.

    Each further ``sitting`` takes a place of its own, far from those of the next observers.

    Examples
    --------
    >>> place_of("01"), place_of("p12"), place_of("121"), place_of("anna")
    (0, 11, 0, 46)
    >>> place_of("01", 2), place_of("01", 3)
    (49, 98)
    """
    number = _NUMBER_AT_THE_END.search(observer)
    if number is not None:
        first = int(number[0][-18:]) - 1
    else:
        first = int.from_bytes(hashlib.sha256(observer.encode()).digest()[:8])
    return (first + _SITTINGS_APART * (sitting - 1)) % PLACES


def fewest_pairs(count: int, pairs: Sequence[Pair]) -> int:
    """Return how many of ``pairs`` link those of ``count`` stimuli that all of them link."""
    taken = np.zeros(len(pairs), dtype=np.int64)
    return len(list(_tree(np.array(pairs, dtype=np.intp).reshape(-1, 2), taken, np.zeros(count), taken)))


@lru_cache(maxsize=16)
def observers_pairs(count: int, pairs: tuple[Pair, ...], each: int, seed: str, place: int) -> tuple[Pair, ...]:
    """Return the pairs of the observer at a place, in the order of ``pairs``.

    Parameters
    ----------
    count, pairs
        Number of stimuli, and all pairs of them that may be compared.
    each
        Pairs of each observer, from `fewest_pairs` to all.
    seed
        What chance follows.
    place
        The observer's, from `place_of`.
    """
    *_, last = designs(count, pairs, each, seed, place + 1)
    return tuple(pairs[index] for index in last)


def designs(count: int, pairs: Sequence[Pair], each: int, seed: str, places: int) -> Iterator[list[int]]:
    """Yield the sorted indices of the pairs of each place in turn."""
    ends = np.array(pairs, dtype=np.intp).reshape(-1, 2)
    rng = random.Random(seed)
    taken = np.zeros(len(ends), dtype=np.int64)
    for _ in range(places):
        chance = np.array(rng.sample(range(len(ends)), len(ends)), dtype=np.int64)
        own = np.zeros(count)
        chosen = list(_tree(ends, taken, own, chance))
        free = np.ones(len(ends), dtype=np.bool_)
        free[chosen] = False
        while len(chosen) < each:
            index = _least(ends, taken, own, chance, free)
            free[index] = False
            own[ends[index]] += 1
            chosen.append(index)
        taken[chosen] += 1
        yield sorted(chosen)


def _tree(
    ends: NDArray[np.intp], taken: NDArray[np.int64], own: NDArray[np.float64], chance: NDArray[np.int64]
) -> Iterator[int]:
    """Yield the pairs of a spanning tree of each set that ``ends`` link; ``own`` counts each stimulus's."""
    part = np.arange(len(own))
    while (free := part[ends[:, 0]] != part[ends[:, 1]]).any():
        index = _least(ends, taken, own, chance, free)
        first, second = ends[index]
        part[part == part[second]] = part[first]
        own[ends[index]] += 1
        yield index


def _least(
    ends: NDArray[np.intp],
    taken: NDArray[np.int64],
    own: NDArray[np.float64],
    chance: NDArray[np.int64],
    free: NDArray[np.bool_],
) -> int:
    """Return the free pair taken least; among equals, of the stimuli that this observer has least, then by chance."""
    candidates = np.flatnonzero(free)
    for cost in (taken, own[ends].sum(axis=1), chance):
        costs = cost[candidates]
        candidates = candidates[costs == costs.min()]
    return int(candidates[0])
