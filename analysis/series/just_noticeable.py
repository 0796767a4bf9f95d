"""The just noticeable step along a series, from the standard deviation of the choices.

Choosing the picture of a series that matches is the method of adjustment in steps: the standard deviation of the
matches is the measure of discrimination [Gescheider1997]. The model: in each choice an observer s has a match at x = m
+ b_s + e on the axis of the series, with b_s ~ N(0, between²) and e ~ N(0, within²), and chooses the nearest picture. A
picture at x_i is chosen when x lies between the midpoints to its neighbours; the first and the last picture also for
all x beyond them. The axis is the natural logarithm of the level if all levels are above 0, so that a step is a ratio,
else the level itself.

The step noticed in 75 % of cases is Φ⁻¹(0.75) · within. The fit maximises the likelihood, with b_s integrated out by
the trapezoid rule; the interval is that of the profile likelihood, by Student's t with observers − 1 degrees of
freedom.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from analysis.scaling.robust_tests import ObserverTest, from_factors
from analysis.series.choices import Choices
from documents.arrays import Floats
from documents.text import JsonResult

PROBABLE_ERROR = 0.6744897501960817
NODES, REACH = 241, 8.0  # of the trapezoid rule over a standard normal distribution, to 8 standard deviations
_WIDEST_REPORTED = 2.0  # in lengths of the series: a larger standard deviation cannot be measured with the series
_NARROWEST, _WIDEST = 1e-3, 1e2  # limits of the standard deviations, in lengths of the series


@dataclass(frozen=True, slots=True)
class StepSize(JsonResult):
    """The just noticeable step from the choices from series of one kind.

    Attributes
    ----------
    axis
        ``log`` or ``linear``.
    match
        Mean match m, on the scale of the levels (exp m if the axis is logarithmic).
    within, between
        Standard deviations on the axis; ``between`` is 0 where no observer chose twice.
    within_interval
        95 % limits; an upper limit of None is unbounded.
    step
        Just noticeable step at 75 %: in units of the axis; as a ``ratio`` of levels (log axis), and as
        ``step_at``, the step up from each level on the scale of the levels.
    step_interval
        95 % limits of ``step``.
    levels, observed, expected
        For each level the number of choices and what the model expects.
    fit_p
        p value of the deviance of ``observed`` from ``expected``; it treats choices as independent, so that it is too
        small rather than too large. None with three levels, where no degree of freedom is left.
    fit_by_observers
        The test of the same with the observer as the unit, to judge by; None as above, and with fewer than five
        observers.
    reason
        Why there is no estimate; empty where there is one.
    """

    kind: str
    axis: str
    choices: int
    observers: int
    levels: tuple[float, ...]
    observed: tuple[int, ...]
    expected: tuple[float, ...] | None = None
    match: float | None = None
    within: float | None = None
    between: float | None = None
    within_interval: tuple[float, float | None] | None = None
    fit_p: float | None = None
    fit_by_observers: ObserverTest | None = None
    reason: str = ""
    json_also: ClassVar = ("step", "step_interval", "ratio", "step_at")

    @property
    def step(self) -> float | None:
        """Just noticeable step at 75 % on the axis."""
        return None if self.within is None else PROBABLE_ERROR * self.within

    @property
    def step_interval(self) -> tuple[float, float | None] | None:
        """95 % limits of ``step``."""
        if self.within_interval is None:
            return None
        low, high = self.within_interval
        return PROBABLE_ERROR * low, None if high is None else PROBABLE_ERROR * high

    @property
    def ratio(self) -> float | None:
        """The factor by which a level must change for the step to be noticed; None on a linear axis."""
        return None if self.step is None or self.axis != "log" else float(np.exp(self.step))

    @property
    def step_at(self) -> tuple[float, ...] | None:
        """The step up from each level, in the level's unit."""
        if self.step is None:
            return None
        return tuple(level * (self.ratio - 1) if self.ratio else self.step for level in self.levels)


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """Choices as intervals on the axis that contain the match.

    ``low`` and ``high``, shape (k,), are the ends of the intervals, infinite at the ends of a series; ``counts``, shape
    (observers, k), is how often each observer's match is in each interval. ``nodes`` and ``log_weights`` integrate over
    a standard normal distribution.
    """

    low: Floats
    high: Floats
    counts: Floats
    nodes: Floats
    log_weights: Floats

    @classmethod
    def of(cls, low: Floats, high: Floats, observer: NDArray[np.intp]) -> Matches:
        """Count choices given as columns, shape (m,), with the observers' indices from 0 without gaps."""
        ends, which = np.unique(np.stack([low, high], axis=1), axis=0, return_inverse=True)
        counts = np.zeros((int(observer.max()) + 1, len(ends)))
        np.add.at(counts, (observer, which.ravel()), 1.0)
        nodes = np.linspace(-REACH, REACH, NODES)
        log_weights = -(nodes**2) / 2
        return cls(ends[:, 0], ends[:, 1], counts, nodes, log_weights - np.log(np.exp(log_weights).sum()))

    @property
    def observers(self) -> int:
        """How many observers there are."""
        return len(self.counts)

    @property
    def repeated(self) -> bool:
        """Whether some observer chose twice."""
        return bool(self.counts.sum() > len(self.counts))

    def log_likelihood(self, match: float, within: float, between: float) -> float:
        """Return the log-likelihood; ``between`` may be 0, its sign does not matter."""
        centre = match + between * self.nodes if between else np.array([match])
        each = log_normal_between((self.low[:, None] - centre) / within, (self.high[:, None] - centre) / within)
        if not between:
            return float((self.counts @ each).sum())
        people = self.counts @ each + self.log_weights
        highest = people.max(axis=1)
        return float((highest + np.log(np.exp(people - highest[:, None]).sum(axis=1))).sum())


