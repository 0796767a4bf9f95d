"""A tabled curve as the fragment shader inverts it: piece by piece, as exactly as 32 bits are.

Between two entries of a `devices.table_curve.TableCurve`, √light is a cubic of the code. Scaled to 0..1 on either side,
it is v = ((a·u + b)·u + c)·u, which Newton's method between brackets undoes. The one table of `devices.code_table` is
twice as fast, but where a curve is flat, as below a CRT's cut-off, it errs by whole codes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devices.display import DisplayModel
from devices.table_curve import TableCurve

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
# Of a piece: √light where it begins, its rise, the code where it begins, its rise, a, b, c, and nothing.
NUMBERS = 8
MOST_STEPS = 24
_BEYOND = 2.0


def knot_tables(curves: Sequence[TableCurve]) -> Singles:
    """Return the pieces of ``curves``, shape (curves, pieces of the longest, 8); shorter ones end in pieces at 2."""
    found = [_pieces(curve) for curve in curves]
    tables = np.zeros((len(found), max(len(pieces) for pieces in found), NUMBERS))
    tables[:, :, 0] = _BEYOND
    tables[:, :, 1] = 1.0
    for row, pieces in enumerate(found):
        tables[row, : len(pieces)] = pieces
    return tables.astype(np.float32)


def _pieces(curve: TableCurve) -> Floats:
    cubic = np.asarray(curve.cubics[1])
    codes, roots = np.asarray(curve.codes), np.sqrt(curve.light)
    width, rise = np.diff(codes), np.diff(roots)
    scaled = [cubic[power] * width ** (3 - power) / rise for power in range(3)]
    return np.stack([roots[:-1], rise, codes[:-1], width, *scaled, np.zeros(len(width))], axis=1)


def knot_codes(light: Singles, table: Singles) -> Singles:
    """Return codes (n,) for light (n,) by ``table`` (pieces, 8), in 32 bits: the NumPy twin of ``knots.glsl``."""
    root = np.sqrt(light.astype(np.float32))
    piece = table[np.clip(np.searchsorted(table[:, 0], root, side="right") - 1, 0, len(table) - 1)]
    wanted = np.clip((root - piece[:, 0]) / piece[:, 1], np.float32(0), np.float32(1))
    a, b, c = piece[:, 4], piece[:, 5], piece[:, 6]
    low, high, u = np.zeros_like(wanted), np.ones_like(wanted), wanted.copy()
    for _ in range(MOST_STEPS):
        value, slope = ((a * u + b) * u + c) * u, (3 * a * u + 2 * b) * u + c
        low, high = np.where(value > wanted, low, u), np.where(value > wanted, u, high)
        step = np.divide(value - wanted, slope, out=np.full_like(u, np.inf), where=slope > 0)
        new = u - step
        u = np.where((new >= low) & (new <= high), new, np.float32(0.5) * (low + high))
    return np.asarray(piece[:, 2] + piece[:, 3] * u)


def knotted_codes(model: DisplayModel, xyz_cd_m2: Floats) -> Floats:
    """Return codes (..., 3) of a display of tabled curves by way of `knot_codes`; matrix and mixtures in 64 bits."""
    curves = [curve for curve in model.curves if isinstance(curve, TableCurve)]
    tables = knot_tables(curves)
    light = np.clip(model.linear(xyz_cd_m2), 0.0, 1.0).astype(np.float32)
    channels = [knot_codes(light[..., c].ravel(), tables[c]).reshape(light.shape[:-1]) for c in range(len(curves))]
    return np.clip(np.stack(channels, axis=-1).astype(np.float64), 0.0, 1.0)
