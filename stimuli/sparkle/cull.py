"""Which flakes can matter: the rest are dropped before shading, and what shading shows to be dim before splatting.

A flake is kept if the half-way direction between lamp and eye may lie within ``CUT_SD`` standard deviations of its
normal. Dropped flakes send the eye less than one millionth of their lobe's peak. On the grey plate in configs/stimuli
that is below 0.001 cd/m² in the camera pixel of even an 80 µm flake, on a base of 3.6 cd/m².

The first test runs on slopes alone:
half-way slopes over the whole plate stay within a known distance of the middle's, and directions within an angle d of
one another, both within an angle t of the plate's normal, have slopes that differ by at most d / cos² t.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stimuli.sparkle.flakes import Flakes
from stimuli.sparkle.optics import half_way, lobe_sd, refract, view_directions
from stimuli.sparkle.scene import Lamp, Plate

LEAST_LOBE_SHARE = 1e-6
CUT_SD = float(np.sqrt(-2.0 * np.log(LEAST_LOBE_SHARE)))  # 5.26


def half_way_slopes(
    x_mm: NDArray[np.float64], y_mm: NDArray[np.float64], plate: Plate, lamp: Lamp, eye_mm: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return slopes (n, 2) of the half-way direction at places on the plate, (n,) each."""
    index = plate.coat_refractive_index
    h = half_way(refract(view_directions(x_mm, y_mm, eye_mm), index), refract(lamp.direction, index))
    return np.asarray(h[:, :2] / h[:, 2:])


def can_matter(flakes: Flakes, plate: Plate, lamp: Lamp, eye_mm: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which flakes, (n,), may send light above one millionth of a lobe's peak to the eye at ``eye_mm``."""
    # Slopes change monotonically away from the eye's foot on the plate: the border holds the extremes.
    side = np.linspace(-0.5, 0.5, 33)
    end = np.full_like(side, 0.5)
    x = plate.width_mm * np.concatenate([side, side, -end, end])
    y = plate.height_mm * np.concatenate([-end, end, side, side])
    border = half_way_slopes(x, y, plate, lamp, eye_mm)
    centre = 0.5 * (border.min(axis=0) + border.max(axis=0))
    reach = float(np.linalg.norm(border - centre, axis=1).max())
    cut = CUT_SD * lobe_sd(plate, lamp)
    steepest = float(np.arctan(np.linalg.norm(border, axis=1).max())) + cut
    if steepest >= np.pi / 2:
        return np.ones(len(flakes), dtype=np.bool_)
    radius = 1.001 * (reach + cut / np.cos(steepest) ** 2)
    along, across = flakes.slope_x - np.float32(centre[0]), flakes.slope_y - np.float32(centre[1])
    return np.asarray(along * along + across * across <= np.float32(radius**2))
