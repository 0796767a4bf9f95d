"""Random orders: which pair comes when and who stands first in it, and lists whose neighbours differ.

Every pair comes once per repeat, in an order drawn from the seed in which no stimulus appears in two trials
running where that can be avoided. Each stimulus stands first in half of its trials (one more or less where the
number is odd), because the pairs are oriented by a rotational tournament: item k stands first against the items
that follow it within half a turn of a circle on which the items were placed at random.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from itertools import combinations
from typing import TypeVar

Pair = tuple[int, int]


def oriented_pairs(count: int, rng: random.Random) -> list[Pair]:
    """Return every pair of ``count`` items once, as (first, second), balanced per item."""
    seats = list(range(count))
    rng.shuffle(seats)
    pairs: list[Pair] = []
    for a, b in combinations(range(count), 2):
        step = b - a
        opposite = 2 * step == count
        forwards = (2 * step < count) if not opposite else a % 2 == 0
        first, second = (a, b) if forwards else (b, a)
        pairs.append((seats[first], seats[second]))
    return pairs


_ATTEMPTS = 200


def spread(pairs: list[Pair], rng: random.Random, before: Pair | None = None) -> list[Pair]:
    """Return ``pairs`` in a random order in which neighbours share no item where that can be avoided.

    ``before`` is the pair shown just before them. Greedy orders are drawn until one has no neighbours that share;
    with four items or fewer there is none, and the best of the draws is returned.
    """
    best: list[Pair] = []
    fewest = len(pairs) + 1
    for _ in range(_ATTEMPTS):
        order = _greedy(pairs, rng, before)
        clashes = _clashes(order, before)
        if clashes < fewest:
            best, fewest = order, clashes
        if fewest == 0 or len(pairs) <= 6:
            break
    return best


def _greedy(pairs: list[Pair], rng: random.Random, before: Pair | None) -> list[Pair]:
    left = list(pairs)
    rng.shuffle(left)
    order: list[Pair] = []
    while left:
        last = set(order[-1] if order else before or ())
        chosen = next((pair for pair in left if not last & set(pair)), left[0])
        left.remove(chosen)
        order.append(chosen)
    return order


def _clashes(order: list[Pair], before: Pair | None) -> int:
    earlier = [before, *order[:-1]]
    return sum(bool(set(pair) & set(last)) for pair, last in zip(order, earlier, strict=True) if last)


def pair_order(count: int, repeats: int, side_seed: str, order_seed: str, *, flip: bool = False) -> list[Pair]:
    """Return the whole list of (first, second) item numbers for one observer.

    ``side_seed`` fixes who stands first and ``order_seed`` the order; ``flip`` swaps the sides of every pair, so
    that two observers with one side seed balance each other. Repeats alternate sides.
    """
    sides = oriented_pairs(count, random.Random(side_seed))
    rng = random.Random(order_seed)
    order: list[Pair] = []
    for repeat in range(repeats):
        swap = flip != bool(repeat % 2)
        pairs = [(second, first) if swap else (first, second) for first, second in sides]
        order += spread(pairs, rng, order[-1] if order else None)
    return order


Item = TypeVar("Item")


def spaced(items: Sequence[Item], group: Callable[[Item], str], rng: random.Random) -> list[Item]:
    """Return ``items`` in a random order with as few neighbours of one group as there can be.

    A group that holds more than half of what is left has to come next; otherwise any but the last may, by its share.
    """
    left: dict[str, list[Item]] = {}
    for item in rng.sample(list(items), len(items)):
        left.setdefault(group(item), []).append(item)
    order: list[Item] = []
    last: str | None = None
    while left:
        others = [name for name in left if name != last] or list(left)
        total = sum(map(len, left.values()))
        pressing = [name for name in others if 2 * len(left[name]) > total]
        last = pressing[0] if pressing else rng.choices(others, [len(left[name]) for name in others])[0]
        order.append(left[last].pop())
        if not left[last]:
            del left[last]
    return order


def repeated(items: Sequence[Item], repeats: int, rng: random.Random) -> list[Item]:
    """Return ``items`` in a random order, ``repeats`` times in different ones, no item twice running."""
    order: list[Item] = []
    for _ in range(repeats):
        following = rng.sample(list(items), len(items))
        if order and len(items) > 1 and following[0] == order[-1]:
            other = rng.randrange(1, len(following))
            following[0], following[other] = following[other], following[0]
        order += following
    return order
