"""PLVC and a smooth residual fitted together, with as many knots, as wide and as stiff as the readings ask for.

Knots are readings far from each other in the root of light. Their number, the kernels' width and the weight of the
kernels' norm are those with the least mean ΔE00 of every reading by the fit without it, which for linear least squares
is known from the fit with all [Allen1974]: nothing but the readings that are fitted has a say.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from devices.characterise.patches import Patches
from devices.characterise.table_fit import FUNCTIONS, RIDGE, curves_of, functions_of, plvc_of
from devices.display.plvc import Plvc
from devices.display.residual import Residual, gram, kernels, place_of

Floats = NDArray[np.float64]

KNOTS, WIDTHS, STIFFNESSES = (8, 24, 48), (0.875, 1.75), (1.0, 4.0, 16.0)
# Knots lie on a grid of this many steps, whose places floats hold exactly.
_STEPS = 1024.0
# More readings than this have no say in these three, for the time's sake.
_MOST_JUDGED = 400
_ROUNDS = 3
_SMALL = 1e-10


def fit_residual(patches: Patches, plvc: Plvc, free_numbers: int) -> tuple[Plvc, int]:
    """Return ``plvc``, fitted to ``patches`` with ``free_numbers``, with a residual fitted along, and its numbers.

    Of the settings the best by the readings left out is taken whose model can be undone; the stiffest if none can.
    """
    curves = curves_of(plvc)
    light = np.stack([curve.linear(patches.codes[:, i]) for i, curve in enumerate(curves)], axis=1)
    functions = functions_of(light)
    unit = float(patches.white[1])
    start = plvc.xyz_of_linear(light)
    spread = knots_among(light, max(KNOTS))
    judged = np.arange(len(patches))
    if len(judged) > _MOST_JUDGED:
        judged = np.unique(np.round(np.linspace(0, len(judged) - 1, _MOST_JUDGED)).astype(int))
    A, target = _linearised(patches.select(judged), start[judged], unit, plvc.black_XYZ_cd_m2)
    scores = []
    for count, width in product(KNOTS, WIDTHS):
        knots = spread[:count]
        J = _columns(A, np.concatenate([functions[judged], kernels(light[judged], knots, width)], axis=1))
        for stiffness in STIFFNESSES:
            left = _left_out(J, target, _penalty(knots, width, stiffness))
            scores.append((float(np.sqrt((left.reshape(-1, 3) ** 2).sum(axis=1)).mean()), count, width, stiffness))
    best = None
    for _, count, width, stiffness in sorted(scores):
        knots = spread[:count]
        model = _fitted(patches, plvc, functions, kernels(light, knots, width), start, knots, width, stiffness)
        if not model.clashes():
            best = model, count
            break
    if best is None:
        best = model, count
    return best[0], free_numbers + 3 * best[1] + 2


def knots_among(light: Floats, most: int) -> Floats:
    """Return ``most`` places (k, 3) at most, each of a reading's light (n, 3), as far from each other as can be."""
    places: Floats = np.unique(np.round(_STEPS * place_of(np.clip(light, 0.0, 1.0))) / _STEPS, axis=0)
    chosen = [int(np.argmax(places.sum(axis=1)))]
    far = np.linalg.norm(places - places[chosen[0]], axis=1)
    while len(chosen) < min(most, len(places)) and far.max() > 0.0:
        chosen.append(int(np.argmax(far)))
        far = np.minimum(far, np.linalg.norm(places - places[chosen[-1]], axis=1))
    return places[chosen]


def _fitted(
    patches: Patches,
    plvc: Plvc,
    functions: Floats,
    more: Floats,
    XYZ: Floats,
    knots: Floats,
    width: float,
    stiffness: float,
) -> Plvc:
    unit = float(patches.white[1])
    both = np.concatenate([functions, more], axis=1)
    penalty = _penalty(knots, width, stiffness)
    coefficients = np.zeros((both.shape[1], 3))
    for _ in range(_ROUNDS):
        A, target = _linearised(patches, XYZ, unit, plvc.black_XYZ_cd_m2)
        J = _columns(A, both)
        coefficients = unit * np.linalg.solve(J.T @ J + penalty, J.T @ target).reshape(-1, 3)
        XYZ = plvc.black_XYZ_cd_m2 + both @ coefficients
    base = plvc_of(plvc.black_XYZ_cd_m2, curves_of(plvc), coefficients[:FUNCTIONS])
    residual = Residual(knots, width, coefficients[FUNCTIONS:])
    return Plvc(
        base.black_XYZ_cd_m2,
        base.primaries_XYZ_cd_m2,
        base.curves,
        base.XYZ_per_light_cd_m2,
        base.mixtures_XYZ_cd_m2,
        residual,
    )


def _linearised(patches: Patches, XYZ: Floats, unit: float, black: Floats) -> tuple[Floats, Floats]:
    """Return ΔE00's slopes (n, 3, 3) by light in units of white's Y, and what they are to give (3n,), about ``XYZ``."""
    left = patches.residuals(XYZ)
    weight = (1.0 + left**2) ** -0.25
    A = patches.slopes(XYZ) * unit * weight[:, :, None]
    target = np.einsum("nix,nx->ni", A, (XYZ - black) / unit) - weight * left
    return A, target.ravel()


def _columns(A: Floats, functions: Floats) -> Floats:
    return (A[:, :, None, :] * functions[:, None, :, None]).reshape(3 * len(A), -1)


def _penalty(knots: Floats, width: float, stiffness: float) -> Floats:
    """Return the ridge of PLVC's terms, and the kernels' norm with ``stiffness``, for all coefficients."""
    count = len(knots)
    out = np.zeros((FUNCTIONS + count, FUNCTIONS + count))
    terms = np.arange(3, FUNCTIONS)
    out[terms, terms] = RIDGE**2
    norm = gram(knots, width)
    out[FUNCTIONS:, FUNCTIONS:] = stiffness**2 * norm
    return np.kron(out, np.eye(3)) + _SMALL * np.eye(3 * len(out))


def _left_out(J: Floats, target: Floats, penalty: Floats) -> Floats:
    """Return what the fit to all other readings leaves of each, (3n,): (I − H)⁻¹ · what the fit to all leaves."""
    inverse = np.linalg.inv(J.T @ J + penalty)
    left = target - J @ (inverse @ (J.T @ target))
    own = J.reshape(-1, 3, J.shape[1])
    hats = np.einsum("nip,njp->nij", own @ inverse, own)
    return np.linalg.solve(np.eye(3) - hats, left.reshape(-1, 3, 1)).ravel()
