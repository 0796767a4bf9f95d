"""The CIEDE2000 colour difference, and the terms it is made of.

Sharma, Wu & Dalal 2005, "The CIEDE2000 color-difference formula", with its guards: a hue difference of exactly 180°,
and neutral colours that have no hue. `plain_terms` has the terms as they stand there: what the fast ones are tested
against, and what takes colours that are too large to be squared. What is otherwise in `fast_terms`:

- With the dot and the cross product of the hue vectors, ΔH' = 2·cross / √(2(C'₁C'₂ + dot)), and the mean hue points
  along a'₁C'₂ + a'₂C'₁, b'₁C'₂ + b'₂C'₁. Of hues that are nearly opposite both would cancel: those few are gathered.
- T is a polynomial in the cosine and the sine of the mean hue h.
- R_T's Gaussian of the angle from 275° is the 16th power of a polynomial in sin²(angle / 4); its sine, a series.

Many colours are computed by compiled loops of the same formulas, `ciede2000_loops`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.colour.spaces import checked_white, lab_planes
from devices.errors import DeviceError
from documents import in_threads
from documents.arrays import Floats
from documents.compiled import loops

Planes = Sequence[Floats]

# Colours worked on at a time: few enough for the processor's cache, enough that NumPy's own overhead does not show.
_BLOCK = 32768
# Colours that a thread takes at a time: some milliseconds of work.
_SHARE = 4 * _BLOCK
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
# A chroma that is as good as none for the plain terms, and whose square is no underflow.
_LEAST_CHROMA = 1e-150


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
    return _differences(first, second, None, len(first)).reshape(shape)


def delta_e_2000_of_xyz(xyz1: ArrayLike, xyz2: ArrayLike, white_xyz: ArrayLike, *, of: int | None = None) -> Floats:
    """Return the CIEDE2000 difference, shape (...), between XYZ, shape (..., 3), broadcast together, against a white.

    The same as `delta_e_2000` of `xyz_to_lab` of both, in three quarters of the time: CIELAB stays in the processor's
    cache.

    Parameters
    ----------
    xyz1, xyz2
        XYZ in one unit, shape (..., 3), broadcast together.
    white_xyz
        XYZ of the white, shape (3,), in the same unit.
    of
        The number of colours in all, if these are a part of a picture's: that of its pixels decides whether compiled
        loops do it, and all its parts are then done in one way.

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
    return _differences(first, second, white, of or len(first)).reshape(shape)


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

    def work(part: slice, planes: Floats, n: int) -> None:
        terms, scratch = _terms(planes, n, None)
        fast_delta_e(terms, parts[0, part], scratch)
        for term, values in zip(parts[1:], terms, strict=True):
            term[part] = values

    _by_blocks(first, second, work)
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


def _differences(first: NDArray[np.floating], second: NDArray[np.floating], white: Floats | None, of: int) -> Floats:
    """Return ΔE00 of colours (n, 3), a part ``of`` so many: of CIELAB, or of XYZ if with a white."""
    out = np.empty(len(first))

    def in_numpy(part: slice, planes: Floats, n: int) -> None:
        terms, scratch = _terms(planes, n, white)
        fast_delta_e(terms, out[part], scratch)

    compiled = loops("devices.colour.ciede2000_loops", of)
    if compiled is None:
        _by_blocks(first, second, in_numpy)
        return out

    def in_loops(part: slice, planes: Floats, n: int) -> None:
        left = np.empty(n, dtype=np.bool_)
        if white is not None:
            compiled.lab_of_xyz(planes, n, white)
        compiled.delta_e(planes, n, out[part], left)
        if left.any():
            places = np.flatnonzero(left)
            out[part][places] = _differences(first[part][places], second[part][places], white, 0)

    _by_blocks(first, second, in_loops)
    return out


def _terms(planes: Floats, n: int, white: Floats | None) -> tuple[Planes, Planes]:
    """Return the terms of colours, (6, n) in the first planes, and planes to write over; XYZ if with a white."""
    labs, rest = planes[:6, :n], list(planes[6:, :n])
    if white is not None:
        for lab in (labs[:3], labs[3:]):
            for plane, values in zip(lab, lab_planes(list(lab), white), strict=True):
                plane[:] = values
    terms, scratch = rest[:TERMS], rest[TERMS:]
    fast_terms(labs, terms, scratch)
    return terms, scratch


def _by_blocks(
    first: NDArray[np.floating], second: NDArray[np.floating], work: Callable[[slice, Floats, int], None]
) -> None:
    """Call ``work`` with each part of colours (n, 3), with planes of which the first six hold it, and with its size.

    Many colours are shared among threads.
    """
    count = len(first)
    unused: list[Floats] = []

    def take(share: slice) -> None:
        # Memory that a thread has used already: new memory must be cleared by the system, page by page.
        planes = unused.pop() if unused else np.empty((6 + TERMS + SCRATCH, min(_BLOCK, count)))
        for start in range(share.start, share.stop, _BLOCK):
            part = slice(start, min(start + _BLOCK, share.stop))
            n = part.stop - part.start
            planes[:3, :n], planes[3:6, :n] = first[part].T, second[part].T
            work(part, planes, n)
        unused.append(planes)

    in_threads(take, [slice(start, min(start + _SHARE, count)) for start in range(0, count, _SHARE)])


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


def plain_terms(first: Sequence[Floats], second: Sequence[Floats]) -> tuple[Floats, ...]:
    """ΔL', ΔC', ΔH', S_L, S_C, S_H and R_T of colours' L*, a* and b*, (n,) each, in the paper's symbols.

    Hues are carried as unit vectors, which spares the sines and cosines that cost most: their sum points along the
    mean hue, their difference at right angles to it, and half the length of the difference is sin(Δh / 2). The mean
    is taken from the longer of the two, so that nothing cancels near 180°.
    """
    L1, a1, b1 = first
    L2, a2, b2 = second
    C_bar = 0.5 * (_chroma(a1, b1) + _chroma(a2, b2))
    G = 1.5 - 0.5 * np.sqrt(_seventh_share(C_bar))  # the paper's 1 + G
    way = turn(a1, b1, a2, b2)
    a1, a2 = a1 * G, a2 * G
    C1, C2 = _chroma(a1, b1), _chroma(a2, b2)
    C_bar = 0.5 * (C1 + C2)
    # A neutral colour has the vector 0: the mean hue is then the other's, as in the paper.
    per_C1, per_C2 = 1.0 / np.maximum(C1, _LEAST_CHROMA), 1.0 / np.maximum(C2, _LEAST_CHROMA)
    x1, y1, x2, y2 = a1 * per_C1, b1 * per_C1, a2 * per_C2, b2 * per_C2
    across_x, across_y = x2 - x1, y2 - y1
    half_chord = 0.5 * _chroma(across_x, across_y)
    delta_H = 2.0 * np.sqrt(C1 * C2) * half_chord * way
    wide = half_chord > np.sqrt(0.5)
    cos_h = np.where(wide, way * across_y, x1 + x2)
    sin_h = np.where(wide, -way * across_x, y1 + y2)
    norm = 1.0 / np.maximum(_chroma(cos_h, sin_h), _LEAST_CHROMA)
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


def _chroma(x: Floats, y: Floats) -> Floats:
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
