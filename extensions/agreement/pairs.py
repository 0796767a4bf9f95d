"""Of the pairs that observers tell apart, how many does a measure put in the right order?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.bootstrap import widened_percentiles
from documents.arrays import Floats
from documents.text import JsonResult
from extensions.agreement.chance import Orders, Statistic, chance_of_agreement
from extensions.agreement.correlations import signs
from extensions.agreement.observed import ObservedGroup

# An interval needs a pair that is told apart in this share of the bootstrap samples.
LEAST_DRAWS = 0.75


@dataclass(frozen=True, slots=True)
class PairAccuracy(JsonResult):
    """The accuracy of a measure on the pairs that observers tell apart.

    Attributes
    ----------
    right, of
        How many pairs the measure puts in the observers' order (half, where it gives both the same value), of how many.
    share
        right / of, 0 to 1; None where observers tell no pair apart.
    low, high
        95 % limits of the share by bootstrap over observers, who also decide again which pairs are told apart; None
        without a bootstrap.
    p
        How likely a measure that has nothing to do with the stimuli puts as many right, one-sided.
    """

    right: float
    of: int
    share: float | None
    low: float | None
    high: float | None
    p: float | None


def pair_accuracy(groups: Sequence[ObservedGroup], values: Sequence[Floats], *, level: float = 0.95) -> PairAccuracy:
    """Count the pairs of all groups that observers tell apart, and those that a measure puts in their order.

    Parameters
    ----------
    groups
        What observers said.
    values
        For each group, shape (n,): the measure, larger for better.
    level
        The coverage of the interval.

    Returns
    -------
    PairAccuracy
        The counts, and the share with its interval.
    """
    predicted = [signs(own) for own in values]
    observed = [_told_apart(group.scores[None], group.differs[None])[0] for group in groups]
    of = sum(int(np.count_nonzero(own)) for own in observed)
    right = float(sum(_right(own[None], guess)[0] for own, guess in zip(observed, predicted, strict=True)))
    if not of:
        return PairAccuracy(right, of, None, None, None, None)
    tests: list[Statistic] = [_in_order(own, value) for own, value in zip(observed, values, strict=True)]
    p = chance_of_agreement([len(value) for value in values], tests)
    low, high = _interval(groups, predicted, level)
    return PairAccuracy(right, of, right / of, low, high, p)


def _told_apart(scores: Floats, differs: NDArray[np.bool_]) -> NDArray[np.int8]:
    """Return the sign of each pair i < j, 0 where it is not told apart. Shapes (B, n), (B, n, n) to (B, pairs)."""
    first, second = np.triu_indices(scores.shape[-1], 1)
    return np.where(differs[:, first, second], signs(scores), np.int8(0))


def _right(observed: NDArray[np.int8], predicted: NDArray[np.int8]) -> Floats:
    """Return how many of the pairs told apart are in the same order, ties by half. Shapes (B, pairs), (pairs,)."""
    agree = observed.astype(np.float64) @ predicted.astype(np.float64)
    return np.asarray((np.count_nonzero(observed, axis=1) + agree) / 2)


def _in_order(observed: NDArray[np.int8], values: Floats) -> Statistic:
    def statistic(orders: Orders) -> Floats:
        return np.asarray(signs(values[orders]) @ observed.astype(np.float64) / 2)

    return statistic


def _interval(
    groups: Sequence[ObservedGroup], predicted: Sequence[NDArray[np.int8]], level: float
) -> tuple[float | None, float | None]:
    drawn = [group.drawn for group in groups]
    whole = [one for one in drawn if one is not None]
    if len(whole) < len(drawn) or not whole:
        return None, None
    count = min(len(one.scores) for one in whole)
    right, of = np.zeros(count), np.zeros(count)
    for one, guess in zip(whole, predicted, strict=True):
        told = _told_apart(one.scores[:count], one.differs[:count])
        right += _right(told, guess)
        of += np.count_nonzero(told, axis=1)
    shares = np.sort(right[of > 0] / of[of > 0])
    if len(shares) < LEAST_DRAWS * count:
        return None, None
    return widened_percentiles(shares, min(group.observers for group in groups), level)
