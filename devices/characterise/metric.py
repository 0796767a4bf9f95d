"""How a small change of XYZ looks: CIELAB's derivatives, and ΔE00 as a length near a colour.

ΔE00 between a colour and a near one is the length of W·ΔLab, W being a square root of the quadratic form that ΔE00² is
near the colour. A fit that makes these lengths small makes ΔE00 small, and weighs the dark end as lightness does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from devices.colour.ciede2000 import delta_e_2000
from documents.arrays import Floats

_DELTA = 6.0 / 29.0
_STEP = 1e-3
_LAB_FROM_BENT = np.array([[0.0, 116.0, 0.0], [500.0, -500.0, 0.0], [0.0, 200.0, -200.0]])


def lab_slopes(XYZ: ArrayLike, white_XYZ: ArrayLike) -> Floats:
    """Return dLab/dXYZ, shape (n, 3, 3), at XYZ, shape (n, 3), against the white (3,); of any sign, in one unit."""
    white = np.asarray(white_XYZ, dtype=np.float64)
    share = np.asarray(XYZ, dtype=np.float64) / white
    bent = np.where(share > _DELTA**3, np.maximum(share, _DELTA**3) ** (-2.0 / 3.0) / 3.0, 1.0 / (3.0 * _DELTA**2))
    return np.asarray(_LAB_FROM_BENT[None] * (bent / white)[:, None, :])


def difference_roots(lab: ArrayLike) -> Floats:
    """Return W, shape (n, 3, 3), with |W·ΔLab| ≈ ΔE00 for small ΔLab about ``lab``, shape (n, 3)."""
    colours = np.asarray(lab, dtype=np.float64)
    steps = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, 0, 1], [0, 1, 1]]) * _STEP
    # Either side of the colour, so that the skewness of ΔE00 cancels.
    moved = colours[:, None, :] + 0.5 * steps[None]
    back = colours[:, None, :] - 0.5 * steps[None]
    square = (delta_e_2000(moved, back) / _STEP) ** 2
    form = np.empty((len(colours), 3, 3))
    for i in range(3):
        form[:, i, i] = square[:, i]
    for k, (i, j) in enumerate(((0, 1), (0, 2), (1, 2)), start=3):
        form[:, i, j] = form[:, j, i] = 0.5 * (square[:, k] - square[:, i] - square[:, j])
    values, vectors = np.linalg.eigh(form)
    return np.asarray(np.sqrt(np.maximum(values, 1e-6))[:, :, None] * np.swapaxes(vectors, 1, 2))
