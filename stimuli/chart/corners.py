"""The corners of a chart as somebody gave them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from documents import Finding
from stimuli.errors import StimulusError

Floats = NDArray[np.float64]


def check_corners(corners_px: ArrayLike, shape: tuple[int, ...], file: str | None = None) -> Floats:
    """Return the corners (4, 2), x and y in pixels; StimulusError unless they are a convex quadrangle in the picture.

    Pixel centres lie at whole numbers and a half: the picture is from 0 to its width and height.
    """
    corners = np.asarray(corners_px, dtype=np.float64)
    height, width = shape[:2]
    if corners.shape != (4, 2) or not np.all(np.isfinite(corners)):
        raise StimulusError(Finding(f"a chart has four corners x,y, not {corners.tolist()}", file))
    if np.any(corners < 0) or np.any(corners > [width, height]):
        raise StimulusError(
            Finding(
                f"a corner of the chart lies outside the picture of {width} × {height} pixels: {corners.tolist()}",
                file,
                remedy="give x,y in pixels from the top left",
            )
        )
    sides = np.roll(corners, -1, axis=0) - corners
    following = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    if not (np.all(turns > 0) or np.all(turns < 0)):
        raise StimulusError(
            Finding(
                "the chart's corners are no convex quadrangle",
                file,
                remedy="give them around the chart: top left, top right, bottom right, bottom left",
            )
        )
    return corners
