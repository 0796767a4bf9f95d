"""The CIEDE2000 colour difference, and the terms it is made of.

Sharma, Wu & Dalal 2005, "The CIEDE2000 color-difference formula", with its guards: a hue difference of exactly 180°,
and neutral colours that have no hue.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.colour.spaces import checked_white, lab_planes
from devices.errors import DeviceError

Floats = NDArray[np.float64]

# Colours worked on at a time: few enough for the processor's cache, enough that NumPy's own overhead does not show.
_BLOCK = 8192
# A chroma that is as good as none, and whose square is no underflow.
_NO_CHROMA = 1e-150


@dataclass(frozen=True, eq=False, slots=True)
class ColourDifference:
    """CIEDE2000 differences and their terms, arrays of one shape (...).

    ``delta_L``, ``delta_C`` and ``delta_H`` are the paper's ΔL', ΔC' and ΔH', second colour minus first, before they
    are divided by the weights ``S_L``, ``S_C`` and ``S_H``; ``R_T`` is the rotation between chroma and hue. With
    l = ΔL'/S_L, c = ΔC'/S_C and h = ΔH'/S_H, ``delta_e`` is √(l² + c² + h² + R_T·c·h).
    """

    delta_e: Floats
    delta_L: Floats
    delta_C: Floats
    delta_H: Floats
    S_L: Floats
    S_C: Floats
    S_H: Floats
    R_T: Floats


def delta_e_2000(lab1: ArrayLike, lab2: ArrayLike) -> Floats:
    """Return the CIEDE2000 difference, shape (...), between CIELAB colours, shape (..., 3), broadcast together.

    kL = kC = kH = 1. Symmetric in its arguments; a NaN in a colour gives NaN.

    Parameters
    ----------
    lab1, lab2
        CIELAB colours, shape (..., 3), broadcast together.

    Returns
    -------
    ndarray
        ΔE00, shape (...).

    Raises
    ------
    DeviceError
        If a colour has not three numbers.

    Examples
    --------
    >>> float(delta_e_2000([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485]).round(4))
    2.0425
    """
    first, second, shape = _pairs(lab1, lab2)
    out = np.empty(len(first))
    for part in _blocks(len(out)):
        out[part] = _delta_e(*_terms(*_planes(first[part], second[part])))
    return out.reshape(shape)


def delta_e_2000_of_xyz(xyz1: ArrayLike, xyz2: ArrayLike, white_xyz: ArrayLike) -> Floats:
    """Return the CIEDE2000 difference, shape (...), between XYZ, shape (..., 3), broadcast together, against a white.

    The same as `delta_e_2000` of `xyz_to_lab` of both, in three quarters of the time: CIELAB stays in the processor's
    cache.

    Parameters
    ----------
    xyz1, xyz2
        XYZ in one unit, shape (..., 3), broadcast together.
    white_xyz
        XYZ of the white, shape (3,), in the same unit.

    Returns
    -------
    ndarray
        ΔE00, shape (...).

    Raises
    ------
    DeviceError
        If a colour has not three numbers, or a component of the white is not a finite number above 0.

    Examples
    --------
    >>> float(delta_e_2000_of_xyz([40.0, 42.0, 45.0], [41.0, 42.0, 45.0], [95.0, 100.0, 109.0]).round(2))
    4.16
    """
    white = checked_white(white_xyz)
    first, second, shape = _pairs(xyz1, xyz2)
    out = np.empty(len(first))
    for part in _blocks(len(out)):
        labs = [lab_planes(planes, white) for planes in _planes(first[part], second[part])]
        out[part] = _delta_e(*_terms(*labs))
    return out.reshape(shape)


def delta_e_2000_parts(lab1: ArrayLike, lab2: ArrayLike) -> ColourDifference:
    """Return the CIEDE2000 differences of CIELAB colours, shape (..., 3), broadcast together, with their terms.

    Parameters
    ----------
    lab1, lab2
        CIELAB colours, shape (..., 3), broadcast together.

    Returns
    -------
    ColourDifference
        ΔE00, the differences in lightness, chroma and hue, their weights and the rotation, shape (...) each.

    Raises
    ------
    DeviceError
        If a colour has not three numbers.

    Examples
    --------
    >>> parts = delta_e_2000_parts([45.0, 0.0, 0.0], [55.0, 0.0, 0.0])
    >>> float(parts.delta_L), float(parts.S_L), float(parts.delta_e)
    (10.0, 1.0, 10.0)
    """
    first, second, shape = _pairs(lab1, lab2)
    parts = np.empty((8, len(first)))
    for part in _blocks(len(first)):
        terms = _terms(*_planes(first[part], second[part]))
        parts[0, part] = _delta_e(*terms)
        parts[1:, part] = terms
    return ColourDifference(*parts.reshape(8, *shape))


def _pairs(lab1: ArrayLike, lab2: ArrayLike) -> tuple[NDArray[np.floating], NDArray[np.floating], tuple[int, ...]]:
    first, second = np.broadcast_arrays(_floats(lab1), _floats(lab2))
    if first.shape[-1:] != (3,):
        raise DeviceError(f"CIELAB colours have three numbers each, not shape {first.shape}")
    return first.reshape(-1, 3), second.reshape(-1, 3), first.shape[:-1]


def _floats(lab: ArrayLike) -> NDArray[np.floating]:
    """Colours as they are stored, if that is as floats; the blocks turn them into float64 a few at a time."""
    values = np.asarray(lab)
    return values if values.dtype in (np.float32, np.float64) else values.astype(np.float64)


def _blocks(count: int) -> Iterator[slice]:
    return (slice(start, start + _BLOCK) for start in range(0, count, _BLOCK))


def _planes(*colours: NDArray[np.floating]) -> list[Sequence[Floats]]:
    """Colours (n, 3) as three planes (n,) each."""
    return [tuple(one.T.astype(np.float64, order="C")) for one in colours]


def _terms(first: Sequence[Floats], second: Sequence[Floats]) -> tuple[Floats, ...]:
    """ΔL', ΔC', ΔH', S_L, S_C, S_H and R_T of colours' L*, a* and b*, (n,) each, in the paper's symbols.

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
    S_L = 1 + 0.015 * lightness / np.sqrt(20 + lightness)
    return L2 - L1, C2 - C1, delta_H, S_L, 1 + 0.045 * C_bar, 1 + 0.015 * C_bar * T, R_T


def _delta_e(
    delta_L: Floats, delta_C: Floats, delta_H: Floats, S_L: Floats, S_C: Floats, S_H: Floats, R_T: Floats
) -> Floats:
    L, C, H = delta_L / S_L, delta_C / S_C, delta_H / S_H
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
    first, second = a1 * b2, a2 * b1
    cross = first - second
    near = np.abs(cross) <= 4 * np.finfo(np.float64).eps * (np.abs(first) + np.abs(second))
    turn = np.copysign(1.0, cross)
    if near.any():
        upper = (b1 > 0) | ((b1 == 0) & (a1 > 0))
        turn[near] = np.where(upper, 1.0, -1.0)[near]
    return np.asarray(turn)
