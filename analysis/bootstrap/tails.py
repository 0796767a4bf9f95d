"""Quantiles of replicates of which some have no value, and which of them an interval ends at."""

from __future__ import annotations

import numpy as np

from documents.arrays import Floats

FARTHEST = 8.0  # standard deviations: beyond any draw, where a level of two or three observers may round to 0 or 1


def lower(values: Floats, level: Floats, without: int) -> Floats:
    """Return the lower end at ``level`` (0 to 1) of each column.

    Parameters
    ----------
    values
        Shape (R, k), sorted along the first axis.
    level
        Shape (k,).
    without
        How many further replicates have no value. They count as lying below all others: where the end falls among
        them it is −∞.

    Returns
    -------
    Shape (k,): between the order statistics at level · (replicates + 1).
    """
    return _order_statistic(values, level * (len(values) + without + 1) - without, without, -np.inf)


def upper(values: Floats, level: Floats, without: int) -> Floats:
    """As `lower`; replicates without a value count as lying above all others, and an end among them is +∞."""
    return _order_statistic(values, level * (len(values) + without + 1), without, np.inf)


def _order_statistic(values: Floats, place: Floats, without: int, beyond: float) -> Floats:
    count, columns = values.shape
    if not count:
        return np.full(columns, beyond)
    within = np.clip(place, 1, count) - 1
    below = np.minimum(within.astype(np.intp), count - 1)
    above = np.minimum(below + 1, count - 1)
    column = np.arange(columns)
    low, high = values[below, column], values[above, column]
    share = within - below
    apart = np.subtract(high, low, out=np.zeros(columns), where=low < high)  # ends may be infinite
    ends = low + np.multiply(share, apart, out=np.zeros(columns), where=share > 0)
    outside = place < 1 if beyond < 0 else place > count
    return np.where(outside & (without > 0), beyond, ends)


def widened(level: float, observers: int) -> float:
    """Return the level that makes up for few observers [Hesterberg2015].

    A percentile interval is too short by √((S − 1)/S), and by the quotient of the normal and Student's quantile. So its
    ends are taken at Φ(√(S/(S − 1)) t), t being Student's quantile of ``level`` with S − 1 degrees of freedom.
    """
    from scipy.special import ndtr, stdtrit

    return float(ndtr(np.sqrt(observers / (observers - 1)) * stdtrit(observers - 1, level)))


def bias_corrected(level: float, below: Floats, acceleration: Floats) -> Floats:
    """Return the levels at which a BCa interval [Efron1987] ends instead of ``level``.

    Parameters
    ----------
    level
        Such as 0.025.
    below
        Shape (k,): share of the replicates below the estimate, above 0 and below 1.
    acceleration
        Shape (k,): how fast the standard error changes with the value, from `acceleration`.

    Returns
    -------
    Shape (k,).
    """
    from scipy.special import ndtr, ndtri

    bias = ndtri(below)
    reach = bias + np.clip(ndtri(level), -FARTHEST, FARTHEST)
    room = 1 - acceleration * reach
    # Where the formula has no room left, the interval runs to the end of the replicates.
    moved = np.divide(reach, room, out=np.full_like(reach, np.inf) * np.sign(reach), where=room > 0)
    return np.asarray(ndtr(bias + moved))


def acceleration(left_out: Floats) -> Floats:
    """Return Σ d³ / (6 (Σ d²)^1.5), d being how much each observer adds. Shapes (S, k) to (k,); 0 where none does."""
    added = left_out.mean(axis=0) - left_out
    spread = (added**2).sum(axis=0) ** 1.5
    ratio: Floats = np.divide((added**3).sum(axis=0), 6 * spread, out=np.zeros(left_out.shape[1]), where=spread > 0)
    return ratio


def widened_percentiles(values: Floats, observers: int, level: float) -> tuple[float, float]:
    """Return the percentile interval of sorted values, shape (R,), at levels widened for few observers."""
    tail = np.array([widened((1 - level) / 2, observers)])
    column = values[:, None]
    return float(lower(column, tail, 0)[0]), float(upper(column, 1 - tail, 0)[0])
