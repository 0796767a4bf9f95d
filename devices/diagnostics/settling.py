"""How light settles after switching on: the curve of one place, and whether places settle alike.

Luminance approaches its last value as settled + a · exp(−t / τ) (thesis Section 3.2.1.2, Figure 3.8 [Medina2016]),
fitted by least squares with τ at most three times the run; the curve counts only where an F test prefers it to no
change at all, at p < 0.001. Whether places differ by what a curve for each explains more than one for all, against
noise simulated around the latter.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.errors import DeviceError
from documents.arrays import Floats

STABLE_SHARE = 0.01
FEWEST_TIMES = 5
_LONGEST_RUNS = 3.0
_CERTAIN = 1e-3
_TAUS, _DRAWS = 40, 999
_ROUNDING = 1e-20
_BARELY, _EXCESSES = 1e-3, (-0.95, 1.7)


@dataclass(frozen=True, slots=True)
class Settling:
    """How a light settles: to ``settled`` (the readings' unit), from ``excess`` above it at time 0, with ``tau_s``.

    ``tau_s`` is None and ``excess`` 0 where readings show no change. ``stable_s`` is the time from the first reading
    after which light stays within 1 % of what it settles to.
    """

    settled: float
    excess: float
    tau_s: float | None
    stable_s: float

    def at(self, time_s: ArrayLike) -> Floats:
        """Return the light at times from the first reading, of any shape."""
        time = np.asarray(time_s, dtype=np.float64)
        fall = np.exp(-time / self.tau_s) if self.tau_s is not None else np.zeros_like(time)
        return np.asarray(self.settled + self.excess * fall)


def settle(time_s: ArrayLike, light: ArrayLike) -> Settling:
    """Fit the exponential to ``light`` (n,) at ``time_s`` (n,), n at least 5.

    Raises DeviceError if there are fewer readings, or all at one time.
    """
    time = np.asarray(time_s, dtype=np.float64)
    values = np.asarray(light, dtype=np.float64)
    if len(time) < FEWEST_TIMES or np.ptp(time) <= 0:
        raise DeviceError(f"an exponential needs {FEWEST_TIMES} readings at different times, not {len(time)}")
    from scipy.optimize import minimize_scalar
    from scipy.stats import f as f_distribution

    start = time - time.min()
    scale = float(np.abs(values).max()) or 1.0
    values = values / scale
    mean = float(values.mean())
    nothing = float(((values - mean) ** 2).sum())

    def fitted(log_tau: float) -> tuple[float, Floats]:
        columns = np.column_stack([np.ones_like(start), np.exp(-start / np.exp(log_tau))])
        answer = np.linalg.lstsq(columns, values, rcond=None)[0]
        return float(((values - columns @ answer) ** 2).sum()), np.asarray(answer)

    grid = np.log(np.geomspace(np.min(np.diff(np.unique(start))) / 5, _LONGEST_RUNS * start.max(), 60))
    best = int(np.argmin([fitted(step)[0] for step in grid]))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    log_tau = float(minimize_scalar(lambda step: fitted(step)[0], bounds=(low, high), method="bounded").x)
    if fitted(grid[best])[0] < fitted(log_tau)[0]:
        log_tau = float(grid[best])
    left, answer = fitted(log_tau)
    spare = len(values) - 3
    ratio = (nothing - left) / 2 / max(left / spare, 1e-30)
    if nothing <= 1e-24 or f_distribution.sf(ratio, 2, spare) > _CERTAIN:
        return Settling(scale * mean, 0.0, None, 0.0)
    tau, settled, excess = float(np.exp(log_tau)), float(answer[0]), float(answer[1])
    far = abs(excess) / (STABLE_SHARE * abs(settled)) if settled else np.inf
    stable_s = max(0.0, tau * float(np.log(far))) if far > 0 else 0.0
    return Settling(scale * settled, scale * excess, tau, stable_s)


def place_departures(courses: Mapping[str, tuple[ArrayLike, ArrayLike]], level: float = 0.01) -> dict[str, float]:
    """Return by how much places departed at most from the first during the run, in %, if not all settle alike.

    Parameters
    ----------
    courses
        For each place the times in s and its luminances above 0, both (n,), n at least 5; at least two places.
    level
        How often, at most, places that settle alike may be said to differ.

    Returns
    -------
    dict
        For each further place the largest departure of its light, as a share of what it settles to, from the first's;
        empty where one curve for all explains the readings as well as one for each.
    """
    times = [np.asarray(time, dtype=np.float64) for time, _ in courses.values()]
    logs = [np.log(np.asarray(light, dtype=np.float64)) for _, light in courses.values()]
    start, end = min(float(time.min()) for time in times), max(float(time.max()) for time in times)
    place = np.repeat(np.arange(len(times)), [len(time) for time in times])
    when, log_light = np.concatenate(times) - start, np.concatenate(logs)
    taus = np.geomspace((end - start) / 50, _LONGEST_RUNS * (end - start), _TAUS)
    # The logarithm of settling light is no exponential: its shape is that of the excess that a first fit finds. Time
    # constants near that fit's are tried in steps that noise hides.
    first = _one_curve(log_light[None, :], when, place, taus, 0.0)
    excess = first.excess
    taus = np.sort(np.concatenate([taus, first.tau * np.geomspace(0.7, 1.4, 2 * _TAUS)]))
    rest = _one_curve(log_light[None, :], when, place, taus, excess)
    apart = _curve_each(log_light[None, :], when, place, taus, excess)
    spare = len(log_light) - 3 * len(times)
    if spare < 1 or not apart.least[0] > _ROUNDING * float(np.abs(log_light).max()) ** 2:
        return {}
    # How large the gain of a curve for each place is where one curve holds and there is noise as is left now.
    noise = np.random.default_rng(1).standard_normal((_DRAWS, len(log_light))) * np.sqrt(apart.least[0] / spare)
    drawn = rest.fitted[0] + noise
    one, each = (fit(drawn, when, place, taus, excess).least for fit in (_one_curve, _curve_each))
    p_value = (1 + np.sum(one / each >= rest.least[0] / apart.least[0])) / (1 + _DRAWS)
    if p_value > level:
        return {}
    smooth = np.linspace(start, end, 200)
    shares = []
    for time, (_, light) in zip(times, courses.values(), strict=True):
        fit = settle(time, light)
        shares.append(fit.at(smooth - float(time.min())) / fit.settled)
    departures = [100 * (share / shares[0] - 1) for share in shares[1:]]
    largest = [float(departure[np.argmax(np.abs(departure))]) for departure in departures]
    return dict(zip(list(courses)[1:], largest, strict=True))


@dataclass(frozen=True, slots=True, eq=False)
class _FittedCurves:
    """Sums of squares ``least`` (k,) that the best curves leave of k series, and what they fit, (k, n).

    Of the first series ``excess`` is its light at time 0 above what it settles to, as a share of the latter, and
    ``tau`` the time constant.
    """

    least: Floats
    fitted: Floats
    excess: float = 0.0
    tau: float = 0.0


def _one_curve(logs: Floats, when: Floats, place: NDArray[np.intp], taus: Floats, excess: float) -> _FittedCurves:
    """Fit a level for each place and one curve for all to series (k, n) of logarithms of light.

    The curve is as log(1 + ``excess`` · exp(−t / τ)), of any size; exp(−t / τ) where the excess is next to nothing.
    """
    falls = np.exp(-when / taus[:, None])
    curves = np.log1p(excess * falls) if abs(excess) > _BARELY else falls
    # A level is the mean of its place; of what is left of the series, the best curve takes the most.
    members = (place[:, None] == np.unique(place)).astype(np.float64)
    average = members / members.sum(axis=0)
    rest = logs - (logs @ average) @ members.T
    bent = curves - (curves @ average) @ members.T
    length = np.linalg.norm(bent, axis=1)
    length[length == 0] = np.inf
    bent /= length[:, None]
    best = np.argmax(np.abs(rest @ bent.T), axis=1)
    size = np.einsum("kn,kn->k", rest, bent[best])
    unexplained = rest - size[:, None] * bent[best]
    begins = float(size[0] / length[best[0]])
    excess = float(np.clip(np.expm1(min(begins, 1.0)), *_EXCESSES))
    return _FittedCurves((unexplained**2).sum(axis=1), logs - unexplained, excess, float(taus[best[0]]))


def _curve_each(logs: Floats, when: Floats, place: NDArray[np.intp], taus: Floats, excess: float) -> _FittedCurves:
    """Fit a level and a curve to each place by itself, of the shape that `_one_curve` has."""
    least, fitted = np.zeros(len(logs)), np.zeros_like(logs)
    for one in np.unique(place):
        rows = place == one
        own = _one_curve(logs[:, rows], when[rows], place[rows], taus, excess)
        least += own.least
        fitted[:, rows] = own.fitted
    return _FittedCurves(least, fitted)
