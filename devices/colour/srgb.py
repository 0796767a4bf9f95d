"""sRGB for pages: how a picture looks to an eye adapted to the display's white."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.colour.spaces import rgb_to_xyz_matrix

Floats = NDArray[np.float64]
# sRGB (IEC 61966-2-1) and the Bradford matrix, with which the display's white is made the page's.
SRGB_RED, SRGB_GREEN, SRGB_BLUE, D65 = (0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290)
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def srgb(xyz: Floats, white_XYZ: Floats) -> Floats:
    """Return sRGB codes in 0..1, clipped, for XYZ (..., 3) seen by an eye adapted to ``white_XYZ`` (3,)."""
    matrix = rgb_to_xyz_matrix(SRGB_RED, SRGB_GREEN, SRGB_BLUE, D65)
    page_white = matrix.sum(axis=1)
    gains = (BRADFORD @ page_white) / (BRADFORD @ white_XYZ)
    adapt = np.linalg.inv(BRADFORD) @ (gains[:, None] * BRADFORD)
    light = np.clip(xyz @ (np.linalg.inv(matrix) @ adapt).T, 0.0, 1.0)
    return np.asarray(np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055))
