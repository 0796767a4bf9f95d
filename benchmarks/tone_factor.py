"""The largest factor that saturates at most 0.3 % of a picture's pixels: run time against error.

The plain way halves an interval of factors and transforms the picture at each; ours transforms it once and takes an
order statistic. Error: relative to the order statistic of all pixels, sorted.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
from curves import Row, program, seconds, sized
from numpy.typing import NDArray
from promises import Promise, worst

from devices.display.display_file import read_display
from devices.display.model import DisplayModel
from stimuli.luminance.saturation import largest_factor

ASUS = Path(__file__).parents[1] / "configs/displays/asus_vg248qe.yaml"
LIMIT_PERCENT = 0.3
Picture = NDArray[np.float32]


def bisection(xyz: Picture, model: DisplayModel, steps: int) -> float:
    """Return the factor after so many halvings between 1e-3 and 1e3, in the logarithm at first."""
    low, high = 1e-3, 1e3
    pixels = xyz.size // 3
    for _ in range(steps):
        middle = np.sqrt(low * high) if high > 2 * low else 0.5 * (low + high)
        full = (model.linear(xyz * middle) > model.limits[1]).any(axis=-1).sum()
        low, high = (middle, high) if full <= LIMIT_PERCENT / 100 * pixels else (low, middle)
    return float(low)


def run() -> dict[str, object]:
    """Find the factor of made-up pictures of a display's and a camera's size."""
    model = read_display(ASUS).models("quad-buffered").left
    rows: list[Row] = []
    for name, shape in sized((("542 × 361", (361, 542)), ("2190 × 1460", (1460, 2190))), (("108 × 72", (72, 108)),)):
        random = np.random.default_rng(0)
        xyz = (random.lognormal(0, 1, (*shape, 1)) * random.uniform(0.8, 1.2, (*shape, 3))).astype(np.float32)
        pixels = shape[0] * shape[1]
        truth = bisection(xyz, model, 60)
        ours = largest_factor(xyz, model, LIMIT_PERCENT)
        time_s = seconds(partial(largest_factor, xyz, model, LIMIT_PERCENT), repeats=5)
        note = f"{ours.pixels_transformed:,} pixels transformed"
        error = abs(ours.factor / truth - 1)
        rows.append({"series": f"ours, {name}", "parameter": "exact", "seconds": time_s, "error": error, "note": note})
        for steps in (12, 20, 30, 45):
            began = perf_counter()
            error = abs(bisection(xyz, model, steps) / truth - 1)
            slow = perf_counter() - began
            note = f"{steps * pixels:,} pixels transformed; ours is {slow / time_s:.1f} × as fast"
            row = {"series": f"bisection, {name}", "parameter": f"{steps} steps", "seconds": slow, "error": error}
            rows.append({**row, "note": note})
    promises = [Promise("relative error of the factor", worst(rows, series="ours"), 1e-12, "error")]
    return {"promises": promises, "title": "Largest factor with at most 0.3 % of pixels saturated", "rows": rows}


if __name__ == "__main__":
    program("tone_factor", run)
