"""The matrix of thesis Expressions 4.4 to 4.8 by least squares, in XYZ or in ΔE00.

Expression 4.8 is printed as M = (CᵀC)⁻¹(CᵀU); with U = C·Mᵀ (Expression 4.6) that is Mᵀ, and M is what is returned
here. It is found by orthogonal factors of C rather than by the inverse, which would square the condition number.

Patches may not belong to the rest: saturated, shining, shaded, or not what was measured. A matrix bends towards an
outlier, and most towards the brightest, so that the fit to all does not reveal it. The matrix is first fitted to the
half of the colours that agree best (least trimmed squares, [Rousseeuw1984]), and what lies far from it is left out;
patches that are then predicted well are included again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from devices.camera.camera_model import Form
from devices.characterise.metric import difference_roots
from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from documents.arrays import Floats

Loss = Literal["xyz", "delta-e"]
_TINY = 1e-9
_ONE_BY_ONE = 200
_GROUPS = 20
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


@dataclass(frozen=True, slots=True, eq=False)
class CameraSolution:
    """``M``, shape (3, 3) or (3, 4), its standard errors of the same shape, and the condition number of C.

    The condition number is that of C with columns of unit length. Standard errors are NaN where there are no more
    colours than unknowns.
    """

    M: Floats
    standard_errors: Floats
    condition: float


def design(rgb: Floats, form: Form) -> Floats:
    """Return C of Expression 4.6: RGB (n, 3), with a column of ones behind it for the affine form."""
    return np.column_stack([rgb, np.ones(len(rgb))]) if form == "affine" else rgb


def condition_of(C: Floats) -> float:
    """Return the condition number of C with columns of unit length; infinite if a column is zero."""
    lengths = np.linalg.norm(C, axis=0)
    if not np.all(lengths > 0):
        return float("inf")
    return float(np.linalg.cond(C / lengths))


def solve(C: Floats, XYZ: Floats, loss: Loss, white: Floats, start: Floats | None = None) -> CameraSolution:
    """Return M with XYZ ≈ C·Mᵀ, for C (n, k) of rank k and XYZ (n, 3).

    ``xyz`` minimises the sum of squares in XYZ; ``delta-e`` that of ΔE00 against ``white`` (3,), from ``start`` (3, k)
    or from the former.
    """
    lengths = np.linalg.norm(C, axis=0)
    scaled = C / lengths
    n, k = C.shape
    q, r = np.linalg.qr(scaled)
    plain: Floats = np.linalg.solve(r, q.T @ XYZ).T
    if loss == "xyz":
        variance = ((XYZ - scaled @ plain.T) ** 2).sum(axis=0) / (n - k) if n > k else np.full(3, np.nan)
        spread = np.sum(np.linalg.inv(r) ** 2, axis=1)
        errors = np.sqrt(variance[:, None] * spread[None])
        return CameraSolution(plain / lengths, errors / lengths, condition_of(C))
    begin = plain if start is None else start * lengths
    best, jacobian, left = _least_delta_e(scaled, XYZ, white, begin)
    if n > k:
        # Colours differ in what their ΔE00 is worth: the sandwich of [White1980] over colours, corrected for few.
        bread = np.linalg.pinv(jacobian.T @ jacobian)
        pull = np.einsum("nip,ni->np", jacobian.reshape(n, 3, -1), left.reshape(n, 3))
        variance = np.diag(bread @ (pull.T @ pull) @ bread) * n / (n - k)
        errors = np.sqrt(np.maximum(variance, 0)).reshape(3, k)
    else:
        errors = np.full((3, k), np.nan)
    return CameraSolution(best / lengths, errors / lengths, condition_of(C))


def _least_delta_e(C: Floats, XYZ: Floats, white: Floats, start: Floats) -> tuple[Floats, Floats, Floats]:
    """Return M, the Jacobian and the residuals at the least sum of ΔE00²."""
    from scipy.optimize import least_squares

    lab = xyz_to_lab(XYZ, white)
    roots = difference_roots(lab)
    size = float(np.abs(start).max())

    def residuals(numbers: Floats) -> Floats:
        # A vector for each colour, as long as its ΔE00 and smooth where that is 0.
        estimated = xyz_to_lab(C @ (numbers.reshape(start.shape) * size).T, white)
        near = np.einsum("nij,nj->ni", roots, estimated - lab)
        length = np.linalg.norm(near, axis=1)
        exact = delta_e_2000(estimated, lab)
        share = np.divide(exact, length, out=np.ones_like(exact), where=length > _TINY)
        return np.asarray((near * share[:, None]).ravel())

    result = least_squares(residuals, start.ravel() / size, x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12)
    return result.x.reshape(start.shape) * size, np.asarray(result.jac) / size, np.asarray(result.fun)


def left_out_xyz(
    C: Floats, XYZ: Floats, loss: Loss, white: Floats, fitted: CameraSolution, names: Sequence[str] = ()
) -> Floats:
    """Return XYZ (n, 3) of each colour as estimated by the fit to all others; NaN where those do not determine M.

    In XYZ it follows from the one fit: an error left out is e / (1 − h), h being the colour's leverage. In ΔE00 each is
    fitted again; more than 200 are left out in twenty groups. Where ``names`` repeat, those of one name are left out
    together.
    """
    out = np.full_like(XYZ, np.nan)
    if len(set(names)) < len(names):
        named = [np.array([other == name for other in names]) for name in dict.fromkeys(names)]
        for own in named:
            if np.linalg.matrix_rank(C[~own]) == C.shape[1]:
                out[own] = C[own] @ solve(C[~own], XYZ[~own], loss, white, fitted.M).M.T
        return out
    q, _ = np.linalg.qr(C / np.linalg.norm(C, axis=0))
    leverage = np.sum(q * q, axis=1)
    lone = 1.0 - leverage < 1e-10
    if loss == "xyz":
        error = XYZ - C @ fitted.M.T
        return np.asarray(XYZ - error / np.where(lone, np.nan, 1.0 - leverage)[:, None])
    for group in _groups(C, XYZ, ~lone):
        others = np.ones(len(C), dtype=bool)
        others[group] = False
        out[group] = C[group] @ solve(C[others], XYZ[others], loss, white, fitted.M).M.T
    return out


def _groups(C: Floats, XYZ: Floats, known: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """Return what is left out together: each by itself, or, where that would take long, twenty groups."""
    rows = np.flatnonzero(known)
    if len(rows) <= _ONE_BY_ONE:
        return list(rows[:, None])
    # By the colours' own order, so that it does not matter how they were listed.
    ordered = rows[np.lexsort(np.column_stack([C[rows], XYZ[rows]]).T)]
    return [ordered[start::_GROUPS] for start in range(_GROUPS)]


def find_outliers(C: Floats, XYZ: Floats, white: Floats) -> tuple[Bools, Floats]:
    """Return which colours are outliers, (n,), and XYZ (n, 3) as the others let expect.

    Fewer than k + 5 colours, k being the columns of C, are too few: then none is.
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
    for draw in np.argsort(np.sort(apart, axis=1)[:, :half].sum(axis=1), kind="stable")[:_GROWN]:
        off = apart[draw]
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
