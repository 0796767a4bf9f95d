"""CIEDE2000 of many colours, compiled: the formulas of `ciede2000` and `spaces`, one colour after another."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from devices.colour import ciede2000 as terms
from documents.arrays import Floats
from documents.compiled import loop

# Colours whose cube roots are found at a time, so that the processor's vectors serve for each step.
_AT_A_TIME = 512
_KNEE = (6.0 / 29.0) ** 3  # the share of the white below which CIELAB is straight
_SLOPE, _START = (29.0 / 6.0) ** 2 / 3.0, 4.0 / 29.0
# Added to a third of a number's bits, of float32, this gives the bits of its cube root within 4 %.
_BITS = np.int32(709921077)
_THIRD = np.float32(1.0 / 3.0)
_LEAST, _LEAST_SINGLE = 1e-3, np.float32(1e-3)
# Shares of the white beyond this become so huge that they are left to `ciede2000`, and NaN stays NaN.
_MOST = 1e30

_T_EVEN, _T_ODD, _GAUSSIAN, _SINE = terms.T_EVEN, terms.T_ODD, terms.GAUSSIAN_16TH, terms.TWICE_SINE
_C275, _S275 = 0.5 * terms.COSINE_275, 0.5 * terms.SINE_275
_OPPOSITE, _NO_OPPOSITE, _HUGE = terms.OPPOSITE, terms.NO_OPPOSITE, terms.HUGE
_NO_CHROMA, _NO_PRODUCT, _NO_SQUARE = terms.NO_CHROMA, terms.NO_PRODUCT, terms.NO_PRODUCT**2


@loop(inline=True)
def _polynomial(x: float, coefficients: tuple[float, ...]) -> float:
    value = coefficients[-1]
    for k in range(len(coefficients) - 2, -1, -1):
        value = value * x + coefficients[k]
    return value


@loop(inline=True)
def _per_root_of_seventh_share(chroma: float) -> float:
    root = 25.0 / max(chroma, 1e-30)
    cube = root * root * root
    return math.sqrt(cube * cube * root + 1.0)


@loop("void(float64[:, ::1], int64, float64[::1])")
def lab_of_xyz(xyz: Floats, n: int, white: Floats) -> None:
    """Turn planes of XYZ, (6, n), of two colours each, into L*, a* and b* against a white (3,), in place."""
    guess = np.empty(_AT_A_TIME, np.float32)
    bits = guess.view(np.int32)
    for start in range(0, n, _AT_A_TIME):
        stop = min(start + _AT_A_TIME, n)
        for k in range(6):
            plane, per_white = xyz[k, start:stop], 1.0 / white[k % 3]
            for i in range(len(plane)):
                plane[i] *= per_white
                guess[i] = max(plane[i], _LEAST)
            for i in range(len(plane)):
                bits[i] = np.int32(np.float32(bits[i]) * _THIRD) + _BITS
            for i in range(len(plane)):
                share, root = plane[i], guess[i]
                # Halley's method: each step cubes the relative error.
                single = max(np.float32(share), _LEAST_SINGLE)
                cube = root * root * root
                near = np.float64(root + root * (single - cube) / (cube + cube + single))
                x = max(share, _LEAST)
                cubed = near * near * near
                near += near * (x - cubed) / (cubed + cubed + x)
                cubed = near * near * near
                near += near * (x - cubed) / (cubed + cubed + x)
                bent = near if share > _KNEE else share * _SLOPE + _START
                plane[i] = bent if share <= _MOST else share * 1e61
        for k in (0, 3):
            first, second, third = xyz[k, start:stop], xyz[k + 1, start:stop], xyz[k + 2, start:stop]
            for i in range(len(first)):
                x, y, z = first[i], second[i], third[i]
                first[i], second[i], third[i] = 116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)


@loop("void(float64[:, ::1], int64, float64[::1], boolean[::1])")
def delta_e(lab: Floats, n: int, out: Floats, left: NDArray[np.bool_]) -> None:
    """Write ΔE00 of two colours' L*, a* and b*, planes (6, n), into ``out`` (n,), and which are ``left`` to do.

    Those whose hues are nearly opposite, and huge ones.
    """
    for i in range(n):
        L1, a1, b1, L2, a2, b2 = lab[0, i], lab[1, i], lab[2, i], lab[3, i], lab[4, i], lab[5, i]
        mean = 0.5 * (math.sqrt(a1 * a1 + b1 * b1) + math.sqrt(a2 * a2 + b2 * b2))
        G = 1.5 - 0.5 / _per_root_of_seventh_share(mean)
        A1, A2 = a1 * G, a2 * G
        C1, C2 = math.sqrt(A1 * A1 + b1 * b1), math.sqrt(A2 * A2 + b2 * b2)
        dot, cross, product = A1 * A2 + b1 * b2, A1 * b2 - A2 * b1, C1 * C2
        dH = (cross + cross) / math.sqrt(max(2.0 * (product + dot), _NO_SQUARE))
        some_C1, some_C2 = max(C1, _NO_CHROMA), max(C2, _NO_CHROMA)
        x, y = A1 * some_C2 + A2 * some_C1, b1 * some_C2 + b2 * some_C1
        per_length = 1.0 / max(math.sqrt(x * x + y * y), _NO_PRODUCT)
        cosine, sine = x * per_length, y * per_length
        C_bar = 0.5 * (C1 + C2)
        S_H = 1.0 + 0.015 * C_bar * (_polynomial(cosine, _T_ODD) * sine + _polynomial(cosine, _T_EVEN))
        S_C = 1.0 + 0.045 * C_bar
        half = 0.5 - 0.5 * math.sqrt(max(cosine * _C275 + sine * _S275 + 0.5, 0.0))
        gaussian = _polynomial(half, _GAUSSIAN)
        gaussian *= gaussian
        gaussian *= gaussian
        gaussian *= gaussian
        gaussian *= gaussian
        gaussian = gaussian if (cosine <= 0.0) | (sine < 0.0) else 0.0
        R_T = _polynomial(gaussian * gaussian, _SINE) * gaussian / _per_root_of_seventh_share(C_bar)
        lightness = 0.5 * (L1 + L2) - 50.0
        lightness *= lightness
        S_L = 1.0 + 0.015 * lightness / math.sqrt(20.0 + lightness)
        L, C, H = (L2 - L1) / S_L, (C2 - C1) / S_C, dH / S_H
        square = (R_T * C + H) * H + L * L + C * C
        out[i] = math.sqrt(0.0 if square < 0.0 else square)
        most = max(max(max(abs(L1), abs(a1)), max(abs(b1), abs(L2))), max(abs(a2), abs(b2)))
        left[i] = (dot < product * _OPPOSITE - _NO_OPPOSITE) | (most > _HUGE)
