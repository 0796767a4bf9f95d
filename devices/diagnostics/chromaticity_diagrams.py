"""Chromaticities as two diagrams, x, y of CIE 1931 and u′, v′ of CIE 1976, with the colours that are real.

The thesis's Figures 3.1, 3.3, 3.4 and 3.12 are in x, y, in which equal distances are no equal differences; u′v′ is more
even. Straight lines stay straight from one to the other, so that triangles are triangles in both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from devices.colour.srgb_encoding import SRGB_PRIMARIES_XY
from devices.diagnostics.diagnosis import Colour, PlotAxes, Trace, numbers
from devices.diagnostics.readings import uv
from documents.arrays import Floats

# Wavelength in nm, x, y; closer together where the curve bends.
LOCUS: tuple[tuple[int, float, float], ...] = (
    (400, 0.1733, 0.0048),
    (430, 0.1689, 0.0069),
    (440, 0.1644, 0.0109),
    (450, 0.1566, 0.0177),
    (455, 0.1510, 0.0227),
    (460, 0.1440, 0.0297),
    (465, 0.1355, 0.0399),
    (470, 0.1241, 0.0578),
    (475, 0.1096, 0.0868),
    (480, 0.0913, 0.1327),
    (485, 0.0687, 0.2007),
    (490, 0.0454, 0.2950),
    (495, 0.0235, 0.4127),
    (500, 0.0082, 0.5384),
    (505, 0.0039, 0.6548),
    (510, 0.0139, 0.7502),
    (515, 0.0389, 0.8120),
    (520, 0.0743, 0.8338),
    (525, 0.1142, 0.8262),
    (530, 0.1547, 0.8059),
    (535, 0.1929, 0.7816),
    (540, 0.2296, 0.7543),
    (550, 0.3016, 0.6923),
    (560, 0.3731, 0.6245),
    (570, 0.4441, 0.5547),
    (580, 0.5125, 0.4866),
    (590, 0.5752, 0.4242),
    (600, 0.6270, 0.3725),
    (620, 0.6915, 0.3083),
    (640, 0.7190, 0.2809),
    (700, 0.7347, 0.2653),
)


def locus_line() -> Trace:
    """Return the horseshoe of real colours in x, y, closed by the line of purples.

    Returns
    -------
    Trace
        Chromaticities x and y, no unit, in 0..1, from 400 nm upwards.

    Examples
    --------
    >>> line = locus_line()
    >>> line.name, len(line.x) == len(line.y)
    ('real colours', True)
    """
    return Trace("real colours", tuple(x for _, x, _ in LOCUS), tuple(y for _, _, y in LOCUS), "soft", "outline")


# Triangles beyond these begin again; dashes keep two that lie on each other apart.
_COLOURS: tuple[Colour, ...] = ("accent", "red", "blue", "green", "ink", "grey")


def diagrams(lines: Sequence[Trace]) -> tuple[PlotAxes, PlotAxes]:
    """Return ``lines``, in x and y, among the real colours, as a panel in xy and one in u′v′."""
    drawn = (locus_line(), *lines)
    in_uv = tuple(_in_uv(line) for line in drawn)
    return PlotAxes("CIE 1931", "x", "y", drawn, equal=True), PlotAxes("CIE 1976", "u′", "v′", in_uv, equal=True)


def triangle(name: str, corners_xy: Floats, white_xy: Floats | None = None, number: int = 0) -> tuple[Trace, ...]:
    """Return the lines of a gamut: its triangle, corners (3, 2), and its white (2,), if it is given.

    The first of several is whole, the second dashed, and so on, each in a colour of its own.
    """
    colour = _COLOURS[number % len(_COLOURS)]
    return (_outline(name, corners_xy, colour, dashed=number % 2 == 1), *_white(white_xy, colour))


def srgb_triangle() -> Trace:
    """Return the triangle of sRGB, to compare with."""
    return _outline("sRGB", np.array(SRGB_PRIMARIES_XY), "soft", dashed=True)


def _white(white_xy: Floats | None, colour: Colour) -> tuple[Trace, ...]:
    if white_xy is None:
        return ()
    return (Trace("", (float(white_xy[0]),), (float(white_xy[1]),), colour, "points"),)


def _outline(name: str, corners: Floats, colour: Colour, *, dashed: bool) -> Trace:
    if not dashed:
        return Trace(name, numbers(corners[:, 0]), numbers(corners[:, 1]), colour, "outline")
    closed = np.vstack([corners, corners[:1]])
    return Trace(name, numbers(closed[:, 0]), numbers(closed[:, 1]), colour, "dashed")


def _in_uv(line: Trace) -> Trace:
    moved = uv_from_xy(np.column_stack([line.x, line.y]))
    return replace(line, x=numbers(moved[:, 0]), y=numbers(moved[:, 1]))


def uv_from_xy(plane: Floats) -> Floats:
    """Return u′v′ (n, 2) for x, y (n, 2)."""
    x, y = plane[:, 0], plane[:, 1]
    return uv(np.column_stack([x, y, 1 - x - y]))
