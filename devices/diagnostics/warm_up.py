"""When the light is stable after switching on, at one place of the screen or at several.

Luminance approaches its last value as settled + a · exp(−t / τ) (thesis Section 3.2.1.2, Figure 3.8 [Medina2016]),
fitted by least squares with τ at most three times the run; the curve counts only where an F test prefers it to no
change at all, at p < 0.001. The thesis read three places along the middle of the screen. Each is fitted by itself, and
whether places differ by what a curve for each explains more than one for all, against noise simulated around the
latter: 1 of 100 screens that warm up alike is called different.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.diagnostics.diagnosis import Cell, Check, Colour, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.readings import by_code, patch_name, tagged, untagged
from devices.errors import DeviceError
from devices.measurements import Measurements

Floats = NDArray[np.float64]

STABLE_SHARE = 0.01
WARM_UP = Check(
    "warm_up",
    "Warm-up",
    None,
    "min until stable",
    "thesis Section 3.2.1.2: stable during several measurements, taken as within 1 % of the settled light from the "
    "third last reading on",
)
_FEWEST_TIMES = 5
_LONGEST_RUNS = 3.0
_CERTAIN = 1e-3
# Backlights settle over minutes to an hour (thesis Figure 3.8): what stands still for less time may not have begun to.
SHORTEST_S = 300.0
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
    if len(time) < _FEWEST_TIMES or np.ptp(time) <= 0:
        raise DeviceError(f"an exponential needs {_FEWEST_TIMES} readings at different times, not {len(time)}")
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


@dataclass(frozen=True, slots=True, eq=False)
class _Course:
    """The readings of one patch at one ``place`` (row and column of a grid, None for no place in particular)."""

    name: str
    place: tuple[int, int] | None
    time_s: Floats
    luminance: Floats
    fit: Settling

    @property
    def label(self) -> str:
        """The patch, or the place."""
        return self.name if self.place is None else f"row {self.place[0]}, column {self.place[1]}"

    @property
    def limit_s(self) -> float:
        """When the light must be stable: at the third last reading."""
        return float(self.time_s[-3])


def warm_up(measurements: Measurements) -> Diagnosis:
    """Judge when the most often read patch was stable; it has to be before its third last reading.

    Readings over less than five minutes can show that it was not stable, but not that it was.

    Readings named ``...@warm-up`` are judged alone where there are any; of those at places of the screen
    (``...@warm-up-r2c1``) each place by itself, and whether they differ.
    """
    if measurements.time_s is None:
        return WARM_UP.unjudged("The readings carry no times (column time_s).")
    start = float(measurements.time_s.min()) if len(measurements) else 0.0
    by_place: dict[tuple[int, int], list[int]] = {}
    names: dict[tuple[int, int], str] = {}
    for row, own in tagged(measurements, "warm-up"):
        if own.parts[0]:
            place = int(own.parts[0]), int(own.parts[1])
            by_place.setdefault(place, []).append(row)
            names[place] = own.base
    if by_place:
        placed = [row for rows in by_place.values() for row in rows]
        start = float(measurements.time_s[placed].min())
        enough = {place: rows for place, rows in sorted(by_place.items()) if _suffices(measurements.time_s[rows])}
        if len(enough) < len(by_place):
            lacks = ", ".join(f"row {r}, column {c}" for r, c in by_place if (r, c) not in enough)
            return WARM_UP.unjudged(f"Read every place at least five times; too few readings at {lacks}.")
        return _judged([_course(measurements, rows, names[place], place, start) for place, rows in enough.items()])
    alone = untagged(measurements, "warm-up")
    measurements = alone if len(alone) else measurements
    groups = by_code(measurements)
    readings = max(groups.values(), key=lambda rows: (len(rows), measurements.XYZ[rows, 1].mean()), default=[])
    if measurements.time_s is None or not _suffices(measurements.time_s[readings]):
        return WARM_UP.unjudged("Read one patch, such as gray120, at least five times from switching on.")
    start = float(measurements.time_s[readings].min())
    return _judged([_course(measurements, readings, patch_name(measurements.name[readings[0]]), None, start)])


def _suffices(time_s: Floats) -> bool:
    return len(time_s) >= _FEWEST_TIMES and float(np.ptp(time_s)) > 0


def _course(
    measurements: Measurements, rows: Sequence[int], name: str, place: tuple[int, int] | None, start: float
) -> _Course:
    assert measurements.time_s is not None
    order = np.argsort(measurements.time_s[list(rows)], kind="stable")
    time = measurements.time_s[list(rows)][order] - start
    luminance = measurements.XYZ[list(rows), 1][order]
    # settle counts from its first reading; at other places that is a little later than the run's.
    fit = settle(time, luminance)
    late = float(time.min())
    if late > 0 and fit.tau_s is not None:
        excess = fit.excess * float(np.exp(late / fit.tau_s))
        fit = Settling(fit.settled, excess, fit.tau_s, fit.stable_s + late if fit.stable_s > 0 else 0.0)
    return _Course(name, place, time, luminance, fit)


def _judged(courses: Sequence[_Course]) -> Diagnosis:
    slowest = max(courses, key=lambda course: (course.fit.stable_s > course.limit_s, course.fit.stable_s))
    limit, stable = slowest.limit_s / 60, slowest.fit.stable_s / 60
    longest = max(float(course.time_s[-1]) for course in courses)
    series, table = (_panel(courses),), _table(courses)
    if longest < SHORTEST_S and stable <= limit:
        why = (
            f"It is not known whether the display was warm: {len(slowest.time_s)} readings of {slowest.label} "
            f"within {longest:.3g} s, and displays change over minutes. Read one patch for at least "
            f"{SHORTEST_S / 60:g} minutes from switching on "
            "(display measure --set warm-up)."
        )
        return WARM_UP.unjudged(why, series=series, table=table)
    words = " ".join(_words(course) for course in courses)
    if len(courses) > 1:
        words += f" {_difference(courses)}"
    return WARM_UP.judged(stable, words, limit=limit, series=series, table=table)


def _words(course: _Course) -> str:
    fit = course.fit
    if fit.tau_s is None:
        where = course.name if course.place is None else f"{course.name} at {course.label}"
        return f"No change is seen in {len(course.time_s)} readings of {where}."
    begun = 100 * fit.excess / fit.settled if fit.settled else float("inf")
    begins = course.label if course.place is None else f"{course.label[0].upper()}{course.label[1:]}"
    return (
        f"{begins} began {abs(begun):.2g} % {'above' if begun > 0 else 'below'} what it settles to "
        f"({fit.settled:.4g} cd/m²), with a time constant of {fit.tau_s / 60:.3g} min, and is within 1 % of it "
        f"from {fit.stable_s / 60:.3g} min on."
    )


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
class _Curves:
    """Sums of squares ``least`` (k,) that the best curves leave of k series, and what they fit, (k, n).

    Of the first series ``excess`` is its light at time 0 above what it settles to, as a share of the latter, and
    ``tau`` the time constant.
    """

    least: Floats
    fitted: Floats
    excess: float = 0.0
    tau: float = 0.0


def _one_curve(logs: Floats, when: Floats, place: NDArray[np.intp], taus: Floats, excess: float) -> _Curves:
    """Fit a level for each place and one curve for all to series (k, n) of logarithms of light.

    The curve is as log(1 + ``excess`` · exp(−t / τ)), of any size; exp(−t / τ) where the excess is next to nothing.
    """
    levels = (place[:, None] == np.unique(place)).astype(np.float64)
    least, fitted = np.full(len(logs), np.inf), np.zeros_like(logs)
    begins, best_tau = 0.0, float(taus[0])
    for tau in taus:
        fall = np.exp(-when / tau)
        curve = np.log1p(excess * fall) if abs(excess) > _BARELY else fall
        columns, turned = np.linalg.qr(np.column_stack([levels, curve]))
        made = (logs @ columns) @ columns.T
        left = ((logs - made) ** 2).sum(axis=1)
        better = left < least
        if better[0]:
            best_tau = float(tau)
            begins = float((logs[0] @ columns[:, -1]) / turned[-1, -1])
        least[better], fitted[better] = left[better], made[better]
    return _Curves(least, fitted, float(np.clip(np.expm1(min(begins, 1.0)), *_EXCESSES)), best_tau)


def _curve_each(logs: Floats, when: Floats, place: NDArray[np.intp], taus: Floats, excess: float) -> _Curves:
    """Fit a level and a curve to each place by itself, of the shape that `_one_curve` has."""
    least, fitted = np.zeros(len(logs)), np.zeros_like(logs)
    for one in np.unique(place):
        rows = place == one
        own = _one_curve(logs[:, rows], when[rows], place[rows], taus, excess)
        least += own.least
        fitted[:, rows] = own.fitted
    return _Curves(least, fitted)


def _difference(courses: Sequence[_Course]) -> str:
    """Say whether the places settle differently, against the one nearest to the middle of those that were read."""
    if any(np.any(course.luminance <= 0) for course in courses):
        return "Whether places differ cannot be judged where a reading has no light."
    places = np.array([course.place for course in courses], dtype=np.float64)
    middle = int(np.argmin(np.abs(places - places.mean(axis=0)).sum(axis=1)))
    order = [courses[middle], *(course for course in courses if course is not courses[middle])]
    departures = place_departures({course.label: (course.time_s, course.luminance) for course in order})
    if not departures:
        return "The places do not differ in it."
    named = " and ".join(f"{place} by up to {departure:+.2g} %" for place, departure in departures.items())
    return (
        f"The places differ: from the course of {order[0].label}, as shares of what they settle to, departed {named}. "
        "Measure evenness and gain map when all are stable."
    )


_PLACE_COLOURS: tuple[Colour, ...] = ("ink", "accent", "soft", "grey", "red", "green", "blue")


def _panel(courses: Sequence[_Course]) -> Panel:
    lines = []
    several = len(courses) > 1
    for number, course in enumerate(courses):
        smooth = np.linspace(course.time_s[0], course.time_s[-1], 200)
        # Places are not equally bright: each as a share of what it settles to.
        scale = 100 / course.fit.settled if several and course.fit.settled else 1.0
        colour = _PLACE_COLOURS[number % len(_PLACE_COLOURS)]
        lines.append(
            Line(course.label, numbers(course.time_s / 60), numbers(scale * course.luminance), colour, "points")
        )
        fit = "fit" if not several else f"{course.label}, fit"
        drawn = colour if several else "accent"
        lines.append(Line(fit, numbers(smooth / 60), numbers(scale * course.fit.at(smooth)), drawn, "line"))
    settled = 100.0 if several else courses[0].fit.settled
    levels = (settled * (1 - STABLE_SHARE), settled * (1 + STABLE_SHARE))
    label = "luminance, % of what it settles to" if several else "luminance, cd/m²"
    return Panel("", "time from the first reading, min", label, tuple(lines), levels)


def _table(courses: Sequence[_Course]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for course in courses:
        fit = course.fit
        tau = None if fit.tau_s is None else fit.tau_s / 60
        name = course.label if course.place is None else f"{course.name}, {course.label}"
        rows.append((name, float(len(course.time_s)), tau, fit.settled, fit.stable_s / 60))
    return Table(("patch", "readings", "time constant, min", "settles to, cd/m²", "stable from, min"), tuple(rows))
