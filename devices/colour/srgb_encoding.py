"""sRGB (IEC 61966-2-1): its tone curve, and pictures and swatches for pages and sheets."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from devices.colour.adaptation import bradford_matrix
from devices.colour.spaces import rgb_to_xyz_matrix
from documents.arrays import Floats

SRGB_PRIMARIES_XY = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
DISPLAY_P3_PRIMARIES_XY = ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060))
D65_XY = (0.3127, 0.3290)
_STRAIGHT_TO = 0.0031308  # of light


def srgb(xyz: ArrayLike, white_XYZ: ArrayLike | None = None) -> Floats:
    """Return XYZ as sRGB.

    Parameters
    ----------
    xyz
        XYZ, shape (..., 3), in the unit of the white.
    white_XYZ
        XYZ of the white, shape (3,), that the eye is adapted to. It becomes the page's white by Bradford's transform.
        None: the page's own white, D65 with Y = 1.

    Returns
    -------
    ndarray
        sRGB codes in 0..1, shape (..., 3). Colours outside the gamut are clipped.

    Examples
    --------
    >>> srgb([96.42, 100.0, 82.52], [96.42, 100.0, 82.52]).round(6).tolist()
    [1.0, 1.0, 1.0]
    """
    light = np.clip(np.asarray(xyz, dtype=np.float64) @ linear_srgb_matrix(white_XYZ).T, 0.0, 1.0)
    return srgb_encoded(light)


def linear_srgb_matrix(white_XYZ: ArrayLike | None = None) -> Floats:
    """Return the matrix (3, 3) from XYZ to linear sRGB for which the white is RGB (1, 1, 1).

    Parameters
    ----------
    white_XYZ
        XYZ of the white, shape (3,), that the eye is adapted to. It becomes D65 by Bradford's transform.
        None: D65 with Y = 1.

    Returns
    -------
    ndarray
        The matrix M, shape (3, 3): RGB = M · XYZ; colours outside the gamut of sRGB lie outside 0..1 [IEC1999].

    Examples
    --------
    >>> (linear_srgb_matrix([96.42, 100.0, 82.52]) @ [96.42, 100.0, 82.52]).round(6).tolist()
    [1.0, 1.0, 1.0]
    """
    matrix = rgb_to_xyz_matrix(*SRGB_PRIMARIES_XY, D65_XY)
    linear_from_XYZ = np.linalg.inv(matrix)
    if white_XYZ is None:
        return np.asarray(linear_from_XYZ)
    return np.asarray(linear_from_XYZ @ bradford_matrix(white_XYZ, matrix.sum(axis=1)))


def srgb_encoded(light: ArrayLike) -> Floats:
    """Return the codes of linear light by sRGB's tone curve.

    Parameters
    ----------
    light
        Linear light as a share of full, of any shape; below 0 the straight start goes on.

    Returns
    -------
    ndarray
        Codes, 0..1 for light in 0..1, of the same shape [IEC1999].

    Examples
    --------
    >>> srgb_encoded([0.0, 0.5, 1.0]).round(6).tolist()
    [0.0, 0.735357, 1.0]
    """
    linear = np.asarray(light, dtype=np.float64)
    curved = 1.055 * np.maximum(linear, _STRAIGHT_TO) ** (1 / 2.4) - 0.055
    return np.asarray(np.where(linear <= _STRAIGHT_TO, 12.92 * linear, curved))


def srgb_decoded(code: ArrayLike) -> Floats:
    """Return the linear light of codes by sRGB's tone curve: undoes `srgb_encoded`.

    Parameters
    ----------
    code
        Codes of any shape, 1 for full; below 0 the straight start goes on.

    Returns
    -------
    ndarray
        Linear light as a share of full, of the same shape [IEC1999].

    Examples
    --------
    >>> srgb_decoded([0.0, 0.5, 1.0]).round(6).tolist()
    [0.0, 0.214041, 1.0]
    """
    codes = np.asarray(code, dtype=np.float64)
    curved = ((np.maximum(codes, 0.0) + 0.055) / 1.055) ** 2.4
    return np.asarray(np.where(codes <= 12.92 * _STRAIGHT_TO, codes / 12.92, curved))
