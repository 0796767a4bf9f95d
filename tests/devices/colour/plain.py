"""ΔE00 of its terms as the paper has it: the twin of `devices.colour.ciede2000.fast_delta_e`."""

from __future__ import annotations

import numpy as np

from documents.arrays import Floats


def plain_delta_e(
    delta_L: Floats, delta_C: Floats, delta_H: Floats, S_L: Floats, S_C: Floats, S_H: Floats, R_T: Floats
) -> Floats:
    """Return ΔE00 (n,) of its terms."""
    L, C, H = delta_L / S_L, delta_C / S_C, delta_H / S_H
    return np.asarray(np.sqrt(np.maximum(L * L + C * C + H * H + R_T * C * H, 0.0)))
