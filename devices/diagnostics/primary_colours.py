"""The primaries: whether they are three distinct colours under their own names, and how far their spectra overlap.

Thesis Figures 3.13 and 3.14. Overlap is the area that two primaries' spectra share when each has the area 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.diagnostics.diagnosis import Cell, Check, Colour, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.ramps import CHANNELS, black_or_none, by_code, primaries, xy
from devices.measurements import Measurements

Floats = NDArray[np.float64]

DISTINCT = Check(
    "primaries",
    "Primaries",
    10.0,
    "times that errors grow at worst",
    "this project: the condition of the matrix, columns of equal length; at 10, an error of 0.2 % of a reading stays "
    "below 2 % of a channel (sRGB has 3.2)",
)
OVERLAP = Check(
    "spectral_overlap",
    "Overlap of the primaries' spectra",
    50.0,
    "% of area shared",
    "this project: the thesis judges by eye (Figure 3.14); beyond half, two channels have more in common than apart",
)
_COLOURS: dict[str, Colour] = {"red": "red", "green": "green", "blue": "blue"}


def primary_colours(measurements: Measurements) -> Diagnosis:
    """Judge the condition of the primaries' matrix, above black, and whether red is the reddest, and so on."""
    matrix, why = primaries(measurements)
    if matrix is None:
        return DISTINCT.unjudged(f"Not all primaries are known: {why}.")
    _, remark = black_or_none(measurements)
    lengths = np.linalg.norm(matrix, axis=0)
    dead = [name for name, length, column in zip(CHANNELS, lengths, matrix.T, strict=True) if _dead(column, matrix)]
    if dead:
        return DISTINCT.judged(
            float("inf") if not np.all(lengths > 0) else float(np.linalg.cond(matrix / lengths)),
            f"The channel {' and '.join(dead)} gives no light of its own.{remark}",
            sound=False,
        )
    condition = float(np.linalg.cond(matrix / lengths))
    swapped = _misnamed(matrix)
    corners = xy(matrix.T)
    lines = tuple(
        Line(name, (float(corner[0]),), (float(corner[1]),), _COLOURS[name], "points")
        for name, corner in zip(CHANNELS, corners, strict=True)
    )
    outline = Line("", numbers(corners[:, 0]), numbers(corners[:, 1]), "soft", "outline")
    words = f"Errors of a reading grow at most {condition:.2g} times on the way to light of the channels."
    if swapped:
        words += f" {swapped}: the columns of the file may be mixed up."
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (name, *(f"{value:.4g}" for value in column), *(f"{value:.4f}" for value in corner))
        for name, column, corner in zip(CHANNELS, matrix.T, corners, strict=True)
    )
    return DISTINCT.judged(
        condition,
        words + remark,
        sound=not swapped,
        series=(Panel("CIE 1931", "x", "y", (outline, *lines), equal=True),),
        table=Table(("", "X", "Y", "Z", "x", "y"), rows),
    )


def spectral_overlap(measurements: Measurements) -> Diagnosis:
    """Judge the largest area, in %, that two primaries' spectra above black share."""
    if measurements.spectra is None or measurements.wavelengths_nm is None:
        return OVERLAP.unjudged("The readings are XYZ alone, without spectra.")
    groups = by_code(measurements)
    dark = measurements.spectra[groups[0.0, 0.0, 0.0]].mean(axis=0) if (0.0, 0.0, 0.0) in groups else 0.0
    waves = measurements.wavelengths_nm
    found: dict[str, Floats] = {}
    for channel, name in enumerate(CHANNELS):
        code = tuple(1.0 if place == channel else 0.0 for place in range(3))
        if code not in groups:
            return OVERLAP.unjudged(f"{name} at full drive was not read.")
        spectrum = np.maximum(measurements.spectra[groups[code]].mean(axis=0) - dark, 0.0)
        area = float(np.trapezoid(spectrum, waves))
        if area <= 0:
            return OVERLAP.unjudged(f"The channel {name} gives no light.")
        found[name] = np.asarray(spectrum / area)
    shared = {
        f"{one} and {other}": 100 * float(np.trapezoid(np.minimum(found[one], found[other]), waves))
        for one, other in (("red", "green"), ("green", "blue"), ("red", "blue"))
    }
    most = max(shared, key=lambda pair: shared[pair])
    lines = tuple(Line(name, numbers(waves), numbers(found[name]), _COLOURS[name], "line") for name in CHANNELS)
    low = 0.1 * max(float(spectrum.max()) for spectrum in found.values())
    foot = tuple(
        Line(name, numbers(waves), numbers(np.minimum(found[name], low)), _COLOURS[name], "line") for name in CHANNELS
    )
    panels = (
        Panel("each with area 1", "wavelength, nm", "1/nm", lines),
        Panel("the lowest tenth", "wavelength, nm", "1/nm", foot),
    )
    words = f"The spectra of {most} share most, {shared[most]:.3g} % of their area."
    return OVERLAP.judged(
        shared[most], words, series=panels, table=Table(("pair", "shared area, %"), tuple(shared.items()))
    )


def _dead(column: Floats, matrix: Floats) -> bool:
    return bool(column[1] <= 1e-4 * matrix[1].max() or column.sum() <= 0)


def _misnamed(matrix: Floats) -> str:
    """Return what is wrong with the primaries' names: red has the largest x, green the largest y, blue the least y."""
    corners = xy(matrix.T)
    wrong = []
    for name, found in (
        ("red", int(np.argmax(corners[:, 0]))),
        ("green", int(np.argmax(corners[:, 1]))),
        ("blue", int(np.argmin(corners[:, 1]))),
    ):
        if CHANNELS[found] != name:
            wrong.append(f"{CHANNELS[found]} looks {name}")
    return ", ".join(wrong).capitalize()