def log_normal_between(low: Floats, high: Floats) -> Floats:
    """Return the log probability of a standard normal variable between ``low`` and ``high``, low < high."""
    from scipy.special import log_ndtr

    flip = low + high > 0  # into the lower tail, where logarithms keep their precision
    a, b = np.where(flip, -high, low), np.where(flip, -low, high)
    above = log_ndtr(b)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        gap = np.where(np.isneginf(above), 0.0, log_ndtr(a) - above)
        return np.asarray(np.where(np.isneginf(above), -1e300, above + np.log(-np.expm1(gap))))


def step_size(choices: Choices, kind: str) -> StepSize:
    """Estimate the just noticeable step from the choices from all series of one kind, of all paints."""
    plan = choices.design
    chosen = [choice for choice in choices.choices if plan.series[choice.series].kind == kind]
    levels = plan.levels(kind)
    axis = "log" if plan.along and levels[0] > 0 else "linear"
    place = {level: number for number, level in enumerate(levels)}
    observed = [0] * len(levels)
    ends: list[tuple[float, float]] = []
    at: list[float] = []
    for choice in chosen:
        series = plan.series[choice.series]
        observed[place[series.levels[choice.index]]] += 1
        x = np.log(series.levels) if axis == "log" else np.array(series.levels)
        cuts = np.concatenate([[-np.inf], (x[1:] + x[:-1]) / 2, [np.inf]])
        ends.append((float(cuts[choice.index]), float(cuts[choice.index + 1])))
        at.append(float(x[choice.index]))
    people = {observer: number for number, observer in enumerate(sorted({choice.observer for choice in chosen}))}
    observer = np.array([people[choice.observer] for choice in chosen], dtype=np.intp)
    empty = StepSize(kind, axis, len(chosen), len(people), levels, tuple(observed))
    low, high = np.array([end for end, _ in ends]), np.array([end for _, end in ends])
    matches = Matches.of(low, high, observer)
    span = float(np.log(levels[-1] / levels[0])) if axis == "log" else levels[-1] - levels[0]
    fitted = fit(matches, float(np.mean(at)), span)
    if isinstance(fitted, str):
        return replace(empty, reason=fitted)
    match, within, between = fitted
    total = float(np.hypot(within, between))

    def chances(mean: float, sd: float) -> Floats:
        """Return the chance of each level in each choice, shape (choices, levels)."""
        table = np.zeros((len(chosen), len(levels)))
        for row, choice in zip(table, chosen, strict=True):
            series = plan.series[choice.series]
            x = np.log(series.levels) if axis == "log" else np.array(series.levels)
            cuts = np.concatenate([[-np.inf], (x[1:] + x[:-1]) / 2, [np.inf]])
            own = np.exp(log_normal_between((cuts[:-1] - mean) / sd, (cuts[1:] - mean) / sd))
            row[[place[level] for level in series.levels]] = own
        return table

    by_choice = chances(match, total)
    expected = by_choice.sum(axis=0)
    took = np.zeros_like(by_choice)
    took[np.arange(len(chosen)), [place[plan.series[one.series].levels[one.index]] for one in chosen]] = 1.0
    step = 1e-4 * total
    moved = [chances(match + step, total) - chances(match - step, total)]
    moved.append(chances(match, total + step) - chances(match, total - step))
    slopes = np.stack([each.sum(axis=0) for each in moved], axis=1) / (2 * step)
    return replace(
        empty,
        expected=tuple(expected.tolist()),
        match=float(np.exp(match)) if axis == "log" else match,
        within=within,
        between=between,
        within_interval=interval(matches, fitted, span),
        fit_p=_fit_p(np.array(observed, np.float64), expected),
        fit_by_observers=observer_test(took - by_choice, observer, expected, slopes),
    )


