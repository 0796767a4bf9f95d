"""PLVC with pair terms, fitted to what tables with one matrix leave over."""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray

from devices.characterise.parametric import Fitted, condition_of
from devices.characterise.patches import Patches
from devices.display.plvc import CROSS, MIXTURES, NODES, PAIRS, Plvc
from devices.display.table_curve import TableCurve

Floats = NDArray[np.float64]

# A channel's light T gets Bernstein's polynomials of √T of this degree, from the third on: they vanish with T, as fast
# as T, and the last, which is 1 at full drive, belongs to the primary.
_DEGREE = 6
_BENDS = range(2, _DEGREE)
FUNCTIONS = 3 + 3 * len(_BENDS) + MIXTURES
# Weight of a term beyond the matrix, in ΔE00 for a term as large as the white.
_RIDGE = 10.0
_ROUNDS = 3


def fit_plvc(patches: Patches, tables: Fitted, *, judged: bool = True) -> tuple[Plvc, int, float]:
    """Return the model on the curves of ``tables``, how many numbers it has, and the condition of its equations.

    The terms are linear: weighted least squares in ΔE00, reweighted for a soft L1 loss, with a ridge on what goes
    beyond black, curves and matrix, so that nothing is made of noise.
    """
    model = tables.model
    curves = tuple(curve for curve in model.curves if isinstance(curve, TableCurve))
    assert len(curves) == 3
    three = (curves[0], curves[1], curves[2])
    unit = float(patches.white[1])
    light = np.stack([curve.linear(patches.codes[:, i]) for i, curve in enumerate(three)], axis=1)
    functions = functions_of(light)
    coefficients = np.zeros((FUNCTIONS, 3))
    coefficients[:3] = model.primaries_XYZ_cd_m2.T
    black = model.black_XYZ_cd_m2
    ridge = np.zeros((FUNCTIONS, 3))
    ridge[3:] = _RIDGE
    rows = np.diag(ridge.ravel())[ridge.ravel() > 0]
    whole = np.zeros((1, 1))
    for _ in range(_ROUNDS):
        XYZ = black + functions @ coefficients
        left = patches.residuals(XYZ)
        weight = (1.0 + left**2) ** -0.25
        A = patches.slopes(XYZ) * unit * weight[:, :, None]
        J = np.einsum("nix,nf->nifx", A, functions).reshape(3 * len(patches), FUNCTIONS * 3)
        target = J @ (coefficients / unit).ravel() - (weight * left).ravel()
        whole = np.concatenate([J, rows])
        wanted = np.concatenate([target, np.zeros(len(rows))])
        # Normal equations: the ridge keeps them well conditioned, and they are many times as fast as lstsq.
        coefficients = unit * np.linalg.solve(
            whole.T @ whole + 1e-10 * np.eye(whole.shape[1]), whole.T @ wanted
        ).reshape(FUNCTIONS, 3)
    return (
        plvc_of(black, three, coefficients),
        tables.free_numbers + 3 * (FUNCTIONS - 3),
        condition_of(whole) if judged else 0.0,
    )


def plvc_of(black: Floats, curves: tuple[TableCurve, TableCurve, TableCurve], coefficients: Floats) -> Plvc:
    """Return the model whose light above black is Φ · ``coefficients`` (FUNCTIONS, 3), in cd/m²."""
    bends = coefficients[3 : 3 + 3 * len(_BENDS)].reshape(3, len(_BENDS), 3)
    shares = np.stack([_bend(np.array(NODES), k) for k in _BENDS], axis=1)
    per_light = coefficients[:3, np.newaxis] + np.einsum("nk,ckx->cnx", shares, bends)
    return Plvc(black, coefficients[:3].T, curves, per_light, coefficients[3 + 3 * len(_BENDS) :])


def functions_of(light: Floats) -> Floats:
    """Return Φ, shape (n, FUNCTIONS), at the channels' light (n, 3): each channel's own, bends, then mixtures."""
    z = np.sqrt(light)
    bends = [light[:, c] * _bend(z[:, c], k) for c in range(3) for k in _BENDS]
    pairs = [light[:, i] * light[:, j] for i, j in PAIRS]
    # A channel's middle levels while another shines.
    cross = [light[:, i] * (1.0 - light[:, i]) * light[:, j] for i, j in CROSS]
    return np.concatenate([light, np.stack([*bends, *pairs, light.prod(axis=1), *cross], axis=1)], axis=1)


def _bend(z: Floats, k: int) -> Floats:
    """Return Bernstein's polynomial ``k`` over z²."""
    return np.asarray(comb(_DEGREE, k) * z ** (k - 2) * (1.0 - z) ** (_DEGREE - k))
