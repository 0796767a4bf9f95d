"""What the eye resolves of a picture: run time against error over how coarse the cells of wide blurs are.

The plain method beside it blurs every channel by every Gaussian at full size.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from curves import program, seconds, sized
from numpy.typing import NDArray
from promises import Promise, worst

from stimuli.measures import difference_map, scielab

SIZE_PX = sized((342, 512), (96, 128))
PIXELS_PER_DEGREE = 178.0  # a camera's 146 pixels per centimetre, seen from 70 cm
WHITE = np.array([96.42, 100.0, 82.49])


def plain(xyz: NDArray[np.float32]) -> NDArray[np.float64]:
    """Every Gaussian over every pixel, in float64, to eight standard deviations."""
    from scipy.ndimage import convolve1d
    from scipy.special import ndtr

    matrix = scielab.opponent_from_xyz(WHITE)
    opponent = xyz.astype(np.float64) @ matrix.T
    seen = np.zeros_like(opponent)
    for channel, gaussians in enumerate(scielab.GAUSSIANS):
        total = sum(weight for weight, _ in gaussians)
        for weight, spread_deg in gaussians:
            sd = spread_deg * PIXELS_PER_DEGREE / np.sqrt(2.0)
            reach = int(np.ceil(8.0 * sd))
            kernel = np.diff(ndtr((np.arange(-reach, reach + 2) - 0.5) / sd))
            blurred = convolve1d(opponent[..., channel], kernel, axis=0, mode="reflect")
            seen[..., channel] += weight / total * convolve1d(blurred, kernel, axis=1, mode="reflect")
    return np.asarray(seen @ np.linalg.inv(matrix).T)


def run() -> dict[str, object]:
    """Time both on one sparkling picture; the error is the largest, as ΔE00 against the plain outcome."""
    rng = np.random.default_rng(0)
    xyz = (rng.gamma(0.2, 20.0, (*SIZE_PX, 1)) * (WHITE / 100.0)).astype(np.float32)
    exact = plain(xyz)
    rows: list[dict[str, object]] = [
        {
            "series": "every Gaussian at full size",
            "parameter": "float64",
            "seconds": seconds(partial(plain, xyz), repeats=1),
            "error": 0.0,
        }
    ]
    usual = scielab.NARROWEST_CELLS
    try:
        for cells in (1.0, 1.5, 2.0, 2.5, 4.0, 8.0):
            scielab.NARROWEST_CELLS = cells

            def ours() -> NDArray[np.float32]:
                return scielab.SeenPicture(xyz, PIXELS_PER_DEGREE, WHITE)[:]

            rows.append(
                {
                    "series": "wide Gaussians in cells",
                    "parameter": f"{cells:g} cells a standard deviation" + (" (as shipped)" if cells == usual else ""),
                    "seconds": seconds(ours, repeats=3),
                    "error": float(difference_map(ours(), exact, WHITE, filtered=True).max()),
                }
            )
    finally:
        scielab.NARROWEST_CELLS = usual
    shipped = worst(rows, parameter="as shipped")
    promises = [Promise("largest ΔE00 from every Gaussian at full size", shipped, 0.001, "error")]
    return {"promises": promises, "title": f"What the eye resolves of {SIZE_PX[1]} × {SIZE_PX[0]} pixels", "rows": rows}


if __name__ == "__main__":
    program("seen_difference", run)
