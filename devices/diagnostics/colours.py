"""The primaries and the samples: three distinct colours under their own names, and no sample outside their triangle.

Thesis Figures 3.12 to 3.14. Overlap is the area that two primaries' spectra share when each has the area 1. Light that
adds up cannot leave the triangle of the primaries: a sample outside means channels that shift or interact, stray light,
or readings that were mixed up.
"""

from __future__ import annotations

import numpy as np

from devices.diagnostics.chromaticity_diagrams import diagrams
from devices.diagnostics.diagnosis import Cell, Check, Colour, Diagnosis, PlotAxes, Readout, Trace, numbers
from devices.diagnostics.readings import CHANNELS, FLOOR_SHARE, black_or_none, by_code, means, primaries, uv, xy
from devices.readings import Measurements
from documents.arrays import Floats
from documents.text import counted

DISTINCT = Check(
    "primaries",
    "Primaries",
    10.0,
    "× growth of an error of XYZ in a channel, at worst",
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
        Trace(name, (float(corner[0]),), (float(corner[1]),), _COLOURS[name], "points")
        for name, corner in zip(CHANNELS, corners, strict=True)
    )
    outline = Trace("", numbers(corners[:, 0]), numbers(corners[:, 1]), "soft", "outline")
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
        series=diagrams((outline, *lines)),
        table=Readout(("", "X", "Y", "Z", "x", "y"), rows),
    )


def spectral_overlap(measurements: Measurements) -> Diagnosis:
    """Judge the largest area, in %, that two primaries' spectra above black share."""
    if measurements.spectra is None or measurements.wavelengths_nm is None:
        return OVERLAP.unjudged("The readings are XYZ alone, without spectra.")
    groups = by_code(measurements)
    dark = measurements.spectra[groups[0.0, 0.0, 0.0]].mean(axis=0) if (0.0, 0.0, 0.0) in groups else 0.0
    waves = measurements.wavelengths_nm
    spectra: dict[str, Floats] = {}
    for channel, name in enumerate(CHANNELS):
        code = tuple(1.0 if place == channel else 0.0 for place in range(3))
        if code not in groups:
            return OVERLAP.unjudged(f"{name} at full drive was not read.")
        spectrum = np.maximum(measurements.spectra[groups[code]].mean(axis=0) - dark, 0.0)
        area = float(np.trapezoid(spectrum, waves))
        if area <= 0:
            return OVERLAP.unjudged(f"The channel {name} gives no light.")
        spectra[name] = np.asarray(spectrum / area)
    shared = {
        f"{first} and {second}": 100 * float(np.trapezoid(np.minimum(spectra[first], spectra[second]), waves))
        for first, second in (("red", "green"), ("green", "blue"), ("red", "blue"))
    }
    most = max(shared, key=lambda pair: shared[pair])
    lines = tuple(Trace(name, numbers(waves), numbers(spectra[name]), _COLOURS[name], "line") for name in CHANNELS)
    low = 0.1 * max(float(spectrum.max()) for spectrum in spectra.values())
    foot = tuple(
        Trace(name, numbers(waves), numbers(np.minimum(spectra[name], low)), _COLOURS[name], "line")
        for name in CHANNELS
    )
    panels = (
        PlotAxes("each with area 1", "wavelength, nm", "1/nm", lines),
        PlotAxes("the lowest tenth", "wavelength, nm", "1/nm", foot),
    )
    words = f"The spectra of {most} share most, {shared[most]:.3g} % of their area."
    return OVERLAP.judged(
        shared[most], words, series=panels, table=Readout(("pair", "shared area, %"), tuple(shared.items()))
    )


def _dead(column: Floats, matrix: Floats) -> bool:
    return bool(column[1] <= 1e-4 * matrix[1].max() or column.sum() <= 0)


def _misnamed(matrix: Floats) -> str:
    """Return what is wrong with the primaries' names: red has the largest x, green the largest y, blue the least y."""
    corners = xy(matrix.T)
    wrong = []
    for name, seen in (
        ("red", int(np.argmax(corners[:, 0]))),
        ("green", int(np.argmax(corners[:, 1]))),
        ("blue", int(np.argmin(corners[:, 1]))),
    ):
        if CHANNELS[seen] != name:
            wrong.append(f"{CHANNELS[seen]} looks {name}")
    return ", ".join(wrong).capitalize()


