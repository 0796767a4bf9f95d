"""Which way round a chart lies: the way in which one matrix takes its patches' values to their known colours."""

from __future__ import annotations

import numpy as np

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from documents.arrays import Floats

# The median ΔE00 of the best way round; wrong ways give 15 and more.
MOST_OFF = 10.0
# First corner, and direction around the chart, of each way round.
WAYS: dict[str, tuple[int, ...]] = {
    "": (0, 1, 2, 3),
    "upside down": (2, 3, 0, 1),
    "turned a quarter to the right": (1, 2, 3, 0),
    "turned a quarter to the left": (3, 0, 1, 2),
    "mirrored": (1, 0, 3, 2),
    "mirrored upside down": (3, 2, 1, 0),
    "mirrored and turned a quarter to the right": (0, 3, 2, 1),
    "mirrored and turned a quarter to the left": (2, 1, 0, 3),
}


def misfit(rgb: Floats, XYZ: Floats) -> float:
    """Return the median ΔE00 left by the matrix from ``rgb`` (n, 3) to ``XYZ`` (n, 3) that suits best.

    Dark patches weigh as much as bright ones. Infinity where no number comes out.

    Parameters
    ----------
    rgb
        The camera's linear RGB of each patch, shape (n, 3), in any unit.
    XYZ
        The known XYZ of each patch, shape (n, 3), in any unit, in the order of ``rgb``.

    Returns
    -------
    float
        The median ΔE00, at least 0. Above ``MOST_OFF`` the patches lie another way round.

    Examples
    --------
    >>> rgb = np.random.default_rng(1).uniform(0.05, 0.9, (24, 3))
    >>> XYZ = rgb @ np.array([[41.0, 21.0, 2.0], [36.0, 72.0, 12.0], [18.0, 7.0, 95.0]])
    >>> misfit(rgb, XYZ) < 0.001, misfit(rgb[::-1], XYZ) > MOST_OFF
    (True, True)
    """
    weight = 1.0 / np.maximum(XYZ.sum(axis=1, keepdims=True), 1e-3 * XYZ.sum(axis=1).max())
    matrix, *_ = np.linalg.lstsq(rgb * weight, XYZ * weight, rcond=None)
    white = np.maximum(XYZ[np.argmax(XYZ[:, 1])], 1e-9 * XYZ.max())
    apart = delta_e_2000(xyz_to_lab(rgb @ matrix, white), xyz_to_lab(XYZ, white))
    return float(np.median(apart)) if np.all(np.isfinite(apart)) else float("inf")
