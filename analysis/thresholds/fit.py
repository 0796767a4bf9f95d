"""Threshold and slope from answers: the posterior over a grid of parameters, with intervals of equal tails.

As in [Schutt2016] all parameters are integrated over, which holds its coverage where a maximum of the likelihood sits
at a limit. Priors: the threshold even on the axis over the levels and half of their range beyond; the logarithm of the
slope normal, about a rise from 10 to 90 % over a quarter of the range, with a standard deviation of ln 3; lapse and
(yes/no) guess rate Beta(1, 19) up to 0.2. The grid is refined where the posterior lies until it is fine enough.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.series.observer_means import Estimate, means
from analysis.thresholds.functions import FUNCTIONS, Psychometric

Floats = NDArray[np.float64]
POINTS, RATE_POINTS = 41, 8
_MOST_RATE = 0.2
_RATE_WEIGHT = 18.0  # of Beta(1, 19)
_LOG_SPREAD = float(np.log(3.0))
_SHARE_OF_RANGE = 0.25  # over which the function of the prior's middle rises from 10 to 90 %
_KEPT = 1e-7  # of the posterior: what is cut off before the grid is refined
_REGRIDS = 4


@dataclass(frozen=True, slots=True)
class ThresholdFit:
    """A psychometric function fitted to answers.

    Attributes
    ----------
    function, axis
        Name of the shape; ``log10`` or ``linear``.
    threshold, threshold_interval
        Level where the shape is at its middle (Weibull: 63 %), in the levels' unit: posterior median and limits.
    slope, slope_interval
        Per unit of the axis: posterior median and limits.
    guess, lapse
        Rates: posterior means, or as given.
    level
        Nominal coverage of the intervals.
    levels, right, trials
        The data by level: levels, numbers of right answers and of trials.
    reason
        Why there is no estimate; empty where there is one. Without an estimate all numbers are None.
    """

    function: str
    axis: str
    levels: tuple[float, ...]
    right: tuple[int, ...]
    trials: tuple[int, ...]
    level: float = 0.95
    threshold: float | None = None
    threshold_interval: tuple[float, float] | None = None
    slope: float | None = None
    slope_interval: tuple[float, float] | None = None
    guess: float | None = None
    lapse: float | None = None
    reason: str = ""

    def probability(self, level: float) -> float | None:
        """Return the probability of a right answer to a level, in the levels' unit; None without an estimate."""
        if self.threshold is None or self.slope is None:
            return None
        x, at = np.log10([level, self.threshold]) if self.axis == "log10" else (level, self.threshold)
        shape = FUNCTIONS[self.function]
        return float(shape.probability(x, at, self.slope, self.guess or 0.0, self.lapse or 0.0))

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "function": self.function,
            "axis": self.axis,
            "levels": list(self.levels),
            "right": list(self.right),
            "trials": list(self.trials),
            "level": self.level,
            "threshold": self.threshold,
            "threshold_interval": None if self.threshold_interval is None else list(self.threshold_interval),
            "slope": self.slope,
            "slope_interval": None if self.slope_interval is None else list(self.slope_interval),
            "guess": self.guess,
            "lapse": self.lapse,
            "reason": self.reason,
        }


def axis_of(levels: Sequence[float]) -> str:
    """Return ``log10`` if all levels are above 0, else ``linear``."""
    return "log10" if min(levels) > 0 else "linear"


def fit_threshold(
    levels: Sequence[float],
    right: Sequence[bool],
    *,
    guess: float | None = 0.5,
    function: str = "weibull",
    axis: str | None = None,
    level: float = 0.95,
) -> ThresholdFit:
    """Fit threshold and slope to the answers of one observer.

    Parameters
    ----------
    levels
        Shape (m,): level of each trial, in its unit; higher ones are easier.
    right
        Shape (m,): whether the answer was right, or "yes".
    guess
        The rate of right answers without seeing: 1 / places in a forced choice. None estimates it, for yes/no.
    function
        Name of the shape, of `FUNCTIONS`.
    axis
        ``log10`` or ``linear``; None chooses by `axis_of`.
    level
        Coverage of the intervals, 0 to 1.

    Returns
    -------
    ThresholdFit
        Without numbers, and with a ``reason``, where the answers cannot say what the threshold is: fewer than three
        levels, all right, all wrong, no more right answers than guessing gives, or a threshold outside the levels.

    Raises
    ------
    ValueError
        If the function is unknown, the columns have no or different lengths, or a level is not above 0 on ``log10``.

    Examples
    --------
    >>> levels = [1, 2, 4, 8, 16] * 8
    >>> right = [number % 2 == 0 or level > 4 for number, level in enumerate(levels)]
    >>> fit = fit_threshold(levels, right)
    >>> 3 < fit.threshold < 9
    True
    """
    if function not in FUNCTIONS:
        raise ValueError(f"there is no function '{function}'; name one of {', '.join(FUNCTIONS)}")
    if not len(levels) or len(levels) != len(right):
        raise ValueError(f"{len(levels)} levels do not go with {len(right)} answers; give one for each trial")
    axis = axis or axis_of(levels)
    if axis == "log10" and min(levels) <= 0:
        raise ValueError(f"the level {min(levels):g} has no logarithm; use axis='linear'")
    shown, which = np.unique(np.asarray(levels, np.float64), return_inverse=True)
    trials = np.bincount(which).astype(np.float64)
    hits = np.asarray(np.bincount(which, weights=np.asarray(right, np.float64)), np.float64)
    data = (tuple(shown.tolist()), tuple(hits.astype(int).tolist()), tuple(trials.astype(int).tolist()))
    reason = _hopeless(hits, trials, guess)
    if reason:
        return ThresholdFit(function, axis, *data, level=level, reason=reason)
    x = np.log10(shown) if axis == "log10" else shown
    grid, weights = _posterior(FUNCTIONS[function], x, hits, trials, guess)
    tail = (1.0 - level) / 2
    limits = [np.array([_quantile(grid[n], _marginal(weights, n), q) for q in (tail, 0.5, 1.0 - tail)]) for n in (0, 1)]
    low, middle, high = limits[0].tolist()
    if not x[0] <= middle <= x[-1]:
        reason = f"the threshold lies {'below' if middle < x[0] else 'above'} all levels: show levels there"
        return ThresholdFit(function, axis, *data, level=level, reason=reason)
    back = (lambda value: float(10.0**value)) if axis == "log10" else float
    slope_low, slope, slope_high = np.exp(limits[1]).tolist()
    rates = [float(grid[n] @ _marginal(weights, n)) for n in (2, 3)]
    return ThresholdFit(
        function,
        axis,
        *data,
        level=level,
        threshold=back(middle),
        threshold_interval=(back(low), back(high)),
        slope=slope,
        slope_interval=(slope_low, slope_high),
        guess=rates[0],
        lapse=rates[1],
    )


