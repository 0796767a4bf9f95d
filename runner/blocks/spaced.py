"""Random orders in which neighbours differ where that can be avoided."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from typing import TypeVar

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
