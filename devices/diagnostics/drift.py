"""Drift: whether the display gave the same light at the end of the run as at its start.

The thesis measured black and white throughout its run for this (Section 3.2.1).
"""

from __future__ import annotations

import numpy as np

from devices.diagnostics.diagnosis import Check, Diagnosis, Line, Panel, numbers
from devices.diagnostics.ramps import brightest, by_code
from devices.diagnostics.tags import patch_name
from devices.measurements import Measurements

CHECK = Check(
    "drift",
    "Drift during the run",
    1.0,
    "% of luminance",
    "this project: 1 % is ΔE00 0.2 at white; readings of one colour must not depend on when they were taken",
)
_FEWEST_CODES = 4
_FEWEST_READINGS = 3
_DARKEST_SHARE = 0.01


def drift(measurements: Measurements) -> Diagnosis:
    """Judge the change of luminance from the first to the last repeated reading, in %, by one slope for all codes.

    Codes darker than 1 % of the brightest are left out. Where no times were kept, the order of the readings counts.
    """
    groups = by_code(measurements)
    if len(groups) < _FEWEST_CODES:
        return CHECK.unjudged("These readings are no characterisation: fewer than four colours were read.")
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
        return CHECK.unjudged("Read white at least three times in the course of a run, the first and last far apart.")
    slope = float(np.dot(beyond, change) / np.dot(beyond, beyond))
    total = slope * span
    middle = (min(ahead) + max(ahead)) / 2
    ends = np.array([min(ahead), max(ahead)])
    trend = Line("trend", numbers(ends), numbers(slope * (ends - middle)), "accent", "line")
    label = "time, min" if timed else "reading"
    panel = Panel("", label, "luminance from its mean, %", (*lines, trend), (-0.5, 0.5))
    over = f"{span:.3g} minutes" if timed else f"{span:.0f} readings (no times were kept)"
    words = f"Repeated patches {'rose' if total > 0 else 'fell'} by {abs(total):.2g} % over {over}."
    return CHECK.judged(abs(total), words, series=(panel,))
