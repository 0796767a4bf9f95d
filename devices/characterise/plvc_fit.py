"""PLVC with pair terms, fitted to what tables with one matrix leave over."""

from __future__ import annotations

import numpy as np

from devices.characterise.parametric import Fitted, condition_of
from devices.characterise.patches import Patches
from devices.characterise.plvc import FUNCTIONS, Plvc, functions_of
from devices.table_curve import TableCurve

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
    functions, _ = functions_of(three, patches.codes, slopes=False)
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
        Plvc(black, three, coefficients),
        tables.free_numbers + 3 * (FUNCTIONS - 3),
        condition_of(whole) if judged else 0.0,
    )
