"""Random orders: which pair comes when and who stands first in it, and lists whose neighbours differ.

Every pair comes once per repeat, in an order drawn from the seed in which no stimulus appears in two trials
running where that can be avoided. Each stimulus stands first in half of its trials (one more or less where the
number is odd), because the pairs are oriented by a rotational tournament: item k stands first against the items
that follow it within half a turn of a circle on which the items were placed at random. Where only some
pairs are compared, such as those within scenes, they are oriented along closed walks instead.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
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
    attempts = 1 if len(pairs) <= 6 else _ATTEMPTS
    return _fewest_clashes((_greedy(pairs, rng, before) for _ in range(attempts)), before)


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


def _fewest_clashes(draws: Iterable[list[Pair]], before: Pair | None) -> list[Pair]:
    best: list[Pair] = []
    fewest: int | None = None
    for order in draws:
        clashes = _clashes(order, before)
        if fewest is None or clashes < fewest:
            best, fewest = order, clashes
        if fewest == 0:
            break
    return best


def pair_order(
    count: int,
    repeats: int,
    side_seed: str,
    order_seed: str,
    *,
    flip: bool = False,
    part: Sequence[Pair] | None = None,
) -> list[Pair]:
    """Return the whole list of (first, second) item numbers for one observer, of all pairs or of a ``part`` of them.

    ``side_seed`` fixes who stands first and ``order_seed`` the order; ``flip`` swaps the sides of every pair, so
    that two observers with one side seed balance each other. Repeats alternate sides.
    """
    random_sides = random.Random(side_seed)
    sides = oriented_pairs(count, random_sides) if part is None else balanced(part, random_sides)
    rng = random.Random(order_seed)
    order: list[Pair] = []
    for repeat in range(repeats):
        swap = flip != bool(repeat % 2)
        pairs = [(second, first) if swap else (first, second) for first, second in sides]
        order += spread(pairs, rng, order[-1] if order else None)
    return order


def balanced(pairs: Sequence[Pair], rng: random.Random) -> list[Pair]:
    """Return any ``pairs`` as (first, second), each item first in half of its pairs, one more or less.

    Items with an odd number of pairs are joined to one more item. Every item then has an even number, the pairs fall
    into closed walks (Euler), and each is oriented along its walk, whose direction is drawn.
    """
    count = Counter(item for pair in pairs for item in pair)
    edges = [*pairs, *((_JOINT, item) for item, times in count.items() if times % 2)]
    rng.shuffle(edges)
    at: dict[int, list[int]] = {}
    for number, edge in enumerate(edges):
        for item in edge:
            at.setdefault(item, []).append(number)
    unused = set(range(len(edges)))
    oriented: list[Pair] = []
    for start in at:
        walk, here = [], start
        while at[here]:
            number = at[here].pop()
            if number in unused:
                unused.remove(number)
                there = sum(edges[number]) - here
                walk.append((here, there))
                here = there
        if rng.random() < 0.5:
            walk = [(there, here) for here, there in walk]
        oriented += [pair for pair in walk if _JOINT not in pair]
    return oriented


_JOINT = -1


def grouped_order(
    sets: Mapping[Pair, Hashable], repeats: int, side_seed: str, order_seed: str, *, flip: bool = False
) -> list[Pair]:
    """Return the whole list of (first, second) item numbers for one observer, where not all pairs are compared.

    ``sets`` gives the set that each pair (i < j) belongs to, such as its scene: pairs of one set do not come one after
    the other, and neighbours share no item, where that can be avoided. All else is as `pair_order` has it.
    """
    sides = balanced(list(sets), random.Random(side_seed))
    rng = random.Random(order_seed)
    order: list[Pair] = []
    for repeat in range(repeats):
        swap = flip != bool(repeat % 2)
        pairs = [(second, first) if swap else (first, second) for first, second in sides]
        before = order[-1] if order else None
        draws = (
            spaced(pairs, lambda pair: sets[min(pair), max(pair)], rng, share=_share_item, before=before)
            for _ in range(_ATTEMPTS_OF_SETS)
        )
        order += _fewest_clashes(draws, before)
    return order


_ATTEMPTS_OF_SETS = 50


def _share_item(one: Pair, other: Pair) -> bool:
    return not set(one).isdisjoint(other)


Item = TypeVar("Item")


def spaced(
    items: Sequence[Item],
    group: Callable[[Item], Hashable],
    rng: random.Random,
    *,
    share: Callable[[Item, Item], bool] | None = None,
    before: Item | None = None,
) -> list[Item]:
    """Return ``items`` in a random order with as few neighbours of one group as there can be.

    A group that holds more than half of what is left has to come next; otherwise any but the last may, by its share.
    An item comes that does not ``share`` anything with the item ahead of it, if there is one, of that group or else of
    another. ``before`` is the item ahead of all.
    """
    left: dict[Hashable, list[Item]] = {}
    for item in rng.sample(list(items), len(items)):
        left.setdefault(group(item), []).append(item)
    order: list[Item] = []
    last: Hashable = None if before is None else group(before)
    while left:
        others = [name for name in left if name != last] or list(left)
        total = sum(map(len, left.values()))
        pressing = [name for name in others if 2 * len(left[name]) > total]
        last = pressing[0] if pressing else rng.choices(others, [len(left[name]) for name in others])[0]
        place = len(left[last]) - 1
        ahead = order[-1] if order else before
        if share is not None and ahead is not None:
            apart = (
                (name, index)
                for name in (last, *others)
                for index in reversed(range(len(left[name])))
                if not share(ahead, left[name][index])
            )
            last, place = next(apart, (last, place))
        order.append(left[last].pop(place))
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
