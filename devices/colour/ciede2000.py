"""The CIEDE2000 colour difference, and the terms it is made of.

Sharma, Wu & Dalal 2005, "The CIEDE2000 color-difference formula", with its guards: a hue difference of exactly 180°,
and neutral colours that have no hue.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.colour.ciede2000_terms import SCRATCH, TERMS, fast_delta_e, fast_terms
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
