"""Which level to show next, by the answers so far: QUEST+ [Watson2017] and the weighted up-down [Kaernbach1991]."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from documents.arrays import Floats
from extensions.thresholds.functions import FUNCTIONS, Psychometric
from extensions.thresholds.priors import BEYOND, LOG_SPREAD, log_slope_prior, middle_log_slope, rate_prior

_THRESHOLDS, _SLOPES = 61, 9
_RATES, _FEWER_RATES = (0.005, 0.015, 0.03, 0.06), (0.005, 0.02, 0.05)  # fewer where both rates are parameters
_EVEN, _EVEN_IN_SESSIONS = 1e-13, 1e-9  # nats


class LevelChooser(Protocol):
    """What chooses levels."""

    def next_level(self) -> int:
        """Return the index of the level to show next."""
        ...

    def learn(self, level: int, *, right: bool) -> None:
        """Take in an answer to the level with that index."""
        ...

    def after(self, level: int, *, right: bool) -> int:
        """Return the index of the level that would follow that answer, without taking it in."""
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
        The values of each parameter, on the axis, per unit of it, and rates.
    log_prior
        Logarithm of the weight of a combination, from arrays of thresholds, slopes, guesses and lapses; even if None.
    even_nats
        Levels that promise as much to within this are even. More than a processor's rounding comes to, so that a
        session goes the same way on all; `standard` has 1e-9.
    """

    __slots__ = ("_entropy", "_even", "_log_likelihood", "_log_posterior", "_right", "_shape", "grid")

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
        log_prior: Callable[[Floats, Floats, Floats, Floats], ArrayLike] | None = None,
        even_nats: float = _EVEN,
    ) -> None:
        axes = np.meshgrid(thresholds, slopes, guesses, lapses, indexing="ij")
        grid = np.stack([each.ravel() for each in axes], axis=1)
        threshold, slope, guess, lapse = (grid[:, [column]] for column in range(4))
        low = lapse if guess_is_lapse else guess
        self.grid = grid
        self._shape = axes[0].shape
        self._even = even_nats
        self._right = np.clip(
            function.probability(np.asarray(levels, np.float64), threshold, slope, low, lapse), 1e-12, 1.0 - 1e-12
        )
        self._log_likelihood = np.log(self._right), np.log1p(-self._right)
        self._entropy = _entropy(self._right)
        self._log_posterior = np.zeros(len(grid))
        if log_prior is not None:
            self._log_posterior = self._log_posterior + np.asarray(log_prior(*grid.T), np.float64)

    @classmethod
    def standard(
        cls, levels: ArrayLike, *, guess: float | None = 0.5, function: Psychometric = FUNCTIONS["weibull"]
    ) -> QuestPlus:
        """Return the method with the priors of `extensions.thresholds.priors`, for levels that rise from hard to easy.

        ``levels``, shape (k,), are on the axis; ``guess`` is the rate of right answers without seeing, None (yes/no)
        makes it a parameter.
        """
        x = np.asarray(levels, np.float64)
        span = float(x.max() - x.min())
        middle = middle_log_slope(function, span)
        rates = _FEWER_RATES if guess is None else _RATES

        def log_prior(threshold: Floats, slope: Floats, false: Floats, lapse: Floats) -> Floats:
            known = log_slope_prior(np.log(slope), middle) + rate_prior(lapse)
            return np.asarray(known + rate_prior(false) if guess is None else known)

        return cls(
            x,
            thresholds=np.linspace(x.min() - BEYOND * span, x.max() + BEYOND * span, _THRESHOLDS),
            slopes=np.exp(middle + LOG_SPREAD * np.linspace(-2.0, 2.0, _SLOPES)),
            guesses=rates if guess is None else (guess,),
            lapses=rates,
            function=function,
            log_prior=log_prior,
            even_nats=_EVEN_IN_SESSIONS,
        )

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

    @property
    def median(self) -> tuple[float, ...]:
        """The posterior medians of threshold, slope, guess and lapse rate, each by itself; between points of the grid.

        A forced choice says less of what lies below the threshold than of what lies above it: shallow functions with
        low thresholds stay possible, and draw the mean, but hardly the median.
        """
        weights = self.posterior.reshape(self._shape)
        grid = self.grid.reshape(*self._shape, 4)
        middles = []
        for axis in range(4):
            share = weights.sum(axis=tuple(other for other in range(4) if other != axis))
            values = np.moveaxis(grid, axis, 0)[:, 0, 0, 0, axis]
            middles.append(float(np.interp(0.5, np.cumsum(share) - share / 2, values)))
        return tuple(middles)

    def information(self) -> Floats:
        """Return the expected information of an answer to each level in nats, shape (k,)."""
        weights = self.posterior
        return np.asarray(_entropy(weights @ self._right) - weights @ self._entropy)

    def next_level(self) -> int:
        """Return the index of the level to show next."""
        promised = self.information()
        return int(np.flatnonzero(promised >= promised.max() - self._even)[0])

    def learn(self, level: int, *, right: bool) -> None:
        """Take in an answer to the level with that index."""
        self._log_posterior = self._log_posterior + self._log_likelihood[0 if right else 1][:, level]

    def after(self, level: int, *, right: bool) -> int:
        """Return the index of the level that would follow that answer, without taking it in."""
        before = self._log_posterior
        self.learn(level, right=right)
        following = self.next_level()
        self._log_posterior = before
        return following


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
        self.path.append(self.after(level, right=right))

    def after(self, level: int, *, right: bool) -> int:
        """Return the index of the level that would follow that answer, without taking it in."""
        return min(max(level + (-self.down if right else self.up), 0), self.levels - 1)


def simulate(choices: LevelChooser, trials: int, answers_right: Callable[[int], bool]) -> list[tuple[int, bool]]:
    """Return the levels' indices and the answers of ``trials`` trials of an observer."""
    told: list[tuple[int, bool]] = []
    for _ in range(trials):
        level = choices.next_level()
        right = answers_right(level)
        choices.learn(level, right=right)
        told.append((level, right))
    return told
