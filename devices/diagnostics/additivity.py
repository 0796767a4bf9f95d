"""Channel independence: whether channels together give the sum of what each gives alone.

Thesis Section 3.2.1.5 and Figure 3.10, for X, Y and Z alike and for every mixture that was read, not greys alone; each
channel's reading holds the display's black, which counts once in a sum.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.diagnostics.diagnosis import Check, Colour, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.ramps import CHANNELS, FLOOR_SHARE, SAME_DIGITS, black_or_none, channel_ramps, means
from devices.measurements import Measurements

Floats = NDArray[np.float64]

CHECK = Check(
    "additivity",
    "Channel independence",
    2.0,
    "% of X, Y or Z",
    "this project: a matrix cannot follow what does not add up; 2 % is ΔE00 0.4 at white and ten times the noise of a "
    "good reading",
)
_FEWEST = 3
_AXES: tuple[tuple[str, Colour], ...] = (("X", "red"), ("Y", "green"), ("Z", "blue"))


def additivity(measurements: Measurements) -> Diagnosis:
    """Judge the largest difference, in % of what was read, between a mixture and the sum of its channels.

    Mixtures are the readings with two or three channels lit, each of which was read alone at that code. Those with
    less than 2 % of the light of the brightest are drawn but not judged.
    """
    dark, remark = black_or_none(measurements)
    alone = {
        (channel, round(float(level), SAME_DIGITS)): light
        for channel, name in enumerate(CHANNELS)
        for level, light in _levels(measurements, name)
    }
    mixtures: list[Floats] = []
    read: list[Floats] = []
    sums: list[Floats] = []
    for code, light in zip(*means(measurements), strict=True):
        parts = [
            alone.get((channel, round(float(code[channel]), SAME_DIGITS))) for channel in range(3) if code[channel] > 0
        ]
        if len(parts) >= 2 and all(part is not None for part in parts):
            mixtures.append(code)
            read.append(light)
            sums.append(np.sum([part for part in parts if part is not None], axis=0) - (len(parts) - 1) * dark)
    if len(mixtures) < _FEWEST:
        return CHECK.unjudged("Read greys or other mixtures at codes at which each channel was read alone.")
    codes, together, apart = np.array(mixtures), np.array(read), np.array(sums)
    bright = np.all(together > FLOOR_SHARE * together.max(axis=0), axis=1)
    grey = np.all(codes == codes[:, :1], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = 100 * (together / apart - 1)
    if not bright.any() or not np.all(np.isfinite(relative[bright])):
        return CHECK.unjudged(f"No mixture has light enough in X, Y and Z to judge by.{remark}")
    judged = np.flatnonzero(bright)
    worst = int(judged[np.argmax(np.abs(relative[judged]).max(axis=1))])
    value = float(np.abs(relative[worst]).max())
    order = np.flatnonzero(grey)[np.argsort(codes[grey, 0])]
    level = 255 * codes[order, 0]
    panels = [
        Panel(
            "greys",
            "code (0–255)",
            "luminance, cd/m²",
            (
                Line("read", numbers(level), numbers(together[order, 1]), "red", "dashed"),
                Line("sum of the channels", numbers(level), numbers(apart[order, 1]), "blue", "line"),
            ),
        )
    ]
    panels.append(
        Panel(
            "every mixture",
            "luminance, cd/m²",
            "read, from the sum, %",
            tuple(
                Line(axis, numbers(together[judged, i]), numbers(relative[judged, i]), colour, "points")
                for i, (axis, colour) in enumerate(_AXES)
            ),
            (-2.0, 2.0),
        )
    )
    ranked = judged[np.argsort(-np.abs(relative[judged]).max(axis=1))][:8]
    rows = tuple(
        (" ".join(f"{255 * part:.0f}" for part in codes[i]), *(f"{value:+.2f}" for value in relative[i]))
        for i in ranked
    )
    words = (
        f"Of {len(judged)} mixtures, {' '.join(f'{255 * part:.0f}' for part in codes[worst])} differs most from the "
        f"sum of its channels, by {value:.2g} %.{remark}"
    )
    table = Table(("code (0–255)", "X, %", "Y, %", "Z, %"), rows)
    return CHECK.judged(value, words, series=tuple(panels), table=table)


def _levels(measurements: Measurements, name: str) -> list[tuple[float, Floats]]:
    found = channel_ramps(measurements)[name]
    return [(float(level), light) for level, light in zip(found.levels, found.XYZ, strict=True)]
