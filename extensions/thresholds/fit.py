"""Threshold and slope from answers: the posterior over a grid of parameters, with intervals of equal tails.

As in [Schutt2016] all parameters are integrated over, which holds its coverage where a maximum of the likelihood sits
at a limit. The priors are those of `extensions.thresholds.priors`, rates up to 0.2. The grid is refined where the
posterior lies until it is fine enough.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from analysis.series import Estimated, means
from documents.arrays import Floats
from documents.text import JsonResult, counted
from extensions.thresholds.functions import FUNCTIONS, Psychometric
from extensions.thresholds.priors import BEYOND, LOG_SPREAD, log_slope_prior, middle_log_slope, rate_prior

POINTS, RATE_POINTS = 41, 8
_MOST_RATE = 0.2
_KEPT = 1e-7  # of the posterior: what is cut off before the grid is refined
_REGRIDS = 4
_BELOW_CHANCE = 0.01
Easier = Literal["higher", "lower"]


@dataclass(frozen=True, slots=True)
class ThresholdFit(JsonResult):
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
        Rates: posterior means, or as given; ``guess_interval`` and ``lapse_interval``: limits, None for a given rate.
    level
        Nominal coverage of the intervals.
    levels, right, trials
        The data by level: levels, numbers of right answers and of trials.
    easier
        Which levels are easier, ``higher`` or ``lower`` ones.
    blanks
        Of trials without a signal (yes/no): how many were answered "yes", and how many there were.
    reason
        Why there is no estimate; empty where there is one. Without an estimate all numbers are None.
    warning
        What a level of 0 did to the axis, where nobody asked for a linear one; empty otherwise.
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
    guess_interval: tuple[float, float] | None = None
    lapse_interval: tuple[float, float] | None = None
    easier: Easier = "higher"
    blanks: tuple[int, int] = (0, 0)
    warning: str = ""

    def probability(self, level: float) -> float | None:
        """Return the probability of a right answer to a level, in the levels' unit; None without an estimate."""
        if self.threshold is None or self.slope is None:
            return None
        x, at = np.log10([level, self.threshold]) if self.axis == "log10" else (level, self.threshold)
        sign = 1.0 if self.easier == "higher" else -1.0
        shape = FUNCTIONS[self.function]
        return float(shape.probability(sign * x, sign * at, self.slope, self.guess or 0.0, self.lapse or 0.0))


def axis_of(levels: Sequence[float]) -> str:
    """Return ``log10`` if all levels are above 0, else ``linear``."""
    return "log10" if min(levels) > 0 else "linear"


def axis_warning(levels: Sequence[float], right: Sequence[bool]) -> str:
    """Return what trials at level 0 do to the axis of levels that are otherwise above 0; empty where there are none."""
    blanks = [answer for level, answer in zip(levels, right, strict=True) if level == 0]
    if not blanks or min(levels) < 0 or max(levels) == 0:
        return ""
    given = f"blanks=({sum(map(bool, blanks))}, {len(blanks)})"
    return (
        f"{counted(len(blanks), 'trial', 'trials')} at level 0, which has no logarithm, made the axis linear: "
        "threshold and slope are not those of a logarithmic axis, and may be far from them. Was there no signal at "
        f"level 0? Then take these trials out of the levels, and give them to fit_threshold as {given}. Is 0 a level "
        "like others? Then ask for axis='linear'"
    )


