"""Repeatability: how much readings of one patch differ from one to the next.

From successive differences, so that a slow drift, which `drift` judges, does not count: their mean square is twice
the variance of a single reading [Neumann1941].
"""

from __future__ import annotations

import numpy as np

from devices.diagnostics.diagnosis import Check, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.ramps import brightest, by_code
from devices.diagnostics.tags import patch_name
from devices.measurements import Measurements

CHECK = Check(
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
        return CHECK.unjudged("Read a bright patch such as white at least four times in the course of a run.")
    value = float(np.sqrt(np.mean(squares)))
    panel = Panel("", "reading of the patch", "change from the reading before, %", tuple(lines))
    rows.sort(key=lambda row: -float(row[3]))
    table = Table(("patch", "code (0–255)", "readings", "standard deviation, %"), tuple(rows[:12]))
    words = (
        f"Readings of one patch differ with a standard deviation of {value:.2g} %, from {len(squares)} repeats of "
        f"{len(rows)} patch{'' if len(rows) == 1 else 'es'}."
    )
    return CHECK.judged(value, words, series=(panel,), table=table)
