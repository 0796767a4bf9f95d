"""What the gamut clip costs a picture: how many pixels a display cannot show, and how far off they end up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from devices.ciede2000 import delta_e_2000
from devices.colour import xyz_to_lab
from devices.display import Clipping, DisplayModel


@dataclass(frozen=True, slots=True)
class ClipCost:
    """The clip of one picture on one display model.

    ``delta_e_00_mean`` is over all pixels, those shown as asked counting 0; Lab is relative to the display's white.
    Quantisation to device codes is not part of it.
    """

    clipping: Clipping
    delta_e_00_mean: float
    delta_e_00_max: float

    def to_json(self) -> dict[str, float]:
        """Return percentages and costs under the names that a session's header carries."""
        percent = self.clipping.percent
        return {
            "percent_red": round(percent(self.clipping.red), 4),
            "percent_green": round(percent(self.clipping.green), 4),
            "percent_blue": round(percent(self.clipping.blue), 4),
            "percent_any": round(percent(self.clipping.any_channel), 4),
            "percent_above_full": round(percent(self.clipping.above_full), 4),
            "delta_e_00_mean": round(self.delta_e_00_mean, 5),
            "delta_e_00_max": round(self.delta_e_00_max, 4),
        }


def clip_cost(model: DisplayModel, xyz_cd_m2: ArrayLike) -> ClipCost:
    """Return what showing XYZ in cd/m², shape (..., 3), on ``model`` costs; pixels shown as asked are not compared."""
    asked = np.asarray(xyz_cd_m2, dtype=np.float64).reshape(-1, 3)
    linear = model.linear(asked)
    lowest = [max(0.0, float(curve.linear(0.0))) for curve in model.curves]
    highest = [min(1.0, float(curve.linear(1.0))) for curve in model.curves]
    changed = ((linear < lowest) | (linear > highest)).any(axis=1)
    if not changed.any():
        return ClipCost(model.clipping(asked), 0.0, 0.0)
    white = model.white_XYZ_cd_m2
    shown = model.xyz(model.code(asked[changed]))
    # Lab is defined for light only: what lies below no light at all is as black as black.
    difference = delta_e_2000(xyz_to_lab(np.maximum(asked[changed], 0.0), white), xyz_to_lab(shown, white))
    return ClipCost(model.clipping(asked), float(difference.sum() / len(asked)), float(difference.max()))
