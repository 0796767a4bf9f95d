"""sRGB (IEC 61966-2-1): pictures and swatches for pages and sheets."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.colour.spaces import bradford_matrix, rgb_to_xyz_matrix

Floats = NDArray[np.float64]
SRGB_PRIMARIES_XY = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
_D65_XY = (0.3127, 0.3290)


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
    matrix = rgb_to_xyz_matrix(*SRGB_PRIMARIES_XY, _D65_XY)
    linear_from_XYZ = np.linalg.inv(matrix)
    if white_XYZ is not None:
        linear_from_XYZ = linear_from_XYZ @ bradford_matrix(white_XYZ, matrix.sum(axis=1))
    light = np.clip(np.asarray(xyz, dtype=np.float64) @ linear_from_XYZ.T, 0.0, 1.0)
    return np.asarray(np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055))
