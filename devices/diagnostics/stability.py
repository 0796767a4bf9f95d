"""Whether readings stay the same over time: repeatability, drift, warm-up.

Repeatability is taken from successive differences, so that a slow drift does not count: their mean square is twice the
variance of a single reading [Neumann1941]. Drift: the thesis measured black and white throughout its run for this
(Section 3.2.1). Warm-up (thesis Section 3.2.1.2, Figure 3.8): luminance approaches its last value as
settled + a · exp(−t / τ), fitted by least squares with τ at most three times the run; the curve counts only where an F
test prefers it to no change at all, at p < 0.001.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.diagnostics.diagnosis import Check, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.drift import estimate_drift
from devices.diagnostics.readings import brightest, by_code, patch_name, untagged
from devices.errors import DeviceError
from devices.measurements import Measurements

REPEATABILITY = Check(
    "repeatability",
    "Repeatability",
    0.5,
    "% of luminance",
    "this project: 0.5 % is ΔE00 0.1 at white, a fifth of what a fitted model may err by on average",
)
_FEWEST_DIFFERENCES = 3
_DARKEST_SHARE = 0.01


def repeatability(measurements: Measurements) -> Diagnosis:
    """Judge the standard deviation of luminance between readings of one code, in % of it, pooled over codes.

    Codes darker than 1 % of the brightest reading are left out; three differences are the least to judge by.
    """
    bright = brightest(measurements)
    squares: list[float] = []
    lines, rows = [], []
    for code, readings in by_code(measurements).items():
        luminance = measurements.XYZ[readings, 1]
        if len(readings) < 2 or luminance.mean() <= _DARKEST_SHARE * bright:
            continue
        relative = 100 * (luminance / luminance.mean() - 1)
        steps = np.diff(relative)
        squares += list(steps**2 / 2)
        name = patch_name(measurements.name[readings[0]])
        lines.append(Line(name, numbers(range(2, len(readings) + 1)), numbers(steps), "ink", "points"))
        words = " ".join(f"{round(255 * part)}" for part in code)
        rows.append((name, words, float(len(readings)), float(np.sqrt(np.mean(steps**2) / 2))))
    if len(squares) < _FEWEST_DIFFERENCES:
        return REPEATABILITY.unjudged("Read a bright patch such as white at least four times in the course of a run.")
    value = float(np.sqrt(np.mean(squares)))
    panel = Panel("", "reading of the patch", "change from the reading before, %", tuple(lines))
    rows.sort(key=lambda row: -float(row[3]))
    table = Table(("patch", "code (0–255)", "readings", "standard deviation, %"), tuple(rows[:12]))
    words = (
        f"Readings of one patch differ with a standard deviation of {value:.2g} %, from {len(squares)} repeats of "
        f"{len(rows)} patch{'' if len(rows) == 1 else 'es'}."
    )
    return REPEATABILITY.judged(value, words, series=(panel,), table=table)


DRIFT = Check(
    "drift",
    "Drift during the run",
    1.0,
    "% of luminance",
    "this project: 1 % is ΔE00 0.2 at white; readings of one colour must not depend on when they were taken",
)
_FEWEST_CODES = 4
_FEWEST_READINGS = 3


def drift(measurements: Measurements) -> Diagnosis:
    """Judge how much luminance changed during the run, in %, by the smooth drift that repeated readings show.

    Where none is seen beyond noise, by one slope for all codes from the first to the last repeated reading. Codes
    darker than 1 % of the brightest are left out. Where no times were kept, the order of the readings counts.
    """
    groups = by_code(measurements)
    if len(groups) < _FEWEST_CODES:
        return DRIFT.unjudged("These readings are no characterisation: fewer than four colours were read.")
    timed = measurements.time_s is not None
    time = measurements.time_s / 60 if measurements.time_s is not None else np.arange(1.0, len(measurements) + 1)
    bright = brightest(measurements)
    ahead, beyond, change = [], [], []
    lines = []
    for readings in groups.values():
        luminance = measurements.XYZ[readings, 1]
        if len(readings) < 2 or luminance.mean() <= _DARKEST_SHARE * bright:
            continue
        when = time[readings]
        relative = 100 * (luminance / luminance.mean() - 1)
        ahead += list(when)
        beyond += list(when - when.mean())
        change += list(relative)
        lines.append(
            Line(patch_name(measurements.name[readings[0]]), numbers(when), numbers(relative), "ink", "points")
        )
    span = float(np.ptp(ahead)) if ahead else 0.0
    if len(ahead) < _FEWEST_READINGS or span <= 0:
        return DRIFT.unjudged("Read white at least three times in the course of a run, the first and last far apart.")
    slope = float(np.dot(beyond, change) / np.dot(beyond, beyond))
    total = slope * span
    middle = (min(ahead) + max(ahead)) / 2
    ends = np.array([min(ahead), max(ahead)])
    trend = Line("trend", numbers(ends), numbers(slope * (ends - middle)), "accent", "line")
    label = "time, min" if timed else "reading"
    panel = Panel("", label, "luminance from its mean, %", (*lines, trend), (-0.5, 0.5))
    over = f"{span:.3g} minutes" if timed else f"{span:.0f} readings (no times were kept)"
    words = f"Repeated patches {'rose' if total > 0 else 'fell'} by {abs(total):.2g} % over {over}."
    found = estimate_drift(measurements)
    if not found.seen:
        return DRIFT.judged(abs(total), words, series=(panel,))
    smooth = np.linspace(found.start, found.end, 200)
    course = 100 * (found.gains(smooth) / found.gains(smooth).mean() - 1)
    curve = Line("trend", numbers(smooth / 60 if timed else smooth + 1), numbers(course), "accent", "line")
    panel = Panel("", label, "luminance from its mean, %", (*lines, curve), (-0.5, 0.5))
    value = found.range_percent if found.light is not None else abs(total)
    words = f"{found.words[0].upper()}{found.words[1:]}. display fit corrects the readings by this."
    return DRIFT.judged(value, words, series=(panel,))


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


def warm_up(measurements: Measurements) -> Diagnosis:
    """Judge when the most often read patch was stable; it has to be before its third last reading.

    Readings over less than five minutes can show that it was not stable, but not that it was.

    Readings named ``...@warm-up`` are judged alone where there are any.
    """
    alone = untagged(measurements, "warm-up")
    measurements = alone if len(alone) else measurements
    if measurements.time_s is None:
        return WARM_UP.unjudged("The readings carry no times (column time_s).")
    groups = by_code(measurements)
    readings = max(groups.values(), key=lambda rows: (len(rows), measurements.XYZ[rows, 1].mean()), default=[])
    if len(readings) < _FEWEST_TIMES or np.ptp(measurements.time_s[readings]) <= 0:
        return WARM_UP.unjudged("Read one patch, such as gray120, at least five times from switching on.")
    order = np.argsort(measurements.time_s[readings], kind="stable")
    time = measurements.time_s[readings][order] - measurements.time_s[readings].min()
    luminance = measurements.XYZ[readings, 1][order]
    fit = settle(time, luminance)
    limit = float(time[-3]) / 60
    name = patch_name(measurements.name[readings[0]])
    smooth = np.linspace(0, time[-1], 200)
    panel = Panel(
        "",
        "time from the first reading, min",
        "luminance, cd/m²",
        (
            Line(name, numbers(time / 60), numbers(luminance), "ink", "points"),
            Line("fit", numbers(smooth / 60), numbers(fit.at(smooth)), "accent", "line"),
        ),
        (fit.settled * (1 - STABLE_SHARE), fit.settled * (1 + STABLE_SHARE)),
    )
    if fit.tau_s is None:
        words = f"No change is seen in {len(time)} readings of {name}."
    else:
        begun = 100 * fit.excess / fit.settled if fit.settled else float("inf")
        words = (
            f"{name} began {abs(begun):.2g} % {'above' if begun > 0 else 'below'} what it settles to "
            f"({fit.settled:.4g} cd/m²), with a time constant of {fit.tau_s / 60:.3g} min, and is within 1 % of it "
            f"from {fit.stable_s / 60:.3g} min on."
        )
    tau = None if fit.tau_s is None else fit.tau_s / 60
    table = Table(
        ("patch", "readings", "time constant, min", "settles to, cd/m²", "stable from, min"),
        ((name, float(len(time)), tau, fit.settled, fit.stable_s / 60),),
    )
    if time[-1] < SHORTEST_S and fit.stable_s / 60 <= limit:
        why = (
            f"It is not known whether the display was warm: {len(time)} readings of {name} "
            f"within {time[-1]:.3g} s, and displays change over minutes. Read one patch for at least "
            f"{SHORTEST_S / 60:g} minutes from switching on "
            "(display measure --set warm-up)."
        )
        return WARM_UP.unjudged(why, series=(panel,), table=table)
    return WARM_UP.judged(fit.stable_s / 60, words, limit=limit, series=(panel,), table=table)
