"""Which pairs to ask about next: those whose answers are expected to be the most informative.

The answers so far leave the strengths θ normal with covariance C (of differences from their mean). An answer about i
and j informs about θ only through d = θ_i − θ_j, of mean μ and variance σ². Its expected information is one of two:

- ``variance``: how far it is expected to bring down the sum of the strengths' variances, the squared error of the scale
  (Bayesian A-optimality [Chaloner1995]): w |C a|² / (1 + w σ²), a = e_i − e_j, w = E[p(d) (1 − p(d))];
- ``entropy``: the mutual information of answer and difference, h(E[p(d)]) − E[h(p(d))] in nats [Lindley1956], which
  [Glickman2005], [Chen2013], [Li2018] and [Mikhailiuk2020] choose by, each in a form of its own.

Here p(d) = 1 / (1 + e^−d), h(p) = −p ln p − (1 − p) ln (1 − p), and expectations are Gauss-Hermite sums as in [Li2018].
Pairs are chosen in batches, so that strengths need not be fitted again after each answer; no stimulus stands twice in a
batch, which spares observers its return. ``benchmarks/active_pairs.py`` measures what each is worth.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal, TypeAlias

import numpy as np

from analysis.scaling import Posterior, updated_posterior
from documents.arrays import Floats
from runner.blocks import Pair, spaced

Gain: TypeAlias = Literal["variance", "entropy"]

NODES = 30
# Gains that differ by less than this share of the largest count as equal and are left to chance: the last digits of a
# fit are not the same on every machine, and a session must be resumed in the same order on any.
RESOLUTION = 1e-7


def entropy_gain(mean: Floats, variance: Floats) -> Floats:
    """Return the mutual information in nats for differences of ``mean`` and ``variance`` (any one shape)."""
    difference, weights = _nodes(mean, variance)
    p = _logistic(difference)
    size = np.abs(difference)
    entropy = np.logaddexp(0.0, -size) + size * _logistic(-size)
    yes, no = (np.clip(q @ weights, 1e-300, 1.0) for q in (p, _logistic(-difference)))
    return np.asarray(np.maximum(-yes * np.log(yes) - no * np.log(no) - entropy @ weights, 0.0))


def variance_gain(posterior: Posterior) -> Floats:
    """Return for each pair, shape (n, n), by how much an answer is expected to bring down the sum of variances."""
    mean, variance = posterior.contrasts()
    difference, weights = _nodes(mean, variance)
    p = _logistic(difference)
    weight = (p * (1.0 - p)) @ weights
    centred = posterior.covariance - posterior.covariance.mean(axis=0)
    centred = centred - centred.mean(axis=1, keepdims=True)
    squared = centred @ centred
    reach = np.diag(squared)[:, None] + np.diag(squared)[None, :] - 2 * squared
    return np.asarray(weight * np.maximum(reach, 0.0) / (1.0 + weight * variance))


def gains(posterior: Posterior, gain: Gain) -> Floats:
    """Return the expected information of an answer about each pair, shape (n, n), in the gain's own unit."""
    return variance_gain(posterior) if gain == "variance" else entropy_gain(*posterior.contrasts())


def best_matching(gain: Floats, most: int, rng: random.Random, barred: Iterable[int] = ()) -> list[Pair]:
    """Return up to ``most`` pairs, no item in two of them, taking the pair of the highest gain left each time.

    Items that are ``barred`` are in none, nor are pairs of a gain below zero.
    """
    first, second = np.triu_indices(len(gain), 1)
    pair_gain = gain[first, second]
    chance = np.array([rng.random() for _ in range(len(first))])
    order = np.lexsort((chance, -np.round(pair_gain / max(float(pair_gain.max()), 1e-300) / RESOLUTION)))
    order = order[pair_gain[order] >= 0]
    taken = set(barred)
    pairs: list[Pair] = []
    for i, j in zip(first[order].tolist(), second[order].tolist(), strict=True):
        if i not in taken and j not in taken:
            taken |= {i, j}
            pairs.append((i, j))
            if len(pairs) == most:
                break
    return pairs


def apart_from(last: Pair | None, pairs: list[Pair], rng: random.Random) -> list[Pair]:
    """Return ``pairs`` in random order, the first of which shares no item with the pair before, if one can."""
    rng.shuffle(pairs)
    free = [index for index, pair in enumerate(pairs) if not set(pair) & set(last or ())]
    if free:
        pairs[0], pairs[free[0]] = pairs[free[0]], pairs[0]
    return pairs


def sided(pairs: Sequence[Pair], balance: list[int], rng: random.Random) -> list[Pair]:
    """Return ``pairs``, in each of which that item is first which was less often, and count that in ``balance``."""
    placed = []
    for i, j in pairs:
        ahead = balance[i] - balance[j]
        first, second = (j, i) if ahead > 0 or (ahead == 0 and rng.random() < 0.5) else (i, j)
        balance[first] += 1
        balance[second] -= 1
        placed.append((first, second))
    return placed


