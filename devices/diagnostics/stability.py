"""Whether readings stay the same over time: repeatability and drift; warm-up is in `devices.diagnostics.warm_up`.

Repeatability is taken from successive differences, so that a slow drift does not count: their mean square is twice the
variance of a single reading [Neumann1941]. Drift: the thesis measured black and white throughout its run for this
(Section 3.2.1).
"""

from __future__ import annotations

import numpy as np

from devices.diagnostics.diagnosis import Check, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.drift import estimate_drift
from devices.diagnostics.readings import brightest, by_code, patch_name
from devices.readings import Measurements

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
