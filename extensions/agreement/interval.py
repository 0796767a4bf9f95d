"""An interval of a correlation between a measure, which is known, and scores, which observers give with error.

Error of the scores lowers a correlation [Spearman1904]: of a measure that agrees perfectly with all people, that of the
sample lies below 1, and that of a bootstrap sample, which has the error twice, lower still. Percentiles of the
bootstrap then never contain the truth. So the bootstrap's errors are used to invert a test [Carpenter1999]: a true
correlation is in the interval unless the observed one would be among the lowest or the highest 2.5 % of those that it
leads to.

Scores with a given true correlation lie on the half circle that runs from the measure's own order over the observed
scores to the reversed order. Their length is that of the observed scores without the error's share. Errors are those of
the bootstrap over observers, times √(S/(S − 1)), each divided by the root of a χ² with S − 1 degrees of freedom over
them: what Student's law is to the normal one, for S observers. `benchmarks/agreement.py` measures the coverage.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from documents.arrays import Floats
from extensions.agreement.correlations import CorrelationKind, correlation, direction

SEED = 2016
# Halvings of a whole turn: ends are then known to 0.01 degrees.
HALVINGS = 15
# Where the errors seem to be all there is, scores still have this share of their squared length.
LEAST_SHARE = 0.05
TIED = 1e-9


def correlation_interval(
    scores: Floats,
    errors: Floats,
    observers: int,
    values: Floats,
    kind: CorrelationKind = "spearman",
    *,
    level: float = 0.95,
) -> tuple[float, float]:
    """Return the interval of the correlation that all observers of the kind would give, with these stimuli.

    Parameters
    ----------
    scores
        Shape (n,): the scores that the observers gave, larger for better.
    errors
        Shape (R, n): scores of bootstrap samples of the observers, minus ``scores``; finite.
    observers
        How many observers there were, at least 2.
    values
        Shape (n,): the measure, larger for better, not constant; finite for ``pearson``.
    kind
        The correlation.
    level
        The coverage, between 0 and 1.

    Returns
    -------
    tuple of float
        The lower and the upper end, −1 to 1.

    Examples
    --------
    >>> errors = np.random.default_rng(1).normal(0, 0.1, (500, 4))
    >>> low, high = correlation_interval(np.array([1.0, 2.0, 3.0, 4.1]), errors, 20, np.arange(4.0), "pearson")
    >>> low > 0.9, round(high, 3)
    (True, 1.0)
    """
    return mean_interval([Observed(scores, errors, observers)], [values], kind, level=level)


@dataclass(frozen=True, slots=True, eq=False)
class Observed:
    """The scores of one group, shape (n,), their errors in R bootstrap samples, (R, n), and how many observers."""

    scores: Floats
    errors: Floats
    observers: int


def mean_interval(
    groups: Sequence[Observed], values: Sequence[Floats], kind: CorrelationKind = "spearman", *, level: float = 0.95
) -> tuple[float, float]:
    """Return the interval of the mean over groups of the correlation, each group as in `correlation_interval`.

    The same angle is added on the half circle of every group to that at which half of its draws lie above what was
    observed. Draw number r is of the same observers in all groups.
    """
    tail = (1 - level) / 2
    draws = min(len(group.errors) for group in groups)
    circles = [_HalfCircle(group, own, kind, draws) for group, own in zip(groups, values, strict=True)]
    observed = float(np.mean([circle.observed for circle in circles]))

    def may_be(turn: float, *, lower: bool) -> bool:
        drawn = np.mean([circle.drawn(turn) for circle in circles], axis=0)
        as_far = drawn >= observed - TIED if lower else drawn <= observed + TIED
        return float(as_far.mean()) > tail

    ends = [_border(may_be, -np.pi, np.pi, lower=True), _border(may_be, np.pi, -np.pi, lower=False)]
    low, high = (float(np.mean([circle.true(turn) for circle in circles])) for turn in ends)
    return min(low, observed), max(high, observed)


class _MayBe(Protocol):
    def __call__(self, turn: float, /, *, lower: bool) -> bool: ...


def _border(may_be: _MayBe, inside: float, outside: float, *, lower: bool) -> float:
    """Return the turn at which candidates stop being possible, from one that is on; ``outside`` where none does."""
    if may_be(outside, lower=lower):
        return outside
    for _ in range(HALVINGS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if may_be(middle, lower=lower) else (inside, middle)
    return outside


class _HalfCircle:
    """The candidates for one group's true scores, by angles that are turned from the likeliest; and their draws."""

    def __init__(self, group: Observed, values: Floats, kind: CorrelationKind, draws: int) -> None:
        self._values, self._kind = values, kind
        self.observed = float(correlation(group.scores, values, kind))
        self._own = direction(values, kind)
        centred = group.scores - group.scores.mean()
        across = centred - (centred @ self._own) * self._own
        size2, rest = float(centred @ centred), float(np.sqrt(across @ across))
        # Where observers follow the measure exactly, any direction across it will do.
        self._across = _across(self._own) if rest <= TIED * np.sqrt(size2) else across / rest
        freedom = group.observers - 1
        wide = group.errors[:draws] * np.sqrt(group.observers / freedom)
        self._certain = not wide.any()
        self._length = np.sqrt(max(size2 - float((wide**2).sum(axis=1).mean()), LEAST_SHARE * size2))
        stretch = np.random.default_rng(SEED).chisquare(freedom, draws)
        self._errors = wide * np.sqrt(freedom / stretch)[:, None]
        self._likeliest = 0.0
        if not self._certain:
            self._likeliest = _border(self._half_above, 0.0, np.pi, lower=True)

    def true(self, turn: float) -> float:
        """Return the correlation of a candidate."""
        return self.observed if self._certain else float(correlation(self._scores(turn), self._values, self._kind))

    def drawn(self, turn: float) -> Floats:
        """Return the correlations, shape (draws,), that a candidate leads to."""
        if self._certain:
            return np.full(len(self._errors), self.observed)
        return correlation(self._scores(turn) + self._errors, self._values, self._kind)

    def _half_above(self, turn: float, /, *, lower: bool) -> bool:
        return float((self.drawn(turn) >= self.observed - TIED).mean()) > 0.5

    def _scores(self, turn: float) -> Floats:
        angle = float(np.clip(self._likeliest + turn, 0.0, np.pi))
        return np.asarray(self._length * (np.cos(angle) * self._own + np.sin(angle) * self._across))


def _across(own: Floats) -> Floats:
    """Return a vector of mean 0 and length 1 at right angles to ``own``."""
    place = np.arange(len(own), dtype=np.float64)
    other = np.where(place % 2 > 0, -1 - place, 1 + place)
    other = other - other.mean()
    other = other - (other @ own) * own
    return np.asarray(other / np.sqrt(other @ other))
