"""Gamut: the triangle of the primaries in u′v′, its area, and how it differs from that of another characterisation.

Thesis Figures 3.1, 3.3 and 3.4: several monitors, several settings, with and without glasses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.diagnostics.diagnosis import Cell, Check, Colour, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.readings import black_or_none, primaries, uv, xy
from devices.measurements import Measurements

Floats = NDArray[np.float64]

AREA = Check(
    "gamut",
    "Gamut",
    None,
    "% of sRGB's area in u′v′",
    "No limit: what is enough depends on the stimuli, and every trial records what it clips",
)
CHANGE = Check(
    "gamut_change",
    "Change of gamut",
    10.0,
    "% of area in u′v′",
    "this project: the thesis finds by eye that glasses and settings hardly change the gamut (Figures 3.3 and 3.4); "
    "10 % of area is 5 % of each side",
)
# IEC 61966-2-1.
_SRGB_XY = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))


@dataclass(frozen=True, slots=True, eq=False)
class Gamut:
    """Corners in u′v′ and xy, red, green and blue, shape (3, 2) each, and the white of all at full drive, (2,)."""

    corners_uv: Floats
    corners_xy: Floats
    white_uv: Floats
    white_xy: Floats
    white_cd_m2: float

    @property
    def area(self) -> float:
        """The triangle's area in u′v′."""
        return _area(self.corners_uv)


def gamut_of(measurements: Measurements) -> tuple[Gamut | None, str]:
    """Return the gamut of light above black, or None and why it is not known."""
    matrix, why = primaries(measurements)
    if matrix is None:
        return None, why
    corners = uv(matrix.T)
    if not np.all(np.isfinite(corners)) or _area(corners) < 1e-6:
        return None, "the primaries have no triangle: a channel gives no light, or all are alike"
    white = matrix.sum(axis=1) + black_or_none(measurements)[0]
    return Gamut(corners, xy(matrix.T), uv(white), xy(white), float(white[1])), ""


def gamut(measurements: Measurements) -> Diagnosis:
    """Return the gamut's area in % of that of sRGB; nothing is judged by it."""
    found, why = gamut_of(measurements)
    if found is None:
        return AREA.unjudged(f"The gamut is not known: {why}.")
    value = 100 * found.area / _area(_uv_from_xy(np.array(_SRGB_XY)))
    words = f"The triangle's area in u′v′ is {found.area:.4g}, {value:.3g} % of that of sRGB."
    srgb = np.array(_SRGB_XY)
    panel = Panel(
        "CIE 1931",
        "x",
        "y",
        (_outline("sRGB", srgb, "soft", "dashed"), _outline("primaries", found.corners_xy, "accent", "outline")),
        equal=True,
    )
    return AREA.told(value, words, series=(panel,), table=_rows(found))


def gamut_change(measurements: Measurements, other: Measurements, label: str, other_label: str) -> Diagnosis:
    """Judge how much the area of ``measurements`` differs from that of ``other``, in % of the latter."""
    found, why = gamut_of(measurements)
    before, why_not = gamut_of(other)
    if found is None or before is None:
        return CHANGE.unjudged(f"A gamut is not known: {why or why_not}.")
    value = 100 * (found.area / before.area - 1)
    shift = found.white_uv - before.white_uv
    panel = Panel(
        "CIE 1931",
        "x",
        "y",
        (
            _outline(other_label, before.corners_xy, "soft", "dashed"),
            _outline(label, found.corners_xy, "accent", "outline"),
            Line("", (float(before.white_xy[0]),), (float(before.white_xy[1]),), "soft", "points"),
            Line("", (float(found.white_xy[0]),), (float(found.white_xy[1]),), "accent", "points"),
        ),
        equal=True,
    )
    words = (
        f"The area is {abs(value):.2g} % {'larger' if value > 0 else 'smaller'} than that of {other_label}; white "
        f"moves by {np.linalg.norm(shift):.2g} in u′v′ ({shift[0]:+.4f}, {shift[1]:+.4f})."
    )
    rows: list[tuple[Cell, ...]] = []
    for name, one in ((other_label, before), (label, found)):
        rows.append((name, one.area, *(f"{part:.4f}" for part in one.white_xy), one.white_cd_m2))
    table = Table(("", "area in u′v′", "white x", "white y", "white, cd/m²"), tuple(rows))
    return CHANGE.judged(abs(value), words, series=(panel,), table=table)


def _outline(name: str, corners: Floats, colour: Colour, style: str) -> Line:
    if style == "outline":
        return Line(name, numbers(corners[:, 0]), numbers(corners[:, 1]), colour, "outline")
    closed = np.vstack([corners, corners[:1]])
    return Line(name, numbers(closed[:, 0]), numbers(closed[:, 1]), colour, "dashed")


def _rows(found: Gamut) -> Table:
    rows = tuple(
        (name, *(f"{value:.4f}" for value in (*plane, *even)))
        for name, plane, even in (
            *zip(("red", "green", "blue"), found.corners_xy, found.corners_uv, strict=True),
            ("white", found.white_xy, found.white_uv),
        )
    )
    return Table(("", "x", "y", "u′", "v′"), rows)


def _uv_from_xy(plane: Floats) -> Floats:
    x, y = plane[:, 0], plane[:, 1]
    return uv(np.column_stack([x, y, 1 - x - y]))


def _area(corners: Floats) -> float:
    first, second = corners[1] - corners[0], corners[2] - corners[0]
    return abs(float(first[0] * second[1] - first[1] * second[0])) / 2
