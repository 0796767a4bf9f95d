"""Which level to show next, by the answers so far: QUEST+ [Watson2017] and the weighted up-down [Kaernbach1991]."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.thresholds.functions import FUNCTIONS, Psychometric

Floats = NDArray[np.float64]
_EVEN = 1e-13  # nats: levels that promise as much to within this are even, whatever a processor's rounding


class Choices(Protocol):
    """What chooses levels."""

    def next_level(self) -> int:
        """Return the index of the level to show next."""
        ...

    def learn(self, level: int, *, right: bool) -> None:
        """Take in an answer to the level with that index."""
        ...


class QuestPlus:
    """The level with the least expected entropy of the posterior over a grid of parameters [Watson2017, Eq. 1 to 10].

    The expected entropy after a level is that before it less the information of its answer about the parameters, and
    that is h(p̄) − Σ w h(p) with the entropy h of one answer, the posterior w, and p̄ = Σ w p: two products of a vector
    with a matrix that is made once. Of even levels the first is chosen.

    Parameters
    ----------
    levels
        On the axis, shape (k,).
    thresholds, slopes, guesses, lapses
        The values of each parameter, on the axis, per unit of it, and rates; the prior is even over all combinations.
    """

    __slots__ = ("_entropy", "_log_likelihood", "_log_posterior", "_right", "grid")

    def __init__(
        self,
        levels: ArrayLike,
        *,
        thresholds: ArrayLike,
        slopes: ArrayLike,
        guesses: ArrayLike = (0.5,),
        lapses: ArrayLike = (0.02,),
        function: Psychometric = FUNCTIONS["weibull"],
        guess_is_lapse: bool = False,
    ) -> None:
        axes = np.meshgrid(thresholds, slopes, guesses, lapses, indexing="ij")
        grid = np.stack([each.ravel() for each in axes], axis=1)
        threshold, slope, guess, lapse = (grid[:, [column]] for column in range(4))
        low = lapse if guess_is_lapse else guess
        self.grid = grid
        self._right = np.clip(
            function.probability(np.asarray(levels, np.float64), threshold, slope, low, lapse), 1e-12, 1.0 - 1e-12
        )
        self._log_likelihood = np.log(self._right), np.log1p(-self._right)
        self._entropy = _entropy(self._right)
        self._log_posterior = np.zeros(len(grid))

    @property
    def posterior(self) -> Floats:
        """The probability of each row of ``grid`` (threshold, slope, guess, lapse), shape (m,); sums to 1."""
        weights = np.exp(self._log_posterior - self._log_posterior.max())
        return np.asarray(weights / weights.sum())

    @property
    def mode(self) -> tuple[float, ...]:
        """The most probable threshold, slope, guess and lapse rate."""
        best = np.flatnonzero(self._log_posterior >= self._log_posterior.max() - _EVEN)[0]
        return tuple(self.grid[best].tolist())

    @property
    def mean(self) -> tuple[float, ...]:
        """The posterior mean of threshold, slope, guess and lapse rate."""
        return tuple((self.posterior @ self.grid).tolist())

    def information(self) -> Floats:
        """Return the expected information of an answer to each level in nats, shape (k,)."""
        weights = self.posterior
        return np.asarray(_entropy(weights @ self._right) - weights @ self._entropy)

    def next_level(self) -> int:
        """Return the index of the level to show next."""
        promised = self.information()
        return int(np.flatnonzero(promised >= promised.max() - _EVEN)[0])

    def learn(self, level: int, *, right: bool) -> None:
        """Take in an answer to the level with that index."""
        self._log_posterior = self._log_posterior + self._log_likelihood[0 if right else 1][:, level]


def _entropy(p: Floats) -> Floats:
    return np.asarray(-(p * np.log(p) + (1.0 - p) * np.log1p(-p)))


@dataclass(slots=True)
class Staircase:
    """The weighted up-down method [Kaernbach1991], in whole levels.

    After a right answer the level falls by ``down`` levels, after a wrong one it rises by ``up``: it comes to rest
    where down · p = up · (1 − p), at the share p = up / (up + down) of right answers. ``levels`` is how many there
    are, weakest first; ``start`` is the index of the first.
    """

    levels: int
    start: int
    up: int = 3
    down: int = 1
    path: list[int] = field(init=False)

    def __post_init__(self) -> None:
        if not 0 <= self.start < self.levels or self.up < 1 or self.down < 1:
            raise ValueError(
                f"a staircase of {self.levels} levels cannot start at {self.start} by {self.up}, {self.down}"
            )
        self.path = [self.start]

    @property
    def target(self) -> float:
        """The share of right answers that it converges to."""
        return self.up / (self.up + self.down)

    @property
    def reversals(self) -> list[int]:
        """The levels at which it turned round; answers at an end, where it stays, do not count as turns."""
        moves = [(here, after - here) for here, after in pairwise(self.path) if after != here]
        return [here for (_, before), (here, after) in pairwise(moves) if before * after < 0]

    def next_level(self) -> int:
        """Return the index of the level to show next."""
        return self.path[-1]

    def learn(self, level: int, *, right: bool) -> None:
        """Take in an answer to the level with that index."""
        self.path.append(min(max(level + (-self.down if right else self.up), 0), self.levels - 1))


def simulate(choices: Choices, trials: int, answers_right: Callable[[int], bool]) -> list[tuple[int, bool]]:
    """Return the levels' indices and the answers of ``trials`` trials of an observer."""
    told: list[tuple[int, bool]] = []
    for _ in range(trials):
        level = choices.next_level()
        right = answers_right(level)
        choices.learn(level, right=right)
        told.append((level, right))
    return told