def mean_threshold(fits: Sequence[ThresholdFit]) -> Estimate:
    """Return the mean threshold of observers, with a 95 % interval by bootstrap over them.

    One fit for each observer; those without an estimate are left out, and the number of observers says so. The mean is
    that of logarithms where the axis is logarithmic. No interval with fewer than two observers.

    Raises
    ------
    ValueError
        If the fits are on different axes.
    """
    there = [fit for fit in fits if fit.threshold is not None]
    if len({fit.axis for fit in there}) > 1:
        raise ValueError("thresholds on log10 and linear axes have no common mean; fit all on one axis")
    values = np.array([[fit.threshold] for fit in there], np.float64).reshape(-1, 1)
    logarithmic = bool(there) and there[0].axis == "log10"
    (mean,) = means(np.log10(values) if logarithmic else values, np.ones_like(values)) if there else (_NOBODY,)
    if not logarithmic:
        return mean
    value, low, high = (None if each is None else float(10.0**each) for each in (mean.value, mean.low, mean.high))
    return replace(mean, value=value, low=low, high=high)


_NOBODY = Estimate(None, None, None, 0, 0)


def _hopeless(hits: Floats, trials: Floats, guess: float | None) -> str:
    if len(trials) < 3:
        return "fewer than three levels were shown: no slope can be estimated"
    if (hits == trials).all():
        return "all answers are right: the threshold lies below the levels"
    if not hits.any():
        return "no answer is right: the threshold lies above the levels"
    if guess is not None and hits.sum() <= guess * trials.sum():
        return "no more answers are right than guessing gives: the threshold lies above the levels"
    rates = hits / trials
    if np.ptp(rates) == 0 or np.cov(np.arange(len(rates)), rates, aweights=trials)[0, 1] <= 0:
        return "answers are not more often right at higher levels: they tell no threshold"
    return ""


def _posterior(
    function: Psychometric, x: Floats, hits: Floats, trials: Floats, guess: float | None
) -> tuple[list[Floats], Floats]:
    """Return the values of threshold, log slope, guess and lapse rate, and the posterior over all combinations."""
    span = float(x[-1] - x[0])
    middle = float(np.log(function.rise / (_SHARE_OF_RANGE * span)))
    rates = (np.arange(RATE_POINTS) + 0.5) * (_MOST_RATE / RATE_POINTS)  # midpoint rule
    guesses = rates if guess is None else np.array([guess])
    ends = [(x[0] - span / 2, x[-1] + span / 2), (middle - 3 * _LOG_SPREAD, middle + 3 * _LOG_SPREAD)]
    for remaining in range(_REGRIDS, -1, -1):
        axes = [*(np.linspace(*each, POINTS) for each in ends), guesses, rates]
        threshold, slope, false, lapse = np.meshgrid(*axes, indexing="ij", sparse=True)
        total = -(((slope - middle) / _LOG_SPREAD) ** 2) / 2 + _RATE_WEIGHT * np.log1p(-lapse)
        if guess is None:
            total = total + _RATE_WEIGHT * np.log1p(-false)
        total = np.broadcast_to(total, [len(each) for each in axes]).copy()
        for place, good, all_ in zip(x, hits, trials, strict=True):
            p = np.clip(function.probability(place, threshold, np.exp(slope), false, lapse), 1e-12, 1.0 - 1e-12)
            total += good * np.log(p) + (all_ - good) * np.log1p(-p)
        weights = np.exp(total - total.max())
        weights /= weights.sum()
        if remaining:
            ends = [_inner(axes[n], _marginal(weights, n)) for n in (0, 1)]
    return axes, weights


def _marginal(weights: Floats, axis: int) -> Floats:
    return np.asarray(weights.sum(axis=tuple(n for n in range(weights.ndim) if n != axis)))


def _inner(values: Floats, weights: Floats) -> tuple[float, float]:
    """Return the ends of what holds the posterior, a point more on each side."""
    held = np.flatnonzero(weights > _KEPT)
    return float(values[max(held[0] - 1, 0)]), float(values[min(held[-1] + 1, len(values) - 1)])


def _quantile(values: Floats, weights: Floats, share: float) -> float:
    """Return where the distribution function, linear between the midpoints of the grid, reaches ``share``."""
    step = float(values[1] - values[0]) if len(values) > 1 else 0.0
    return float(
        np.interp(share, np.concatenate([[0.0], np.cumsum(weights)]), np.append(values, values[-1] + step) - step / 2)
    )