@dataclass(slots=True)
class PairChooser:
    """Chooses pairs of ``count`` items in batches of at most ``batch`` and learns from each answer.

    It begins with a path through all items in random order, so that all are linked. Answers and the state of ``rng``
    decide everything that follows.
    """

    count: int
    batch: int
    rng: random.Random
    gain: Gain = "variance"
    wins: Floats = field(init=False)
    _balance: list[int] = field(init=False)
    _last: Pair | None = field(init=False, default=None)
    _start: list[list[Pair]] = field(init=False)
    _found: Posterior | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self.wins = np.zeros((self.count, self.count))
        self._balance = [0] * self.count
        path = list(range(self.count))
        self.rng.shuffle(path)
        links = list(pairwise(path))
        self._start = [half for half in (links[0::2], links[1::2]) if half]

    def next_batch(self, most: int) -> list[Pair]:
        """Return the next pairs to ask about, as (first, second), at most ``most``."""
        if self._start:
            return self._in_order(self._start.pop(0), most)
        self._found = updated_posterior(self.wins, self._found)
        most = min(most, self.batch)
        # Of three pairs or more, one can come first that shares nothing with the pair before.
        barred = self._last if self._last and most < 3 and self.count > 5 else ()
        pairs = best_matching(gains(self._found, self.gain), most, self.rng, barred)
        return self._in_order(pairs, most)

    def learn(self, first: int, second: int, *, first_share: float) -> None:
        """Take note of an answer: 1 for the first, 0 for the second, a half where neither was preferred."""
        self.wins[first, second] += first_share
        self.wins[second, first] += 1.0 - first_share

    def _in_order(self, pairs: list[Pair], most: int) -> list[Pair]:
        placed = sided(apart_from(self._last, pairs, self.rng)[:most], self._balance, self.rng)
        self._last = placed[-1]
        return placed


@dataclass(slots=True)
class GroupedChooser:
    """Chooses pairs within ``groups`` of items, each by a `PairChooser` of its own, and mixes those of all groups.

    ``wanted`` is how many pairs each group is to have in all. A batch has at most ``batch`` pairs of each group.
    """

    groups: Sequence[Sequence[int]]
    wanted: Sequence[int]
    batch: int
    rng: random.Random
    gain: Gain = "variance"
    _choosers: list[PairChooser] = field(init=False)
    _left: list[int] = field(init=False)
    _place: dict[int, tuple[int, int]] = field(init=False)

    def __post_init__(self) -> None:
        self._choosers = [
            PairChooser(len(items), max(1, min(self.batch, len(items) // 2)), self.rng, self.gain)
            for items in self.groups
        ]
        self._left = list(self.wanted)
        self._place = {
            item: (group, place) for group, items in enumerate(self.groups) for place, item in enumerate(items)
        }

    def next_batch(self, most: int) -> list[Pair]:
        """Return the next pairs to ask about, as (first, second), at most ``most``."""
        pairs: list[Pair] = []
        for group, items in enumerate(self.groups):
            here = min(self._left[group], most - len(pairs))
            if here:
                chosen = self._choosers[group].next_batch(here)
                self._left[group] -= len(chosen)
                pairs += [(items[first], items[second]) for first, second in chosen]
        return spaced(pairs, lambda pair: self._place[pair[0]][0], self.rng)

    def learn(self, first: int, second: int, *, first_share: float) -> None:
        """Take note of an answer, in its group: 1 for the first, 0 for the second, a half where neither was better."""
        group, place = self._place[first]
        self._choosers[group].learn(place, self._place[second][1], first_share=first_share)


def shared_out(trials: int, sizes: Sequence[int]) -> list[int]:
    """Return how many of ``trials`` each group gets: enough to link its items, and of the rest its share by size."""
    least = [size - 1 for size in sizes]
    rest, total = max(0, trials - sum(least)), max(1, sum(sizes))  # no groups where no stimulus has the factor
    ends = [rest * sum(sizes[:end]) // total for end in range(len(sizes) + 1)]
    return [few + end - start for few, (start, end) in zip(least, pairwise(ends), strict=True)]


def _nodes(mean: Floats, variance: Floats) -> tuple[Floats, Floats]:
    """Return differences at the nodes of the quadrature, in a further axis, and the nodes' weights."""
    places, weights = np.polynomial.hermite_e.hermegauss(NODES)
    return mean[..., None] + np.sqrt(variance)[..., None] * places, weights / weights.sum()


def _logistic(x: Floats) -> Floats:
    return np.asarray(0.5 * (1.0 + np.tanh(0.5 * x)))
