"""CIEDE2000's terms in planes that are used again, by additions, products, quotients and square roots alone.

The equations are those of Sharma, Wu & Dalal 2005, "The CIEDE2000 color-difference formula"; `ciede2000_plain` has them
as they stand there. What is otherwise here:

- With the dot and the cross product of the hue vectors, ΔH' = 2·cross / √(2(C'₁C'₂ + dot)), and the mean hue points
  along a'₁C'₂ + a'₂C'₁, b'₁C'₂ + b'₂C'₁. Of hues that are nearly opposite both would cancel: those few are gathered.
- T is a polynomial in the cosine and the sine of the mean hue h.
- R_T's Gaussian of the angle from 275° is the 16th power of a polynomial in sin²(angle / 4); its sine, a series.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devices.colour.ciede2000_plain import plain_terms, turn
from documents.arrays import Floats

TERMS = 7
# Planes of scratch that `fast_terms` needs.
SCRATCH = 10
# Hues are nearly opposite where the cosine between them is below this.
OPPOSITE = -0.9
# Chroma beyond this, such as of a broken pixel, is left to the plain terms: its fourth power is no number.
HUGE = 1e60
# A chroma that is as good as none, and the product of two, whose square is no underflow.
NO_CHROMA, NO_PRODUCT = 1e-70, 1e-150
# Hues are not opposite if the product of the chroma is below this: one is then as good as neutral, or both are.
NO_OPPOSITE = 1e-60

_C6, _S6, _C30, _C63, _S63 = (
    math.cos(math.radians(6)),
    math.sin(math.radians(6)),
    math.cos(math.radians(30)),
    math.cos(math.radians(63)),
    math.sin(math.radians(63)),
)
# T = T_EVEN(cos h) + sin h · T_ODD(cos h), lowest power first.
T_EVEN = (1 - 0.24 - 0.2 * _C63, -0.17 * _C30 - 0.96 * _C6, 0.48 + 1.6 * _C63, 1.28 * _C6, -1.6 * _C63)
T_ODD = (-0.17 * 0.5 + 0.32 * _S6, 0.8 * _S63, -1.28 * _S6, -1.6 * _S63)
COSINE_275, SINE_275 = math.cos(math.radians(275)), math.sin(math.radians(275))
# exp(−(angle / 25°)²) to the power of 1/16, in sin²(angle / 4): interpolated at 13 Chebyshev points of 0 to 1/2. Its
# 16th power is within 2e-14 everywhere.
GAUSSIAN_16TH = (
    0.9999999999999991,
    -5.252490160018857,
    12.043496387224495,
    -15.889079699849805,
    13.399453457878902,
    -7.600503195068469,
    2.9773300774640576,
    -0.8161423731256457,
    0.15741742759147512,
    -0.021409384048114703,
    0.0020855693614224464,
    -0.00017029856459281788,
    1.7133983824353378e-05,
)
# −2 sin(60° f) / f in f², for f from 0 to 1: the next term is below 1e-16.
TWICE_SINE = tuple(-2 * (-1) ** k * math.radians(60.0) ** (2 * k + 1) / math.factorial(2 * k + 1) for k in range(9))


def fast_terms(labs: Floats, terms: Sequence[Floats], scratch: Sequence[Floats]) -> None:
    """Write ΔL', ΔC', ΔH', S_L, S_C, S_H and R_T of two colours' L*, a* and b*, (6, n), into ``terms``, seven planes.

    Colours beyond 1e60 are changed in place; ten planes of ``scratch`` are written over.
    """
    dL, dC, dH, S_L, S_C, S_H, R_T = terms
    huge = _taken_huge(labs)
    L1, a1, b1, L2, a2, b2 = planes = list(labs)
    A1, A2, C1, C2, dot, cross, x, y, t, u = scratch

    # The paper's G and C', from the chroma of CIELAB.
    _length(a1, b1, x, t)
    _length(a2, b2, y, t)
    x += y
    x *= 0.5
    _per_root_of_seventh_share(x, u, t)
    np.divide(-0.5, u, u)
    u += 1.5
    np.multiply(a1, u, A1)
    np.multiply(a2, u, A2)
    _length(A1, b1, C1, t)
    _length(A2, b2, C2, t)

    # The difference in hue, and the vector of the mean hue.
    np.multiply(A1, A2, dot)
    np.multiply(b1, b2, t)
    dot += t
    np.multiply(A1, b2, cross)
    np.multiply(A2, b1, t)
    cross -= t
    np.multiply(C1, C2, u)
    np.add(u, dot, t)
    t *= 2.0
    np.maximum(t, NO_PRODUCT**2, out=t)
    np.sqrt(t, t)
    np.add(cross, cross, dH)
    dH /= t
    some_C1, some_C2 = np.maximum(C1, NO_CHROMA, out=S_C), np.maximum(C2, NO_CHROMA, out=S_H)
    np.multiply(A1, some_C2, x)
    np.multiply(A2, some_C1, t)
    x += t
    np.multiply(b1, some_C2, y)
    np.multiply(b2, some_C1, t)
    y += t
    np.multiply(u, OPPOSITE, t)
    t -= NO_OPPOSITE
    opposite = np.flatnonzero(dot < t)
    if len(opposite):
        vectors = [plane[opposite] for plane in (A1, b1, some_C1, A2, b2, some_C2)]
        stored = [planes[axis][opposite] for axis in (1, 2, 4, 5)]
        dH[opposite], x[opposite], y[opposite] = _opposite_hues(vectors, stored, dot[opposite], cross[opposite])
    _length(x, y, u, t)
    np.maximum(u, NO_PRODUCT, out=u)
    np.divide(1.0, u, u)
    cosine, sine = np.multiply(x, u, x), np.multiply(y, u, y)

    np.subtract(L2, L1, dL)
    np.subtract(C2, C1, dC)
    C_bar = np.add(C1, C2, C1)
    C_bar *= 0.5
    _polynomial(cosine, T_ODD, S_H)
    S_H *= sine
    S_H += _polynomial(cosine, T_EVEN, t)
    S_H *= C_bar
    S_H *= 0.015
    S_H += 1.0
    np.multiply(C_bar, 0.045, S_C)
    S_C += 1.0
    _rotation(cosine, sine, C_bar, R_T, t, u)
    np.add(L1, L2, t)
    t *= 0.5
    t -= 50.0
    t *= t
    np.multiply(t, 0.015, S_L)
    t += 20.0
    np.sqrt(t, t)
    S_L /= t
    S_L += 1.0
    if huge is not None:
        places, beyond = huge
        for term, values in zip(terms, plain_terms(beyond[:3], beyond[3:]), strict=True):
            term[places] = values


def fast_delta_e(terms: Sequence[Floats], delta_e: Floats, scratch: Sequence[Floats]) -> None:
    """Write ΔE00 of seven terms, planes (n,) each, into ``delta_e``; three planes of ``scratch`` are written over."""
    dL, dC, dH, S_L, S_C, S_H, R_T = terms
    L, C, H = np.divide(dL, S_L, scratch[0]), np.divide(dC, S_C, scratch[1]), np.divide(dH, S_H, scratch[2])
    np.multiply(R_T, C, delta_e)
    delta_e += H
    delta_e *= H
    L *= L
    delta_e += L
    C *= C
    delta_e += C
    np.maximum(delta_e, 0.0, out=delta_e)
    np.sqrt(delta_e, delta_e)


def _taken_huge(labs: Floats) -> tuple[NDArray[np.intp], list[Floats]] | None:
    """Return where colours (6, n) are huge, and what they are; 0 then stands in their place. None if there are none."""
    if np.maximum.reduce(labs, axis=None) <= HUGE and np.minimum.reduce(labs, axis=None) >= -HUGE:
        return None
    places = np.flatnonzero(np.fmax.reduce(np.abs(labs), axis=0) > HUGE)
    beyond = list(labs[:, places])
    labs[:, places] = 0.0
    return places, beyond


def _opposite_hues(
    vectors: Sequence[Floats], stored: Sequence[Floats], dot: Floats, cross: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return ΔH' and the vector of the mean hue of colours with nearly opposite hues: from the difference of the hues.

    ``vectors`` are a', b' and C' of both colours, ``stored`` a* and b* of both.
    """
    A1, b1, C1, A2, b2, C2 = vectors
    way = np.copysign(1.0, cross)
    exact = np.abs(cross) <= -1e-12 * dot
    if exact.any():
        way[exact] = turn(*(plane[exact] for plane in stored))
    return way * np.sqrt(2.0 * (C1 * C2 - dot)), way * (b2 * C1 - b1 * C2), way * (A1 * C2 - A2 * C1)


