"""Matrix and tabulated curves fitted together, for what the eye sees.

Each channel's curve is its √light at the codes that were measured: free numbers, held together by a penalty on how much
their departure from the best GOG curve bends. They are then made to rise (isotonic regression, which changes nothing
where they rise already) and joined by monotone cubics (Fritsch & Carlson 1980).

PLVC with pair terms is fitted to what these tables and their one matrix leave over.
"""

from __future__ import annotations

from math import comb

import numpy as np

from devices.characterise.descent import descend
from devices.characterise.parametric import Fitted, condition_of
from devices.characterise.patches import Patches
from devices.display.curves import TableCurve
from devices.display.model import DisplayModel
from devices.display.plvc import CROSS, MIXTURES, NODES, PAIRS, Plvc
from documents.arrays import Floats

MOST_ENTRIES = 40
# The least rise of √light over all codes, so that a table can be undone where nothing was measured to rise.
_LEAST_SLOPE = 1e-3
# Weight of the bending penalty; in ΔE00 per change of slope of √light.
STIFFNESS = 10.0
# A channel's light T gets Bernstein's polynomials of √T of this degree, from the third on: they vanish with T, as fast
# as T, and the last, which is 1 at full drive, belongs to the primary.
_DEGREE = 6
_BENDS = range(2, _DEGREE)
FUNCTIONS = 3 + 3 * len(_BENDS) + MIXTURES
# Weight of a term beyond the matrix, in ΔE00 for a term as large as the white.
RIDGE = 10.0
_ROUNDS = 3


def table_codes_of(codes: Floats) -> list[Floats]:
    """Return each channel's codes of the table: those measured, thinned to `MOST_ENTRIES`, with 0 and 1."""
    tables = []
    for channel in range(3):
        own = np.unique(np.concatenate([[0.0, 1.0], codes[:, channel]]))
        if len(own) > MOST_ENTRIES:
            own = np.unique(own[np.round(np.linspace(0, len(own) - 1, MOST_ENTRIES)).astype(int)])
        keep = np.concatenate([[True], np.diff(own) > 1e-6])
        tables.append(own[keep])
    return tables


def fit_table(patches: Patches, begin: DisplayModel, stiffness: float = STIFFNESS, *, judged: bool = True) -> Fitted:
    """Fit tables, starting from ``begin``, a GOGO model of the same patches."""
    unit = patches.white[1]
    black = black_of(patches, begin)
    knots = table_codes_of(patches.codes)
    bases = [hats(patches.codes[:, c], knots[c])[:, 1:-1] for c in range(3)]
    ends = [hats(patches.codes[:, c], knots[c])[:, -1] for c in range(3)]
    start = []
    for c, curve in enumerate(begin.curves):
        low, high = float(curve.linear(0.0)), float(curve.linear(1.0))
        start.append(np.sqrt(np.maximum((np.asarray(curve.linear(knots[c])) - low) / (high - low), 0.0)))
    bends = [stiffness * second_differences(k)[:, 1:-1] for k in knots]
    sizes = [len(k) - 2 for k in knots]
    cuts = np.cumsum([9, *sizes])
    M0 = begin.primaries_XYZ_cd_m2 / unit

    def parts(p: Floats) -> tuple[Floats, list[Floats], Floats]:
        roots = [p[cuts[c] : cuts[c + 1]] for c in range(3)]
        z = np.stack([bases[c] @ roots[c] + ends[c] for c in range(3)], axis=1)
        return p[:9].reshape(3, 3), roots, z

    def residuals(p: Floats) -> Floats:
        M, roots, z = parts(p)
        seen = patches.residuals(black + unit * z**2 @ M.T).ravel()
        bent = [bends[c] @ (roots[c] - start[c][1:-1]) for c in range(3)]
        return np.concatenate([seen, *bent])

    def jacobian(p: Floats) -> Floats:
        M, _, z = parts(p)
        light = z**2
        A = patches.slopes(black + unit * light @ M.T) * unit
        n = len(patches)
        J = np.zeros((3 * n + sum(len(b) for b in bends), len(p)))
        J[: 3 * n, :9] = (A[:, :, :, None] * light[:, None, None, :]).reshape(3 * n, 9)
        by_light = A @ M
        row = 3 * n
        for c in range(3):
            own = (by_light[:, :, c] * 2.0 * z[:, None, c])[:, :, None] * bases[c][:, None, :]
            J[: 3 * n, cuts[c] : cuts[c + 1]] = own.reshape(3 * n, -1)
            J[row : row + len(bends[c]), cuts[c] : cuts[c + 1]] = bends[c]
            row += len(bends[c])
        return J

    p = descend(residuals, jacobian, np.concatenate([M0.ravel(), *[s[1:-1] for s in start]]))
    M, roots, _ = parts(p)
    curves = [rising_curve(knots[c], roots[c]) for c in range(3)]
    model = DisplayModel(black, unit * M, (curves[0], curves[1], curves[2]))
    return Fitted(model, len(p), condition_of(jacobian(p)) if judged else 0.0, {}, ())


