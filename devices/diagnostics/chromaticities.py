"""Chromaticities of all samples: whether each lies inside the triangle of the primaries (thesis Figure 3.12).

Light that adds up cannot leave it. A sample outside means channels that shift or interact, stray light, or readings
that were mixed up.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.diagnostics.diagnosis import Check, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.ramps import FLOOR_SHARE, black_or_none, means, primaries, uv, xy
from devices.diagnostics.spectral_locus import locus_line
from devices.measurements import Measurements
from documents.text.counting import counted

Floats = NDArray[np.float64]

CHECK = Check(
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
        return CHECK.unjudged(f"The triangle is not known: {why}.")
    codes, light = means(measurements)
    if len(codes) < _FEWEST:
        return CHECK.unjudged("Fewer than eight colours were read.")
    above = light - dark
    possible = (codes > 0) @ np.maximum(matrix[1], 0.0)
    bright = (above[:, 1] >= FLOOR_SHARE * possible) & (possible > 0)
    corners = uv(matrix.T)
    if not np.all(np.isfinite(corners)) or abs(_area(corners)) < 1e-6 or not bright.any():
        return CHECK.unjudged("The primaries have no triangle: a channel gives no light, or all are alike.")
    distance = outside(uv(above[bright]), corners)
    worst = int(np.argmax(distance))
    below = np.flatnonzero(np.any(light < 0, axis=1))
    samples, white = xy(light), xy(matrix.sum(axis=1) + dark)
    lit = np.all(np.isfinite(samples), axis=1) & np.all(light >= 0, axis=1)
    triangle = xy(matrix.T)
    lines = (
        locus_line(),
        Line("primaries", numbers(triangle[:, 0]), numbers(triangle[:, 1]), "ink", "outline"),
        Line("samples", numbers(samples[lit, 0]), numbers(samples[lit, 1]), "accent", "points"),
        Line("sum of primaries", (float(white[0]),), (float(white[1]),), "ink", "points"),
    )
    panel = Panel("CIE 1931", "x", "y", lines, equal=True)
    code = " ".join(f"{255 * part:.0f}" for part in codes[bright][worst])
    words = f"Of {int(bright.sum())} samples "
    words += (
        "none lies outside." if distance[worst] <= 0 else f"{code} lies furthest outside, by {distance[worst]:.2g}."
    )
    if len(below):
        words += (
            f" {counted(len(below), 'reading holds', 'readings hold')} a negative X, Y or Z, such as that of "
            f"{_words(codes[below[0]])}."
        )
    table = Table(
        ("", "x", "y", "u′", "v′"),
        tuple(
            (name, *(f"{value:.4f}" for value in (*xy(column), *uv(column))))
            for name, column in (
                *zip(("red", "green", "blue"), matrix.T, strict=True),
                ("white (sum)", matrix.sum(axis=1) + dark),
            )
        ),
    )
    return CHECK.judged(float(distance[worst]), words + remark, sound=not len(below), series=(panel,), table=table)


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
