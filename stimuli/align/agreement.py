"""Whether two textures agree all over, or in a few places by chance.

Two fields of sparkles that have nothing in common still match where the brightest of one is laid onto the brightest of
the other, and a phase correlation, which expects noise of many small parts, takes that for a shift. So each square of
eight pixels is asked on its own: its correlation, drawn to 0 where it holds next to nothing, counts once however bright
it is. Their sum over the root of their squares' sum is about normal where squares agree no oftener than they disagree,
and rises to the root of their number where all agree.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats32 = NDArray[np.float32]

SIDE_PX = 8
# Set by measurement: the highest of all shifts of sparse fields with nothing in common (tests/stress).
LEAST_AGREEMENT = 7.5
LEAST_SHARE = 0.55
_FINE_PX = 9
_DRAW_MEDIAN, _DRAW_MEAN = 3.0, 0.003


def agreement(reference: Floats32, moving: Floats32, shift_px: tuple[int, int]) -> tuple[float, float]:
    """Return how far squares of two textures (height, width) agree at a whole shift, and what they would have to."""
    height, width = reference.shape
    across, down = shift_px
    left, right = max(0, -across), min(width, width - across)
    top, bottom = max(0, -down), min(height, height - down)
    if min(right - left, bottom - top) < SIDE_PX:
        return 0.0, LEAST_AGREEMENT
    one = _squares(reference[top:bottom, left:right])
    two = _squares(moving[top + down : bottom + down, left + across : right + across])
    power = np.sqrt(np.einsum("ijkl,ijkl->ik", one, one) * np.einsum("ijkl,ijkl->ik", two, two))
    typical = _DRAW_MEDIAN * float(np.median(power)) + _DRAW_MEAN * float(power.mean()) + np.finfo(np.float32).tiny
    each = np.einsum("ijkl,ijkl->ik", one, two) / (power + typical)
    size = float(np.sqrt(np.sum(each**2)))
    needed = min(LEAST_AGREEMENT, LEAST_SHARE * float(np.sqrt(each.size)))
    return (float(each.sum()) / size if size > 0 else 0.0), needed


def _squares(plane: Floats32) -> Floats32:
    """Return squares (rows, SIDE_PX, columns, SIDE_PX) of the finest of ``plane``, each less its mean.

    Only the finest: what is left of a local mean about one sparkle would make its neighbours agree too.
    """
    from scipy.ndimage import uniform_filter

    plane = plane - uniform_filter(plane, _FINE_PX, mode="nearest")
    height, width = (length // SIDE_PX for length in plane.shape)
    found = plane[: height * SIDE_PX, : width * SIDE_PX].reshape(height, SIDE_PX, width, SIDE_PX)
    return np.asarray(found - found.mean(axis=(1, 3), keepdims=True), dtype=np.float32)
