"""Colour spaces of CIE 1931 2°: XYZ, xyY, Lab, and the matrix of an RGB space (CIE 15:2018, SMPTE RP 177)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from devices.errors import DeviceError
from documents.arrays import Floats

# Lab is a cube root above this share of white and a straight line below it.
_DELTA = 6.0 / 29.0
# Fewer cube roots are as soon done one by one, and larger numbers are none in single precision.
_FEW, _LARGEST, _AT_A_TIME = 2048, 1e30, 4096


def xyY_from_XYZ(xyz: ArrayLike) -> Floats:
    """Return chromaticity x, y and luminance Y, shape (..., 3), for XYZ, shape (..., 3).

    Black has no chromaticity: where X + Y + Z is 0, x and y are returned as 0.

    Parameters
    ----------
    xyz
        XYZ, shape (..., 3), in any unit.

    Returns
    -------
    ndarray
        x, y and Y, shape (..., 3); Y in the unit of ``xyz``.

    Examples
    --------
    >>> xyY_from_XYZ([95.05, 100.0, 108.88]).round(4).tolist()
    [0.3127, 0.329, 100.0]
    """
    values = np.asarray(xyz, dtype=np.float64)
    total = values.sum(axis=-1, keepdims=True)
    share = np.divide(values, total, out=np.zeros_like(values), where=total != 0)
    return np.concatenate([share[..., :2], values[..., 1:2]], axis=-1)


def XYZ_from_xyY(xyY: ArrayLike) -> Floats:
    """Return XYZ, shape (..., 3), for chromaticity x, y and luminance Y, shape (..., 3).

    Parameters
    ----------
    xyY
        Chromaticity x and y, and luminance Y in any unit, shape (..., 3).

    Returns
    -------
    ndarray
        XYZ, shape (..., 3), in the unit of Y.

    Raises
    ------
    DeviceError
        If y is 0 where Y is not: no light has that chromaticity.

    Examples
    --------
    >>> XYZ_from_xyY([0.25, 0.5, 40.0]).tolist()
    [20.0, 40.0, 20.0]
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

    Parameters
    ----------
    red_xy, green_xy, blue_xy
        Chromaticity x and y of each primary, shape (2,).
    white_xy
        Chromaticity x and y of the white, shape (2,), with y above 0.

    Returns
    -------
    ndarray
        The matrix M, shape (3, 3): XYZ = M · RGB, with Y of the white 1.

    Raises
    ------
    DeviceError
        If a number is not finite, the white has no y, or the primaries lie on one line.

    Examples
    --------
    >>> rgb_to_xyz_matrix([0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290])[1].round(4).tolist()
    [0.2126, 0.7152, 0.0722]
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

    Parameters
    ----------
    xyz
        XYZ, shape (..., 3).
    white_xyz
        XYZ of the white, shape (3,), in the same unit.

    Returns
    -------
    ndarray
        L*, a*, b*, shape (..., 3).

    Raises
    ------
    DeviceError
        If a component of the white is not a finite number above 0.

    Examples
    --------
    >>> xyz_to_lab([47.5, 50.0, 54.5], [95.0, 100.0, 109.0]).round(2).tolist()
    [76.07, 0.0, 0.0]
    """
    values, white = np.asarray(xyz, dtype=np.float64), checked_white(white_xyz)
    if values.size < _FEW:
        bent = _bent(values / white)
        x, y, z = bent[..., 0], bent[..., 1], bent[..., 2]
        return np.stack(_lab_of_bent(x, y, z), axis=-1)
    return np.stack(lab_planes([values[..., axis] for axis in range(3)], white), axis=-1)


def lab_planes(xyz: Sequence[Floats], white_xyz: Floats) -> tuple[Floats, Floats, Floats]:
    """Return L*, a* and b*, each of the shape of the three planes of ``xyz``, against a checked white (3,)."""
    x, y, z = (_bent(plane / white) for plane, white in zip(xyz, white_xyz, strict=True))
    return _lab_of_bent(x, y, z)


def _lab_of_bent(x: Floats, y: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
    return 116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)


def _bent(share: Floats) -> Floats:
    bent = cube_roots(share)
    low = share <= _DELTA**3
    if np.any(low):
        bent = np.where(low, share / (3.0 * _DELTA**2) + 4.0 / 29.0, bent)
    return np.asarray(bent)


def cube_roots(values: Floats) -> Floats:
    """Return the cube roots of values, within three of their last places; of NaN and of 1e-3 or less, anything.

    A root in single precision, exp(log(x) / 3), comes from NumPy's vector loops, and one step of Halley's method cubes
    its relative error of some 1e-7. `numpy.cbrt` takes four times as long: one value at a time.
    """
    if values.size < _FEW or not np.all(values <= _LARGEST):
        return np.asarray(np.cbrt(values))
    roots = np.empty(values.shape)
    given, found = np.ravel(values), roots.reshape(-1)
    # Few at a time: they and what is between stay in the processor's cache.
    guesses, planes = np.empty(_AT_A_TIME, np.float32), np.empty((3, _AT_A_TIME))
    for start in range(0, given.size, _AT_A_TIME):
        part, root = given[start : start + _AT_A_TIME], found[start : start + _AT_A_TIME]
        guess, x, cube, step = (scratch[: part.size] for scratch in (guesses, *planes))
        np.maximum(part, 1e-3, out=x)
        np.copyto(guess, x, casting="same_kind")
        np.log(guess, out=guess)
        guess *= np.float32(1.0 / 3.0)
        np.exp(guess, out=guess)
        np.copyto(root, guess)
        # y (y³ + 2x) / (2y³ + x) = y + y (x − y³) / (2y³ + x)
        np.multiply(root, root, out=cube)
        cube *= root
        np.subtract(x, cube, out=step)
        cube += cube
        cube += x
        step /= cube
        step *= root
        root += step
    return roots


def lab_to_xyz(lab: ArrayLike, white_xyz: ArrayLike) -> Floats:
    """Return XYZ, shape (..., 3), for CIELAB, shape (..., 3), against ``white_xyz``, shape (3,).

    Parameters
    ----------
    lab
        L*, a*, b*, shape (..., 3).
    white_xyz
        XYZ of the white, shape (3,), in any unit.

    Returns
    -------
    ndarray
        XYZ, shape (..., 3), in the unit of the white.

    Raises
    ------
    DeviceError
        If a component of the white is not a finite number above 0.

    Examples
    --------
    >>> lab_to_xyz([50.0, 0.0, 0.0], [95.0, 100.0, 109.0]).round(2).tolist()
    [17.5, 18.42, 20.08]
    """
    values = np.asarray(lab, dtype=np.float64)
    y = (values[..., 0] + 16.0) / 116.0
    bent = np.stack([y + values[..., 1] / 500.0, y, y - values[..., 2] / 200.0], axis=-1)
    share = np.where(bent > _DELTA, bent**3, 3.0 * _DELTA**2 * (bent - 4.0 / 29.0))
    return np.asarray(share * checked_white(white_xyz))


def checked_white(white_xyz: ArrayLike) -> Floats:
    """Return a white as float64, (3,). Raises DeviceError if a component is not a finite number above 0."""
    white = np.asarray(white_xyz, dtype=np.float64)
    if white.shape != (3,) or not np.all(np.isfinite(white)) or np.any(white <= 0):
        raise DeviceError(f"a white needs three finite numbers above 0, not {white.tolist()}")
    return white
