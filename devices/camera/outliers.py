"""Patches that do not belong to the rest: saturated, shining, shaded, or not what was measured.

A matrix bends towards an outlier, and most towards the brightest, so that the fit to all cannot tell: the matrix is
first fitted to the half of the colours that agree best (least trimmed squares, [Rousseeuw1984]), and what lies far from
it is left out; those that then are predicted well after all are taken in again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.camera.solve import condition_of
from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

# An outlier is off by more than this many ΔE00, and by more than so many times the median of those kept.
LEAST_OFF = 6.0
TIMES_MEDIAN = 5.0
_DRAWS = 300
_GROWN = 8
_STEPS = 4
_ROUNDS = 10
_JUDGED = 200
_MOST_CONDITION = 1e3


def find_outliers(C: Floats, XYZ: Floats, white: Floats) -> tuple[Bools, Floats]:
    """Return which colours are outliers, (n,), and XYZ (n, 3) as the others let expect.

    Fewer than k + 5 colours, k being the columns of C, do not tell: then none is.
    """
    n, k = C.shape
    lab = xyz_to_lab(XYZ, white)
    none = np.zeros(n, dtype=bool)
    if n < k + 5:
        return none, XYZ
    kept = _best_half(C, XYZ, lab, white)
    seen: set[bytes] = set()
    off = none
    expected = XYZ
    for _ in range(_ROUNDS):
        if condition_of(C[kept]) > _MOST_CONDITION:
            return none, XYZ
        expected = C @ _plain(C[kept], XYZ[kept]).T
        apart = delta_e_2000(xyz_to_lab(expected, white), lab)
        off = apart > max(LEAST_OFF, TIMES_MEDIAN * float(np.median(apart[kept])))
        if off.tobytes() in seen or off.sum() > n - k - 1:
            break
        seen.add(off.tobytes())
        kept = ~off
    return off, expected


def why(expected: Floats, measured: Floats, white: Floats) -> str:
    """Return in words how a patch, (3,), is off."""
    apart = float(delta_e_2000(xyz_to_lab(expected, white), xyz_to_lab(measured, white)))
    times = float(expected[1]) / max(float(measured[1]), 1e-12)
    if times > 1.15:
        return f"specular: the camera saw {times:.2f} × the luminance measured (ΔE00 {apart:.1f})"
    if times < 0.87:
        return f"shaded: the camera saw {max(times, 0.0):.2f} × the luminance measured (ΔE00 {apart:.1f})"
    return f"not the colour measured (ΔE00 {apart:.1f} from what the other patches let expect)"


def _best_half(C: Floats, XYZ: Floats, lab: Floats, white: Floats) -> Bools:
    """Return the half, (n,), whose fit leaves the smallest ΔE00; drawn alike whatever the colours' order.

    Matrices of many small draws are judged at once; the best draws are then grown to halves that agree.
    """
    n, k = C.shape
    order = np.lexsort(np.column_stack([C, XYZ]).T)
    rng = np.random.default_rng(20161)
    judged = order if n <= _JUDGED else order[np.sort(rng.choice(n, _JUDGED, replace=False))]
    half = (len(judged) + k + 1) // 2
    draws = judged[np.argsort(rng.random((_DRAWS, len(judged))), axis=1)[:, : k + 1]]
    lengths = np.linalg.norm(C, axis=0)
    drawn = C[draws] / lengths
    draws = draws[np.linalg.cond(drawn) <= _MOST_CONDITION]
    kept = np.zeros(n, dtype=bool)
    if not len(draws):
        kept[judged[:half]] = True
        return kept
    matrices = np.linalg.pinv(C[draws] / lengths) @ XYZ[draws]
    apart = delta_e_2000(xyz_to_lab(C[judged] / lengths @ matrices, white), lab[judged])
    best, least = judged[:half], np.inf
    for one in np.argsort(np.sort(apart, axis=1)[:, :half].sum(axis=1), kind="stable")[:_GROWN]:
        off = apart[one]
        for _ in range(_STEPS):
            chosen = judged[np.sort(np.argsort(off, kind="stable")[:half])]
            off = delta_e_2000(xyz_to_lab(C[judged] @ _plain(C[chosen], XYZ[chosen]).T, white), lab[judged])
        total = float(np.sort(off)[:half].sum())
        if total < least:
            best, least = chosen, total
    kept[best] = True
    return kept


def _plain(C: Floats, XYZ: Floats) -> Floats:
    M, *_ = np.linalg.lstsq(C, XYZ, rcond=None)
    return np.asarray(M.T)