def black_of(patches: Patches, begin: DisplayModel) -> Floats:
    """Return the black (3,) that was measured, or that of ``begin`` where none was."""
    measured = bool(np.any(np.all(patches.codes == 0, axis=1)))
    return patches.black if measured else begin.xyz(np.zeros(3))


def hats(codes: Floats, knots: Floats) -> Floats:
    """Weights (n, k) of linear interpolation between ``knots``."""
    piece = np.clip(np.searchsorted(knots, codes, side="right") - 1, 0, len(knots) - 2)
    share = (codes - knots[piece]) / (knots[piece + 1] - knots[piece])
    out = np.zeros((len(codes), len(knots)))
    rows = np.arange(len(codes))
    out[rows, piece] = 1.0 - share
    out[rows, piece + 1] += share
    return out


def second_differences(knots: Floats) -> Floats:
    """Change of slope at each inner knot, (k − 2, k), as a share of the mean spacing."""
    gaps = np.diff(knots)
    out = np.zeros((len(knots) - 2, len(knots)))
    typical = 1.0 / (len(knots) - 1)
    for i in range(len(knots) - 2):
        out[i, i] = typical / gaps[i]
        out[i, i + 2] = typical / gaps[i + 1]
        out[i, i + 1] = -out[i, i] - out[i, i + 2]
    return out


def rising_curve(knots: Floats, inner: Floats) -> TableCurve:
    """Return the curve whose roots of light at ``knots`` (k,) are 0, ``inner`` (k − 2,) and 1, made to rise."""
    z = rising_averages(np.concatenate([[0.0], np.clip(inner, 0.0, 1.0), [1.0]]))
    z = (1.0 - _LEAST_SLOPE) * (z - z[0]) / (z[-1] - z[0]) + _LEAST_SLOPE * knots
    z[0], z[-1] = 0.0, 1.0
    return TableCurve(tuple(knots.tolist()), tuple((z**2).tolist()))


def rising_averages(values: Floats) -> Floats:
    """Return the rising numbers (n,) nearest to ``values`` (n,) in squares: neighbours that fall are averaged.

    Isotonic regression by pooling adjacent violators; SciPy's `isotonic_regression` is the twin in the tests.
    """
    sums: list[float] = []
    counts: list[int] = []
    for value in values.tolist():
        sums.append(value)
        counts.append(1)
        while len(sums) > 1 and sums[-2] * counts[-1] >= sums[-1] * counts[-2]:
            last, many = sums.pop(), counts.pop()
            sums[-1] += last
            counts[-1] += many
    return np.repeat(np.array(sums) / np.array(counts), counts)


def fit_plvc(patches: Patches, tables: Fitted, *, judged: bool = True) -> tuple[Plvc, int, float]:
    """Return the model on the curves of ``tables``, how many numbers it has, and the condition of its equations.

    The terms are linear: weighted least squares in ΔE00, reweighted for a soft L1 loss, with a ridge on what goes
    beyond black, curves and matrix, so that nothing is made of noise.
    """
    model = tables.model
    three = curves_of(model)
    unit = float(patches.white[1])
    light = np.stack([curve.linear(patches.codes[:, i]) for i, curve in enumerate(three)], axis=1)
    functions = functions_of(light)
    coefficients = np.zeros((FUNCTIONS, 3))
    coefficients[:3] = model.primaries_XYZ_cd_m2.T
    black = model.black_XYZ_cd_m2
    ridge = np.zeros((FUNCTIONS, 3))
    ridge[3:] = RIDGE
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


def curves_of(model: DisplayModel) -> tuple[TableCurve, TableCurve, TableCurve]:
    """Return the curves of a model of tables."""
    red, green, blue = (curve for curve in model.curves if isinstance(curve, TableCurve))
    return red, green, blue


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