SAMPLES = Check(
    "chromaticities",
    "Chromaticities of all samples",
    0.01,
    "Δu′v′ outside the triangle",
    "as for channel constancy: 0.01, after ISO 12646 [ISO12646] and TCO'03 [TCO03]",
)
_FEWEST = 8


def chromaticities(measurements: Measurements) -> Diagnosis:
    """Judge how far outside the primaries' triangle the worst sample lies, above black, in u′v′; 0 where none does.

    Samples with less than 2 % of the light of their own channels at full drive are not judged. A sample with a
    negative X, Y or Z, black included, fails whatever the distance.
    """
    matrix, why = primaries(measurements)
    dark, remark = black_or_none(measurements)
    if matrix is None:
        return SAMPLES.unjudged(f"The triangle is not known: {why}.")
    codes, light = means(measurements)
    if len(codes) < _FEWEST:
        return SAMPLES.unjudged("Fewer than eight colours were read.")
    above = light - dark
    possible = (codes > 0) @ np.maximum(matrix[1], 0.0)
    bright = (above[:, 1] >= FLOOR_SHARE * possible) & (possible > 0)
    corners = uv(matrix.T)
    if not np.all(np.isfinite(corners)) or abs(_area(corners)) < 1e-6 or not bright.any():
        return SAMPLES.unjudged("The primaries have no triangle: a channel gives no light, or all are alike.")
    distance = outside(uv(above[bright]), corners)
    worst = int(np.argmax(distance))
    below = np.flatnonzero(np.any(light < 0, axis=1))
    samples, white = xy(light), xy(matrix.sum(axis=1) + dark)
    lit = np.all(np.isfinite(samples), axis=1) & np.all(light >= 0, axis=1)
    triangle = xy(matrix.T)
    lines = (
        Trace("primaries", numbers(triangle[:, 0]), numbers(triangle[:, 1]), "ink", "outline"),
        Trace("samples", numbers(samples[lit, 0]), numbers(samples[lit, 1]), "accent", "points"),
        Trace("sum of primaries", (float(white[0]),), (float(white[1]),), "ink", "points"),
    )
    code = " ".join(f"{255 * part:.0f}" for part in codes[bright][worst])
    words = f"Of {int(bright.sum())} samples "
    words += (
        "none lies outside." if distance[worst] <= 0 else f"{code} lies furthest outside, by {distance[worst]:.2g}."
    )
    if len(below):
        words += (
            f" {counted(len(below), 'reading has', 'readings have')} a negative X, Y or Z, such as that of "
            f"{_words(codes[below[0]])}."
        )
    table = Readout(
        ("", "x", "y", "u′", "v′"),
        tuple(
            (name, *(f"{value:.4f}" for value in (*xy(column), *uv(column))))
            for name, column in (
                *zip(("red", "green", "blue"), matrix.T, strict=True),
                ("white (sum)", matrix.sum(axis=1) + dark),
            )
        ),
    )
    panels = diagrams(lines)
    return SAMPLES.judged(float(distance[worst]), words + remark, sound=not len(below), series=panels, table=table)


def outside(points: Floats, corners: Floats) -> Floats:
    """Return how far points (n, 2) lie outside the triangle with ``corners`` (3, 2); 0 inside, infinity for NaN."""
    turn = np.sign(_area(corners))
    inside = np.ones(len(points), dtype=bool)
    nearest = np.full(len(points), np.inf)
    for start, end in ((0, 1), (1, 2), (2, 0)):
        side = corners[end] - corners[start]
        offset = points - corners[start]
        inside &= turn * (side[0] * offset[:, 1] - side[1] * offset[:, 0]) >= 0
        along = np.clip(offset @ side / (side @ side), 0.0, 1.0)
        nearest = np.fmin(nearest, np.linalg.norm(offset - along[:, None] * side, axis=1))
    return np.where(inside, 0.0, nearest)


def _area(corners: Floats) -> float:
    first, second = corners[1] - corners[0], corners[2] - corners[0]
    return float(first[0] * second[1] - first[1] * second[0]) / 2


def _words(code: Floats) -> str:
    return " ".join(f"{255 * part:.0f}" for part in code)
