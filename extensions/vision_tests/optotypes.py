"""Landolt rings: a ring whose width, like the gap in it, is a fifth of its diameter [ISO8596].

Drawn by area coverage in linear light: each pixel is darkened by as much of it as the ring covers, so that a ring of
any size, whole pixels or not, has the size that it should.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats
from extensions.vision_tests.random_dots import TOWARDS
from extensions.vision_tests.record import Side
from stimuli.pictures import StereoImage

_SAMPLES = 600  # along an axis of the ring, at least


def in_ring(x: Floats, y: Floats, gap: float, side: Side) -> NDArray[np.bool_]:
    """Return whether places from the ring's middle, y down, lie in a ring with its ``gap`` towards ``side``."""
    across, down = TOWARDS[side]
    radius = np.hypot(x, y)
    along, beside = x * across + y * down, x * down + y * across
    return np.asarray((radius <= 2.5 * gap) & (radius >= 1.5 * gap) & ~((along > 0) & (np.abs(beside) < gap / 2)))


def ring_coverage(gap_px: float, side: Side) -> Floats:
    """Return the share of each pixel that a ring covers, in the middle of a square with an odd number of pixels."""
    half = int(np.ceil(2.5 * gap_px))
    count = 2 * half + 1
    per_pixel = max(16, _SAMPLES // count)
    # Whole numbers until the division: places left and right of the middle are then exactly alike, also on an edge.
    places = (2 * np.arange(count * per_pixel) + 1 - count * per_pixel) / (2 * per_pixel)
    inside = in_ring(places[None, :], places[:, None], gap_px, side)
    return np.asarray(inside.reshape(count, per_pixel, count, per_pixel).mean(axis=(1, 3)))


def landolt(gap_px: float, side: Side, size_px: int, ground_XYZ: Floats, ring_XYZ: Floats) -> StereoImage:
    """Return a ring in the middle of a square of ``size_px``, made odd, the same for both eyes; XYZ in cd/m².

    Parameters
    ----------
    gap_px
        The gap of the ring and its width, in pixels, above 0, whole or not; the ring's diameter is five times as much.
    side
        Where the gap is: ``up``, ``down``, ``left`` or ``right``.
    size_px
        The side of the square, in pixels; made larger where the ring needs more.
    ground_XYZ, ring_XYZ
        XYZ of ground and ring, (3,), in cd/m².

    Returns
    -------
    StereoImage
        The square, XYZ in cd/m², float32, one array for both eyes.

    Examples
    --------
    >>> ring = landolt(2.0, "right", 20, np.full(3, 80.0), np.zeros(3))
    >>> ring.width_px, ring.is_flat
    (21, True)
    >>> ring.left[10, [6, 10, 14], 1].tolist()              # the ring on the left, its middle, and the gap
    [0.0, 80.0, 80.0]
    """
    covered = ring_coverage(gap_px, side)
    count = max(size_px | 1, len(covered))
    picture = np.empty((count, count, 3), dtype=np.float32)
    picture[:] = ground_XYZ
    start = (count - len(covered)) // 2
    part = slice(start, start + len(covered))
    picture[part, part] = ground_XYZ + covered[:, :, None] * (ring_XYZ - ground_XYZ)
    return StereoImage.flat(picture)
