"""Colour spaces of ordinary pictures: from codes to XYZ, by name or by an embedded ICC profile.

XYZ is that of the display that the codes are meant for: a picture's white keeps the chromaticity that its colour space
gives it (D65 of sRGB stays D65), times the luminance that is given. Nothing is adapted to another white. A profile's
connection space is adapted to D50; that is undone by the matrix that the profile itself names.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from devices.colour import D65_XY, DISPLAY_P3_PRIMARIES_XY, SRGB_PRIMARIES_XY, rgb_to_xyz_matrix, srgb_decoded
from devices.errors import DeviceError
from documents.arrays import Floats
from stimuli.errors import StimulusError

if TYPE_CHECKING:
    pass

Curve = Callable[[ArrayLike], Floats]
NamedSpace = Literal["srgb", "display-p3", "adobe-rgb", "rec2020"]
NAMED_SPACES: tuple[NamedSpace, ...] = get_args(NamedSpace)

_Primaries = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


def _power(gamma: float) -> Curve:
    def curve(code: ArrayLike) -> Floats:
        codes = np.asarray(code, dtype=np.float64)
        return np.asarray(np.sign(codes) * np.abs(codes) ** gamma)

    return curve


# Primaries and curve. Rec.2020 is shown by BT.1886 of no black, a power of 2.4 [BT2020], as CSS Color 4 decodes it.
_SPACES: dict[str, tuple[_Primaries, Curve]] = {
    "srgb": (SRGB_PRIMARIES_XY, srgb_decoded),
    "display-p3": (DISPLAY_P3_PRIMARIES_XY, srgb_decoded),
    "adobe-rgb": (((0.64, 0.33), (0.21, 0.71), (0.15, 0.06)), _power(563 / 256)),
    "rec2020": (((0.708, 0.292), (0.170, 0.797), (0.131, 0.046)), _power(2.4)),
}
# So near are a profile's numbers to those of a named space: its fixed point and the roundings of its makers.
_SAME_MATRIX, _SAME_CURVE = 2e-3, 1e-3


@dataclass(frozen=True, eq=False, slots=True)
class ColourEncoding:
    """From codes in 0..1 to XYZ with the white at Y = 1: a curve for each channel, then ``matrix``, shape (3, 3).

    ``table`` takes the place of both in a profile that has tables only: from codes (n, 3) to XYZ (n, 3).
    """

    name: str
    matrix: Floats
    curves: tuple[Curve, Curve, Curve]
    table: Callable[[Floats], Floats] | None = None

    @property
    def white(self) -> Floats:
        """XYZ (3,) of full drive."""
        return np.asarray(self.xyz(np.ones((1, 3)))[0])

    def xyz(self, codes: Floats) -> Floats:
        """Return XYZ (n, 3) of codes (n, 3): the plain way, in double precision."""
        if self.table is not None:
            XYZ: Floats = self.table(codes)
            return XYZ
        light = np.stack([curve(codes[:, channel]) for channel, curve in enumerate(self.curves)], axis=1)
        return np.asarray(light @ self.matrix.T)

    def tables(self, levels: int) -> Floats:
        """Return the light of ``levels`` evenly spaced codes, shape (levels, 3)."""
        codes = np.linspace(0.0, 1.0, levels)
        return np.stack([curve(codes) for curve in self.curves], axis=1)


def primaries_of(name: NamedSpace) -> tuple[tuple[float, float], ...]:
    """Return x, y of red, green, blue and white of a named colour space."""
    return (*_SPACES[name][0], D65_XY)


@cache
def named_encoding(name: NamedSpace) -> ColourEncoding:
    """Return the encoding of a named colour space."""
    primaries, curve = _SPACES[name]
    return ColourEncoding(name, rgb_to_xyz_matrix(*primaries, D65_XY), (curve, curve, curve))


def embedded_encoding(data: bytes, path: Path) -> ColourEncoding:
    """Return the encoding of an ICC profile embedded in the picture at ``path``: exact of matrix and curves.

    Raises
    ------
    StimulusError
        If the profile is damaged, or not one of RGB.
    """
    from devices.profiles import profile_encoding

    try:
        read = profile_encoding(data, str(path))
    except DeviceError as error:
        what = f"its ICC profile cannot be used: {error.findings[0].message}"
        remedy = "convert the picture to sRGB with its profile; or remove the profile, and write its colour_space"
        raise StimulusError.at(path, what, remedy) from error
    if read.matrix is None:
        linear = _power(1.0)
        return ColourEncoding("icc", np.eye(3), (linear, linear, linear), read.xyz)
    red, green, blue = read.curves
    return ColourEncoding("icc", read.matrix, (red, green, blue))


def same_space(encoding: ColourEncoding) -> NamedSpace | None:
    """Return the named colour space that an encoding is, within a profile's roundings; None if it is another."""
    if encoding.table is not None:
        return None
    codes = np.linspace(0.0, 1.0, 65)
    for name in NAMED_SPACES:
        named = named_encoding(name)
        curves = [np.abs(curve(codes) - named.curves[0](codes)).max() for curve in encoding.curves]
        if max(curves) <= _SAME_CURVE and np.abs(encoding.matrix - named.matrix).max() <= _SAME_MATRIX:
            return name
    return None