def fit_threshold(
    levels: Sequence[float],
    right: Sequence[bool],
    *,
    guess: float | None = 0.5,
    function: str = "weibull",
    axis: str | None = None,
    level: float = 0.95,
    easier: Easier = "higher",
    blanks: tuple[int, int] = (0, 0),
) -> ThresholdFit:
    """Fit threshold and slope to the answers of one observer.

    Parameters
    ----------
    levels
        Shape (m,): level of each trial, in its unit.
    right
        Shape (m,): whether the answer was right, or "yes".
    guess
        The rate of right answers without seeing: 1 / places in a forced choice. None estimates it, for yes/no.
    function
        Name of the shape, of `FUNCTIONS`.
    axis
        ``log10`` or ``linear``; None chooses by `axis_of`, with a Python warning where a level of 0 makes it linear.
    level
        Coverage of the intervals, 0 to 1.
    easier
        Whether ``higher`` or ``lower`` levels are easier.
    blanks
        Of trials without a signal: how many were answered "yes" (or right), and how many there were. They say how often
        "yes" is a false alarm where ``guess`` is None; where it is given they are noted, and count for nothing.

    Returns
    -------
    ThresholdFit
        Without numbers, and with a ``reason``, where the answers cannot say what the threshold is: fewer than three
        levels, all right, all wrong, no more right answers than guessing gives, a threshold outside the levels, a level
        that is no finite number, or an answer that is neither right nor wrong (1 or 0).

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
    if unclear := _unclear(levels, right):
        return ThresholdFit(function, axis or "linear", (), (), (), level, easier=easier, blanks=blanks, reason=unclear)
    levels, right = [float(each) for each in levels], [bool(each) for each in right]
    warning = "" if axis else axis_warning(levels, right)
    if warning:
        warnings.warn(warning, stacklevel=2)
    axis = axis or axis_of(levels)
    if axis == "log10" and min(levels) <= 0:
        remedy = "use axis='linear', or give trials without a signal as blanks="
        raise ValueError(f"the level {min(levels):g} has no logarithm; {remedy}")
    shown, which = np.unique(np.asarray(levels, np.float64), return_inverse=True)
    trials = np.bincount(which).astype(np.float64)
    hits = np.asarray(np.bincount(which, weights=np.asarray(right, np.float64)), np.float64)
    empty = ThresholdFit(
        function,
        axis,
        tuple(shown.tolist()),
        tuple(hits.astype(int).tolist()),
        tuple(trials.astype(int).tolist()),
        level=level,
        easier=easier,
        blanks=blanks,
        warning=warning,
    )
    sign = 1.0 if easier == "higher" else -1.0
    x = sign * (np.log10(shown) if axis == "log10" else shown)
    if easier == "lower":  # from the hardest to the easiest
        x, hits, trials = x[::-1], hits[::-1], trials[::-1]
    harder, simpler = ("below", "above") if easier == "higher" else ("above", "below")
    reason = _hopeless(hits, trials, guess, harder, simpler)
    if reason:
        return replace(empty, reason=reason)
    grid, weights = _posterior(FUNCTIONS[function], x, hits, trials, guess, blanks)
    tail = (1.0 - level) / 2
    limits = [[_quantile(grid[n], _marginal(weights, n), q) for q in (tail, 0.5, 1.0 - tail)] for n in range(4)]
    low, middle, high = limits[0]
    if not x[0] <= middle <= x[-1]:
        return replace(
            empty, reason=f"the threshold lies {harder if middle < x[0] else simpler} all levels: show levels there"
        )
    ends = sorted(_level(end, sign, axis) for end in (low, high))
    slope_low, slope, slope_high = np.exp(limits[1]).tolist()
    rates = [float(grid[n] @ _marginal(weights, n)) for n in (2, 3)]
    return replace(
        empty,
        threshold=_level(middle, sign, axis),
        threshold_interval=(ends[0], ends[1]),
        slope=slope,
        slope_interval=(slope_low, slope_high),
        guess=rates[0] if guess is None else guess,
        guess_interval=(max(limits[2][0], 0.0), limits[2][2]) if guess is None else None,
        lapse=rates[1],
        lapse_interval=(max(limits[3][0], 0.0), limits[3][2]),
    )


def _unclear(levels: Sequence[object], right: Sequence[object]) -> str:
    """Return which trials have a level that is no finite number, or an answer that is neither 0 nor 1; or nothing."""
    wrong = [
        (trial, f"the level is {level!r}" if not math.isfinite(_number(level)) else f"the answer is {answer!r}")
        for trial, (level, answer) in enumerate(zip(levels, right, strict=True), start=1)
        if not math.isfinite(_number(level)) or _number(answer) not in (0, 1)
    ]
    if not wrong:
        return ""
    (trial, what), more = wrong[0], len(wrong) - 1
    others = f", and {counted(more, 'other', 'others')} likewise" if more else ""
    return (
        f"levels must be numbers and answers 1 or 0: in trial {trial} of {len(levels)} {what}{others}; leave them out"
    )


def _number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def _level(x: float, sign: float, axis: str) -> float:
    """Return the level at ``x`` of the axis, which runs from hard to easy."""
    return float(10.0 ** (sign * x)) if axis == "log10" else sign * x


def mean_threshold(fits: Sequence[ThresholdFit]) -> Estimated:
    """Return the mean threshold of observers, as `mean_parameter` does."""
    return mean_parameter(fits, "threshold")


Parameter = Literal["threshold", "slope", "guess", "lapse"]


def mean_parameter(fits: Sequence[ThresholdFit], name: Parameter) -> Estimated:
    """Return the mean of a parameter over observers, with a 95 % interval by bootstrap over them.

    One fit for each observer; those without an estimate are left out, and the number of observers says so. The mean is
    that of logarithms for slopes, and for thresholds where the axis is logarithmic. No interval with fewer than two
    observers.

    Raises
    ------
    ValueError
        If the fits are on different axes.
    """
    there = [fit for fit in fits if fit.threshold is not None]
    if len({fit.axis for fit in there}) > 1:
        raise ValueError("thresholds on log10 and linear axes have no common mean; fit all on one axis")
    if not there:
        return _NOBODY
    values = np.array([[getattr(fit, name)] for fit in there], np.float64)
    logarithmic = name == "slope" or (name == "threshold" and there[0].axis == "log10")
    (mean,) = means(np.log10(values) if logarithmic else values, np.ones_like(values))
    if not logarithmic:
        return mean
    value, low, high = (None if each is None else float(10.0**each) for each in (mean.value, mean.low, mean.high))
    return replace(mean, value=value, low=low, high=high)


_NOBODY = Estimated(None, None, None, 0, 0)


def _hopeless(hits: Floats, trials: Floats, guess: float | None, harder: str, simpler: str) -> str:
    """Return why answers tell no threshold, levels from hard to easy; ``harder`` is where harder levels would be."""
    if (hits == trials).all():
        return f"all answers are right: the threshold lies {harder} the levels"
    if guess is not None and _below_chance(right := int(hits.sum()), shown := int(trials.sum()), guess):
        return (
            f"below chance: {right} of {shown} answers are right, where guessing gives {guess * shown:.0f}. "
            "Were the keys or the instructions exchanged?"
        )
    if not hits.any():
        return f"no answer is right: the threshold lies {simpler} the levels"
    if len(trials) < 3:
        return "fewer than three levels were shown: no slope can be estimated"
    if guess is not None and hits.sum() <= guess * trials.sum():
        return f"no more answers are right than guessing gives: the threshold lies {simpler} the levels"
    rates = hits / trials
    if np.ptp(rates) == 0 or np.cov(np.arange(len(rates)), rates, aweights=trials)[0, 1] <= 0:
        return "answers are not more often right at easier levels: they tell no threshold"
    return ""


def _below_chance(right: int, shown: int, guess: float) -> bool:
    """Return whether guessing would give so few right answers in less than 1 % of such observers (binomial test)."""
    from scipy.special import bdtr  # only where answers tell no threshold

    return float(bdtr(right, shown, guess)) < _BELOW_CHANCE


def _posterior(
    function: Psychometric, x: Floats, hits: Floats, trials: Floats, guess: float | None, blanks: tuple[int, int]
) -> tuple[list[Floats], Floats]:
    """Return the values of threshold, log slope, guess and lapse rate, and the posterior over all combinations."""
    span = float(x[-1] - x[0])
    middle = middle_log_slope(function, span)
    rates = (np.arange(RATE_POINTS) + 0.5) * (_MOST_RATE / RATE_POINTS)  # midpoint rule
    guesses = rates if guess is None else np.array([guess])
    ends = [(x[0] - BEYOND * span, x[-1] + BEYOND * span), (middle - 3 * LOG_SPREAD, middle + 3 * LOG_SPREAD)]
    for remaining in range(_REGRIDS, -1, -1):
        axes = [*(np.linspace(*each, POINTS) for each in ends), guesses, rates]
        threshold, slope, false, lapse = np.meshgrid(*axes, indexing="ij", sparse=True)
        total = log_slope_prior(slope, middle) + rate_prior(lapse)
        if guess is None:
            yes, blank = blanks
            total = total + rate_prior(false) + yes * np.log(false) + (blank - yes) * np.log1p(-false)
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
