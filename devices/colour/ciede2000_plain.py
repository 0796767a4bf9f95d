"""CIEDE2000's terms as the paper has them, in whole arrays: the slow twin of `ciede2000_terms`.

Sharma, Wu & Dalal 2005, "The CIEDE2000 color-difference formula". The fast terms are tested against these, and leave to
them what is too large to be squared.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from documents.arrays import Floats

# A chroma that is as good as none, and whose square is no underflow.
_NO_CHROMA = 1e-150


def plain_terms(first: Sequence[Floats], second: Sequence[Floats]) -> tuple[Floats, ...]:
    """ΔL', ΔC', ΔH', S_L, S_C, S_H and R_T of colours' L*, a* and b*, (n,) each, in the paper's symbols.

    Hues are carried as unit vectors, which spares the sines and cosines that cost most: their sum points along the
    mean hue, their difference at right angles to it, and half the length of the difference is sin(Δh / 2). The mean
    is taken from the longer of the two, so that nothing cancels near 180°.
    """
    L1, a1, b1 = first
    L2, a2, b2 = second
    C_bar = 0.5 * (_length(a1, b1) + _length(a2, b2))
    G = 1.5 - 0.5 * np.sqrt(_seventh_share(C_bar))  # the paper's 1 + G
    way = turn(a1, b1, a2, b2)
    a1, a2 = a1 * G, a2 * G
    C1, C2 = _length(a1, b1), _length(a2, b2)
    C_bar = 0.5 * (C1 + C2)
    # A neutral colour has the vector 0: the mean hue is then the other's, as in the paper.
    per_C1, per_C2 = 1.0 / np.maximum(C1, _NO_CHROMA), 1.0 / np.maximum(C2, _NO_CHROMA)
    x1, y1, x2, y2 = a1 * per_C1, b1 * per_C1, a2 * per_C2, b2 * per_C2
    across_x, across_y = x2 - x1, y2 - y1
    half_chord = 0.5 * _length(across_x, across_y)
    delta_H = 2.0 * np.sqrt(C1 * C2) * half_chord * way
    wide = half_chord > np.sqrt(0.5)
    cos_h = np.where(wide, way * across_y, x1 + x2)
    sin_h = np.where(wide, -way * across_x, y1 + y2)
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


def plain_delta_e(
    delta_L: Floats, delta_C: Floats, delta_H: Floats, S_L: Floats, S_C: Floats, S_H: Floats, R_T: Floats
) -> Floats:
    """Return ΔE00 (n,) of its terms."""
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
    away = np.radians(degrees)
    return np.asarray(cosine * np.cos(away) + sine * np.sin(away))


def turn(a1: Floats, b1: Floats, a2: Floats, b2: Floats) -> Floats:
    """Return 1 where the shorter way from the first hue to the second is counter-clockwise, else −1.

    Exactly opposite hues have no shorter way; the paper then takes the difference of the angles in 0..360°, which is
    positive where the first lies in the upper half-plane. Rounding must not decide which hues are opposite.
    """
    first, second = a1 * b2, a2 * b1
    cross = first - second
    near = np.abs(cross) <= 4 * np.finfo(np.float64).eps * (np.abs(first) + np.abs(second))
    way = np.copysign(1.0, cross)
    if near.any():
        upper = (b1 > 0) | ((b1 == 0) & (a1 > 0))
        way[near] = np.where(upper, 1.0, -1.0)[near]
    return np.asarray(way)