def _rotation(cosine: Floats, sine: Floats, C_bar: Floats, R_T: Floats, t: Floats, u: Floats) -> None:
    """Write R_T for a mean hue and a mean chroma; ``t`` and ``u`` are written over."""
    # sin²(θ / 4) = ½ − ½ cos(θ / 2), and cos(θ / 2) = √(½ + ½ cos θ), of the angle θ from 275°.
    np.multiply(cosine, 0.5 * COSINE_275, u)
    np.multiply(sine, 0.5 * SINE_275, t)
    u += t
    u += 0.5
    np.maximum(u, 0.0, out=u)
    np.sqrt(u, u)
    u *= -0.5
    u += 0.5
    _polynomial(u, GAUSSIAN_16TH, t)
    for _ in range(4):
        t *= t
    # The paper's hue goes from 0 to 360°: of 0 to 90° it is 185° or more away, however short the way is through 0°.
    t *= (cosine <= 0.0) | (sine < 0.0)
    np.multiply(t, t, u)
    _polynomial(u, TWICE_SINE, R_T)
    R_T *= t
    R_T /= _per_root_of_seventh_share(C_bar, u, t)


def _length(x: Floats, y: Floats, length: Floats, t: Floats) -> None:
    np.multiply(x, x, length)
    np.multiply(y, y, t)
    length += t
    np.sqrt(length, length)


def _per_root_of_seventh_share(chroma: Floats, root: Floats, t: Floats) -> Floats:
    """Write 1 / √(C⁷ / (C⁷ + 25⁷)) = √(1 + (25 / C)⁷) into ``root``, for any chroma without overflow."""
    np.maximum(chroma, 1e-30, out=root)
    np.divide(25.0, root, root)
    np.multiply(root, root, t)
    t *= root
    t *= t
    root *= t
    root += 1.0
    return np.sqrt(root, root)


def _polynomial(x: Floats, coefficients: Sequence[float], out: Floats) -> Floats:
    """Write a polynomial, lowest power first, into ``out`` by Horner's scheme."""
    np.multiply(x, coefficients[-1], out)
    for coefficient in coefficients[-2:0:-1]:
        out += coefficient
        out *= x
    out += coefficients[0]
    return out
