"""Which pairs to ask about next, by the answers of all observers together.

As in `pair_choice`, each batch is the matching of the highest expected information, but that

- a pair that this observer was asked about is left out until all others of its group were asked as often;
- gains within `GRAIN` of each other count as equal, and each observer's own chance decides between them: stations that
  know the same do not all ask the same.

Where the answers of all observers do not link the stimuli yet, an observer begins with a path through them in random
order. Each batch has a random seed of its own, so that nothing but the log is needed to go on after any of them.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from analysis.records import PooledBatch, wins_digest
from analysis.scaling import Posterior, updated_posterior
from documents.arrays import Floats
from extensions.adaptive_pairs.pair_choice import Gain, apart_from, best_matching, gains, sided
from runner.blocks import Pair, spaced
from runner.ports import PooledAnswers

GRAIN = 0.1
"""The share by which gains may differ and still count as equal."""
_DIGITS = 6  # of the posterior in the record
_LEAST_BATCH = 5


def pooled_batch(stimuli: int) -> int:
    """Return how many pairs of ``stimuli`` are chosen at a time where nothing is said.

    A sixth as many as stimuli, but 5 at least where as many do not share one: few enough that what others answer
    meanwhile counts soon (docs/decisions/0088 has the errors of both).
    """
    return max(1, min(stimuli // 2, max(_LEAST_BATCH, stimuli // 6)))


@dataclass(slots=True)
class PooledChooser:
    """Chooses pairs of ``names`` within ``groups`` of their numbers, in batches, by the answers of all observers.

    ``wanted`` is how many pairs each group is to have in all; a batch has at most ``batch`` pairs of each.
    """

    names: tuple[str, ...]
    groups: Sequence[Sequence[int]]
    wanted: Sequence[int]
    batch: int
    seed: str
    gain: Gain = "variance"
    _own: Floats = field(init=False)
    _others: Floats = field(init=False)
    _asked: NDArray[np.int64] = field(init=False)
    _balance: list[int] = field(init=False)
    _last: Pair | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        count = len(self.names)
        self._own, self._others = np.zeros((2, count, count))
        self._asked = np.zeros((count, count), dtype=np.int64)
        self._balance = [0] * count

    def choose(self, pooled: PooledAnswers) -> PooledBatch:
        """Return the next batch, and what is known now; nothing is changed until it is taken by `take`."""
        rng = random.Random(f"{self.seed}/{int(self._asked.sum())}")
        mean, sd = np.zeros((2, len(self.names)))
        pairs: list[Pair] = []
        for items, wanted in zip(self.groups, self.wanted, strict=True):
            place = np.ix_(items, items)
            known = updated_posterior(self._own[place] + pooled.wins[place])
            mean[list(items)], sd[list(items)] = known.theta, np.sqrt(np.diag(known.covariance))
            left = wanted - int(self._asked[place].sum()) // 2
            if left > 0:
                linked = _linked(self._own[place] + pooled.wins[place])
                own = [] if linked else self._path(items)
                own = own or self._best(known, items, min(left, self.batch, max(1, len(items) // 2)), rng)
                pairs += [(items[first], items[second]) for first, second in own[:left]]
        group_of = {item: number for number, items in enumerate(self.groups) for item in items}
        several = len(self.groups) > 1
        pairs = spaced(pairs, lambda pair: group_of[pair[0]], rng) if several else apart_from(self._last, pairs, rng)
        changes = pooled.wins - self._others
        names, wins = self.names, pooled.wins
        return PooledBatch(
            block=0,
            trial=0,
            stimuli=names,
            sessions=dict(pooled.sessions),
            changes=tuple((int(i), int(j), float(changes[i, j])) for i, j in np.argwhere(changes)),
            wins_sha256=wins_digest({(names[i], names[j]): float(wins[i, j]) for i, j in np.argwhere(wins)}),
            mean_nats=tuple(np.round(mean, _DIGITS).tolist()),
            sd_nats=tuple(np.round(sd, _DIGITS).tolist()),
            pairs=tuple(sided(pairs, list(self._balance), rng)),
        )

    def take(self, batch: PooledBatch) -> tuple[Pair, ...]:
        """Take ``batch`` as asked next, whenever it was chosen, and return its pairs of the names' numbers."""
        number = {name: place for place, name in enumerate(self.names)}
        place = [number[name] for name in batch.stimuli]
        for winner, loser, change in batch.changes:
            self._others[place[winner], place[loser]] += change
        pairs = tuple((place[first], place[second]) for first, second in batch.pairs)
        for first, second in pairs:
            self._asked[first, second] += 1
            self._asked[second, first] += 1
            self._balance[first] += 1
            self._balance[second] -= 1
            self._last = first, second
        return pairs

    def learn(self, first: int, second: int, *, first_share: float) -> None:
        """Take note of an answer: 1 for the first, 0 for the second, a half where neither was preferred."""
        self._own[first, second] += first_share
        self._own[second, first] += 1.0 - first_share

    def _path(self, items: Sequence[int]) -> list[Pair]:
        """Return the half of this observer's path through a group that was not asked about yet; none if all was."""
        path = list(range(len(items)))
        random.Random(f"{self.seed}/{items[0]}").shuffle(path)
        links = list(pairwise(path))
        for half in (links[0::2], links[1::2]):
            left = [(first, second) for first, second in half if not self._asked[items[first], items[second]]]
            if left:
                return left
        return []

    def _best(self, known: Posterior, items: Sequence[int], most: int, rng: random.Random) -> list[Pair]:
        asked = self._asked[np.ix_(items, items)]
        free = asked == asked[np.triu_indices(len(items), 1)].min()
        gain = np.where(free, _grained(gains(known, self.gain)), -1.0)
        # Of three pairs or more, one can come first that shares nothing with the pair before.
        last = [place for place, item in enumerate(items) if most < 3 and len(items) > 5 and item in (self._last or ())]
        return best_matching(gain, most, rng, last) or best_matching(gain, most, rng)


def _grained(gain: Floats) -> Floats:
    """Return ``gain`` in steps by the factor 1 − `GRAIN` down from the largest."""
    largest = max(float(gain.max()), 1e-300)
    steps = np.floor(np.log(np.maximum(gain, 1e-30 * largest) / largest) / np.log1p(-GRAIN) + 1e-6)
    return np.asarray(largest * (1 - GRAIN) ** steps)


def _linked(wins: Floats) -> bool:
    """Return whether comparisons link all items."""
    compared = (wins + wins.T) > 0
    reached = np.zeros(len(wins), dtype=np.bool_)
    reached[0], before = True, 0
    while (now := int(reached.sum())) > before:
        reached, before = reached | compared[reached].any(axis=0), now
    return before == len(wins)
