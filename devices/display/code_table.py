"""The table that the fragment shader reads in place of an inverse tone curve.

A channel's code is tabulated over t = √√((linear − lift) / (1 − lift)), 1024 entries (2048 where the
presenter rounds to 10 bits, which ask for four times the exactness) and linear interpolation between
them: two square roots and no power function in the shader, and finest where the inverse curve is
steepest. Indexed uniformly instead, the same table errs by up to 4.4 codes of 8 bits. The lift moves
into the index, so that the curve's vertical start stays at t = 0; entries below code 0 keep their
negative value, so that the clip at 0 falls between entries exactly where it should.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.display.curves import ENTRIES, curve_table, looked_up_codes
from devices.display.model import DisplayModel
from documents.arrays import Floats


@dataclass(frozen=True, slots=True)
class CodeTables:
    """What the colour pass needs of one display model.

    ``codes``: float32, shape (3, entries). ``lift`` and ``scale``: shape (3,), float64 because the index rises
    vertically at the lift.
    """

    codes: NDArray[np.float32]
    lift: NDArray[np.float64]
    scale: NDArray[np.float64]


def code_tables(model: DisplayModel, entries: int = ENTRIES) -> CodeTables:
    """Build the three channels' tables of ``model``, in units of `DisplayModel.normalised`."""
    model = model.normalised
    lift = np.array([curve.lift for curve in model.curves])
    codes = np.stack([curve_table(curve, entries) for curve in model.curves])
    return CodeTables(codes.astype(np.float32), lift, 1.0 / (1.0 - lift))


def table_codes(model: DisplayModel, xyz_cd_m2: NDArray[np.float64], tables: CodeTables) -> NDArray[np.float64]:
    """Return codes (..., 3) by way of the tables: the NumPy twin of ``colour_pass.frag``, in float64."""
    linear = np.clip(model.normalised.linear(xyz_cd_m2), 0.0, 1.0)
    light = (linear - tables.lift) * tables.scale
    return np.stack([looked_up_codes(light[..., i], tables.codes[i]) for i in range(3)], axis=-1)


def entries_for(levels: int, *, dithered: bool) -> int:
    """Return how many entries the colour pass's tables have: more where finer codes are rounded.

    Where codes are dithered, the light of the codes decides, and not the table.

    Parameters
    ----------
    levels
        The highest code: 255 for 8 bits.
    dithered
        Whether codes are dithered.

    Returns
    -------
    int
        Entries for each channel.

    Examples
    --------
    >>> entries_for(255, dithered=False), entries_for(1023, dithered=False), entries_for(1023, dithered=True)
    (1024, 2048, 1024)
    """
    return 2 * ENTRIES if levels > 255 and not dithered else ENTRIES


def knotted_codes(model: DisplayModel, xyz_cd_m2: Floats) -> Floats:
    """Return codes (..., 3) of a display of tabled curves by way of `devices.display.curves.knot_codes`."""
    light = np.clip(model.linear(xyz_cd_m2), 0.0, 1.0)
    channels = [curve.shader_codes(light[..., c].ravel(), 0) for c, curve in enumerate(model.curves)]
    return np.stack(channels, axis=-1).reshape(light.shape)
