"""What of a region's difference is seen: the map of both pictures as the eye resolves them, over each region."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stimuli.comparison.difference_map import Floats32
from stimuli.comparison.regions import Region, inside, window


def seen_regions(delta_e: Floats32, regions: Sequence[Region]) -> dict[str, float]:
    """Return the mean ΔE00 over each region's pixels, by name, of a map (height, width) on the photograph's grid.

    Regions without a pixel are left out.
    """
    means = {}
    for region in regions:
        at = window(region.photo_px, delta_e.shape)
        values = delta_e[at][inside(region.photo_px, *at)]
        if values.size:
            means[region.name] = float(values.mean(dtype=np.float64))
    return means
