"""Colour spaces of CIE 1931 2°: XYZ, xyY, Lab, the matrix of an RGB space, and the CIEDE2000 difference.

CIE 15:2018 for xyY and Lab; Sharma, Wu & Dalal 2005, "The CIEDE2000 color-difference formula", for ΔE00 with
its guards: a hue difference of exactly 180°, and neutral colours that have no hue.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.errors import DeviceError

Floats = NDArray[np.float64]

# Lab is a cube root above this share of white and a straight line below it.
_DELTA = 6.0 / 29.0
# Colours that delta_e_2000 works on at a time: all its arrays then stay in the processor's cache.
_BLOCK = 4096
# A chroma that nobody can tell from none, and whose square is no underflow.
_NO_CHROMA = 1e-150


def xyY_from_XYZ(xyz: ArrayLike) -> Floats:
    """Return chromaticity x, y and luminance Y, shape (..., 3), for XYZ, shape (..., 3).

    Black has no chromaticity: where X + Y + Z is 0, x and y are returned as 0.
    """
    values = np.asarray(xyz, dtype=np.float64)
    total = values.sum(axis=-1, keepdims=True)
    share = np.divide(values, total, out=np.zeros_like(values), where=total != 0)
    return np.concatenate([share[..., :2], values[..., 1:2]], axis=-1)


def XYZ_from_xyY(xyY: ArrayLike) -> Floats:
    """Return XYZ, shape (..., 3), for chromaticity x, y and luminance Y, shape (..., 3).

    Raises
    ------
    DeviceError
        If y is 0 where Y is not: no light has that chromaticity.
    """
    values = np.asarray(xyY, dtype=np.float64)
    x, y, luminance = values[..., 0], values[..., 1], values[..., 2]
    if np.any((y == 0) & (luminance != 0)):
        raise DeviceError("a chromaticity with y = 0 cannot have luminance")
    per_y = np.divide(luminance, y, out=np.zeros_like(luminance), where=y != 0)
    return np.stack([x * per_y, luminance, (1.0 - x - y) * per_y], axis=-1)


def rgb_to_xyz_matrix(red_xy: ArrayLike, green_xy: ArrayLike, blue_xy: ArrayLike, white_xy: ArrayLike) -> Floats:
    """Return the matrix (3, 3) from linear RGB to XYZ for which RGB (1, 1, 1) is the white with Y = 1.

    Each argument is a chromaticity (x, y), shape (2,). The primaries of XYZ itself, (1, 0), (0, 1), (0, 0) with
    white (1/3, 1/3), give the identity. Source: SMPTE RP 177.

    Raises
    ------
    DeviceError
        If a number is not finite, the white has no y, or the primaries lie on one line.
    """
    corners = np.array([red_xy, green_xy, blue_xy, white_xy], dtype=np.float64)
    if corners.shape != (4, 2) or not np.all(np.isfinite(corners)):
        raise DeviceError(f"chromaticities must be four finite (x, y), not {corners.tolist()}")
    columns = np.column_stack([corners, 1.0 - corners.sum(axis=1)]).T
    if corners[3, 1] <= 0 or abs(np.linalg.det(columns[:, :3])) < 1e-9:
        raise DeviceError(f"no colours can be made of the chromaticities {corners.tolist()}")
    white = columns[:, 3] / corners[3, 1]
    scale: Floats = np.linalg.solve(columns[:, :3], white)
    return np.asarray(columns[:, :3] * scale)


def xyz_to_lab(xyz: ArrayLike, white_xyz: ArrayLike) -> Floats:
    """Return CIELAB, shape (..., 3), for XYZ, shape (..., 3), against ``white_xyz``, shape (3,), in the same unit.

    Raises
    ------
    DeviceError
        If a component of the white is not a finite number above 0.
    """
    share = np.asarray(xyz, dtype=np.float64) / _white(white_xyz)
    bent = np.cbrt(share)
    low = share <= _DELTA**3
    bent[low] = share[low] / (3.0 * _DELTA**2) + 4.0 / 29.0
    x, y, z = bent[..., 0], bent[..., 1], bent[..., 2]
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def lab_to_xyz(lab: ArrayLike, white_xyz: ArrayLike) -> Floats:
    """Return XYZ, shape (..., 3), for CIELAB, shape (..., 3), against ``white_xyz``, shape (3,).

    Raises
    ------
    DeviceError
        If a component of the white is not a finite number above 0.
    """
    values = np.asarray(lab, dtype=np.float64)
    y = (values[..., 0] + 16.0) / 116.0
    bent = np.stack([y + values[..., 1] / 500.0, y, y - values[..., 2] / 200.0], axis=-1)
    share = np.where(bent > _DELTA, bent**3, 3.0 * _DELTA**2 * (bent - 4.0 / 29.0))
    return np.asarray(share * _white(white_xyz))


def _white(white_xyz: ArrayLike) -> Floats:
    white = np.asarray(white_xyz, dtype=np.float64)
    if white.shape != (3,) or not np.all(np.isfinite(white)) or np.any(white <= 0):
        raise DeviceError(f"a white needs three finite numbers above 0, not {white.tolist()}")
    return white


def delta_e_2000(lab1: ArrayLike, lab2: ArrayLike) -> Floats:
    """Return the CIEDE2000 difference, shape (...), between CIELAB colours, shape (..., 3), broadcast together.

    kL = kC = kH = 1. Symmetric in its arguments; a NaN in a colour gives NaN.
    """
    first, second = np.broadcast_arrays(np.asarray(lab1, dtype=np.float64), np.asarray(lab2, dtype=np.float64))
    shape = first.shape[:-1]
    if first.shape[-1:] != (3,):
        raise DeviceError(f"CIELAB colours have three numbers each, not shape {first.shape}")
    first, second = first.reshape(-1, 3), second.reshape(-1, 3)
    out = np.empty(len(first))
    for start in range(0, len(out), _BLOCK):
        block = slice(start, start + _BLOCK)
        out[block] = _delta_e_2000_block(first[block].T.copy(), second[block].T.copy())
    return out.reshape(shape)


def _delta_e_2000_block(first: Floats, second: Floats) -> Floats:
    """ΔE00 of colours laid out as (3, n), in the symbols of Sharma, Wu & Dalal 2005.

    Hues are carried as unit vectors, which spares the sines and cosines that cost most: their sum points along the
    mean hue, their difference at right angles to it, and half the length of the difference is sin(Δh / 2). The mean
    is taken from the longer of the two, so that nothing cancels near 180°.
    """
    L1, a1, b1 = first
    L2, a2, b2 = second
    C_bar = 0.5 * (_length(a1, b1) + _length(a2, b2))
    G = 1.5 - 0.5 * np.sqrt(_seventh_share(C_bar))  # the paper's 1 + G
    turn = _turn(a1, b1, a2, b2)
    a1, a2 = a1 * G, a2 * G
    C1, C2 = _length(a1, b1), _length(a2, b2)
    C_bar = 0.5 * (C1 + C2)
    # A neutral colour has the vector 0: the mean hue is then the other's, as in the paper.
    per_C1, per_C2 = 1.0 / np.maximum(C1, _NO_CHROMA), 1.0 / np.maximum(C2, _NO_CHROMA)
    x1, y1, x2, y2 = a1 * per_C1, b1 * per_C1, a2 * per_C2, b2 * per_C2
    across_x, across_y = x2 - x1, y2 - y1
    half_chord = 0.5 * _length(across_x, across_y)
    delta_H = 2.0 * np.sqrt(C1 * C2) * half_chord * turn
    wide = half_chord > np.sqrt(0.5)
    cos_h = np.where(wide, turn * across_y, x1 + x2)
    sin_h = np.where(wide, -turn * across_x, y1 + y2)
    norm = 1.0 / np.maximum(_length(cos_h, sin_h), _NO_CHROMA)
    cos_h *= norm
    sin_h *= norm

    cos_2h, sin_2h = 2 * cos_h * cos_h - 1, 2 * sin_h * cos_h
    cos_3h, sin_3h = cos_2h * cos_h - sin_2h * sin_h, sin_2h * cos_h + cos_2h * sin_h
    cos_4h, sin_4h = 2 * cos_2h * cos_2h - 1, 2 * sin_2h * cos_2h
    T = 1 - 0.17 * _cos_minus(cos_h, sin_h, 30) + 0.24 * cos_2h + 0.32 * _cos_minus(cos_3h, sin_3h, -6)
    T -= 0.20 * _cos_minus(cos_4h, sin_4h, 63)
    # The mean hue in 0..360°, without a branch; + 0.0 turns −0 into 0, so that hue 0 is not taken for 360°.
    from_blue = np.arctan2(-(sin_h + 0.0), -cos_h)
    from_blue += np.radians(180 - 275)
    from_blue *= 180.0 / (25.0 * np.pi)
    from_blue *= from_blue
    R_T = -2.0 * np.sin(np.radians(60.0) * np.exp(-from_blue)) * np.sqrt(_seventh_share(C_bar))
    lightness = 0.5 * (L1 + L2) - 50
    lightness *= lightness
    L = (L2 - L1) / (1 + 0.015 * lightness / np.sqrt(20 + lightness))
    C = (C2 - C1) / (1 + 0.045 * C_bar)
    H = delta_H / (1 + 0.015 * C_bar * T)
    return np.asarray(np.sqrt(np.maximum(L * L + C * C + H * H + R_T * C * H, 0.0)))


def _length(x: Floats, y: Floats) -> Floats:
    return np.asarray(np.sqrt(x * x + y * y))


def _seventh_share(chroma: Floats) -> Floats:
    """C⁷ / (C⁷ + 25⁷), for any chroma without overflow."""
    ratio = 25.0 / np.maximum(chroma, 1e-30)
    cube = ratio * ratio * ratio
    return np.asarray(1.0 / (1.0 + cube * cube * ratio))


def _cos_minus(cosine: Floats, sine: Floats, degrees: float) -> Floats:
    """cos(angle − degrees) from the angle's cosine and sine."""
    turn = np.radians(degrees)
    return np.asarray(cosine * np.cos(turn) + sine * np.sin(turn))


def _turn(a1: Floats, b1: Floats, a2: Floats, b2: Floats) -> Floats:
    """Return 1 where the shorter way from the first hue to the second is counter-clockwise, else −1.

    Exactly opposite hues have no shorter way; the paper then takes the difference of the angles in 0..360°, which is
    positive where the first lies in the upper half-plane. Rounding must not decide which hues are opposite.
    """
    one, other = a1 * b2, a2 * b1
    cross = one - other
    near = np.abs(cross) <= 4 * np.finfo(np.float64).eps * (np.abs(one) + np.abs(other))
    turn = np.copysign(1.0, cross)
    if near.any():
        upper = (b1 > 0) | ((b1 == 0) & (a1 > 0))
        turn[near] = np.where(upper, 1.0, -1.0)[near]
    return np.asarray(turn)
