"""A tabled curve as the fragment shader inverts it: piece by piece.

Between two entries of a `devices.display.table_curve.TableCurve`, √light is a cubic of the code. Scaled to 0..1 on
either side,
it is v = ((a·u + b)·u + c)·u, which Newton's method between brackets undoes in 32 bits. Which v it is, is found in 64
bits (or two floats): a curve may be so flat that 32 bits of its light are a hundredth of a code. The one table of
`devices.display.code_table`
errs there by whole codes, as below a CRT's cut-off or where a signal is clipped.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devices.display.model import DisplayModel
from devices.display.table_curve import TableCurve
from documents.arrays import Floats

Singles = NDArray[np.float32]
# Of a piece: √light where it begins in two parts, its rise, the code where it begins; a, b, c, and the code's rise.
NUMBERS = 8
MOST_STEPS = 24
_BEYOND = 2.0


def knot_tables(curves: Sequence[TableCurve]) -> Singles:
    """Return the pieces of ``curves``, shape (curves, pieces of the longest, 8); shorter ones end in pieces at 2.

    Parameters
    ----------
    curves
        Tone curves by tables of knots, at least one.

    Returns
    -------
    ndarray
        Shape (curves, pieces, 8): of a piece √light and the code in 0..1 where it begins, its cubic, and its rises.

    Examples
    --------
    >>> curve = TableCurve((0.0, 0.5, 1.0), (0.0, 0.2, 1.0))
    >>> knot_tables([curve, curve]).shape[::2]
    (2, 8)
    """
    of_curves = [_pieces(curve) for curve in curves]
    tables = np.zeros((len(of_curves), max(len(pieces) for pieces in of_curves), NUMBERS))
    tables[:, :, 0] = _BEYOND
    tables[:, :, 2] = 1.0
    for row, pieces in enumerate(of_curves):
        tables[row, : len(pieces)] = pieces
    return tables.astype(np.float32)


def _pieces(curve: TableCurve) -> Floats:
    cubic = np.asarray(curve.cubics[1])
    codes, roots = np.asarray(curve.codes), np.sqrt(curve.light)
    width, rise = np.diff(codes), np.diff(roots)
    scaled = [cubic[power] * width ** (3 - power) / rise for power in range(3)]
    high = roots[:-1].astype(np.float32).astype(np.float64)
    return np.stack([high, roots[:-1] - high, rise, codes[:-1], *scaled, width], axis=1)


def knot_codes(light: Floats, table: Singles) -> Singles:
    """Return codes (n,) for light (n,) by ``table`` (pieces, 8): the NumPy twin of ``knots.glsl``."""
    root = np.sqrt(light)
    begins = table[:, :2].astype(np.float64).sum(axis=1)
    place = np.clip(np.searchsorted(begins, root, side="right") - 1, 0, len(table) - 1)
    piece = table[place]
    wanted = np.clip((root - begins[place]) / piece[:, 2], 0.0, 1.0).astype(np.float32)
    a, b, c = piece[:, 4], piece[:, 5], piece[:, 6]
    low, high, u = np.zeros_like(wanted), np.ones_like(wanted), wanted.copy()
    for _ in range(MOST_STEPS):
        value, slope = ((a * u + b) * u + c) * u, (3 * a * u + 2 * b) * u + c
        low, high = np.where(value > wanted, low, u), np.where(value > wanted, u, high)
        step = np.divide(value - wanted, slope, out=np.full_like(u, np.inf), where=slope > 0)
        new = u - step
        u = np.where((new >= low) & (new <= high), new, np.float32(0.5) * (low + high))
    return np.asarray(piece[:, 3] + piece[:, 7] * u)


def knotted_codes(model: DisplayModel, xyz_cd_m2: Floats) -> Floats:
    """Return codes (..., 3) of a display of tabled curves by way of `knot_codes`."""
    curves = [curve for curve in model.curves if isinstance(curve, TableCurve)]
    tables = knot_tables(curves)
    light = np.clip(model.linear(xyz_cd_m2), 0.0, 1.0)
    channels = [knot_codes(light[..., c].ravel(), tables[c]).reshape(light.shape[:-1]) for c in range(len(curves))]
    return np.clip(np.stack(channels, axis=-1).astype(np.float64), 0.0, 1.0)