def observer_test(
    residuals: Floats, observer: NDArray[np.intp], expected: Floats, slopes: Floats
) -> ObserverTest | None:
    """Test whether the model fits, with the observer as the unit.

    ``residuals``, shape (choices, levels), are 1 for the chosen level and 0 for the others, less the chances, which
    sum to ``expected``; ``slopes``, shape (levels, 2), are its derivatives by the mean and the standard deviation.
    """
    df = len(expected) - 3
    if df < 1 or not (expected > 0).all():
        return None
    size = np.sqrt(expected)
    taken = np.linalg.qr(np.column_stack([size, slopes / size[:, None]]))[0]
    each = np.zeros((int(observer.max()) + 1, len(expected)))
    np.add.at(each, observer, residuals / size)
    each -= each @ taken @ taken.T
    return from_factors(df, (each, None))


def _fit_p(observed: Floats, expected: Floats) -> float | None:
    from scipy.special import chdtrc, xlogy

    df = len(observed) - 3
    if df < 1:
        return None
    deviance = 2 * float(xlogy(observed, np.divide(observed, expected, where=expected > 0, out=observed + 0)).sum())
    return float(chdtrc(df, max(0.0, deviance)))


def fit(matches: Matches, start: float, length: float) -> tuple[float, float, float] | str:
    """Return match, within and between at the maximum of the likelihood, or why there is none.

    ``start`` is a first guess of the match, ``length`` that of the series on the axis.
    """
    if len(matches.low) < 3:
        return (
            "fewer than three different pictures were chosen: the standard deviation of the choices cannot be estimated"
        )
    if matches.repeated and ((matches.counts > 0).sum(axis=1) == 1).all():
        return "each observer always chose the same position: the step is finer than the series"
    best = _highest(matches, start, length, None)
    match, within, between = best[1]
    between = between if between > 1e-4 * length else 0.0
    if within <= 1.01 * _NARROWEST * length:
        return "the choices vary less than the pictures of the series: the step is finer than the series"
    if within > _WIDEST_REPORTED * length:
        return "the choices vary over more than the series, or are at both ends: no standard deviation can be estimated"
    return match, within, between


def interval(matches: Matches, fitted: tuple[float, float, float], length: float) -> tuple[float, float | None] | None:
    """Return the 95 % limits of ``within`` where the profile likelihood falls by half of Student's t squared."""
    from scipy.optimize import brentq
    from scipy.special import stdtrit

    people = matches.observers
    if people < 2:
        return None
    allowed = float(stdtrit(people - 1, 0.975)) ** 2 / 2
    match, within, _ = fitted
    highest = matches.log_likelihood(*fitted)

    def short(log_within: float) -> float:
        return highest - allowed - _highest(matches, match, length, float(np.exp(log_within)))[0]

    middle, reach = float(np.log(within)), float(np.log(2))
    limits: list[float | None] = []
    for direction, bound in ((-1, np.log(_NARROWEST * length)), (1, np.log(_WIDEST * length))):
        inner, outer = middle, middle + direction * reach
        while (outer - bound) * direction < 0 and short(outer) < 0:
            inner, outer = outer, outer + direction * reach
        if (outer - bound) * direction >= 0:
            limits.append(None)
            continue
        limits.append(float(np.exp(brentq(short, min(inner, outer), max(inner, outer), xtol=1e-3))))
    return limits[0] or 0.0, limits[1]


def _highest(
    matches: Matches, start: float, length: float, within: float | None
) -> tuple[float, tuple[float, float, float]]:
    """Return the maximum of the log-likelihood and where it is; ``within`` is free if None."""
    from scipy.optimize import minimize

    low, high = float(np.log(_NARROWEST)), float(np.log(_WIDEST))

    def unpack(x: Floats) -> tuple[float, float, float]:
        """Return match, within and between from numbers in lengths of the series."""
        spread = float(np.exp(x[1])) * length if within is None else within
        return start + float(x[0]) * length, spread, float(x[-1]) * length if matches.repeated else 0.0

    def badness(x: Any, *_: Any, **__: Any) -> float:
        return -matches.log_likelihood(*unpack(x))

    best = -np.inf, (start, length, 0.0)
    for width in (0.3, 1.0) if within is None else (0.3,):
        spread = [float(np.log(width))] if within is None else []
        x: Any = np.array([0.0, *spread, *([width / 2] * matches.repeated)])
        limits: Any = [(-1e3, 1e3), *([(low, high)] * len(spread)), *([(0.0, 30.0)] * matches.repeated)]
        options: Any = {
            "initial_simplex": np.vstack([x, x + 0.25 * np.eye(len(x))]),
            "xatol": 1e-5,
            "fatol": 1e-8,
            "maxiter": 2000,
        }
        # Two or three parameters: gradients are not worth it.
        solution = minimize(badness, x, method="Nelder-Mead", bounds=limits, options=options)
        if -solution.fun > best[0]:
            best = float(-solution.fun), unpack(solution.x)
    return best
