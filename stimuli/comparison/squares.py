"""What squares all over a photograph say of where they lie in its rendering, each to a fraction of a pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stimuli.comparison.row_file import RowFile
from stimuli.errors import StimulusError

Floats = NDArray[np.float64]

LEAST_SQUARES = 3
_SQUARES_ACROSS = 6
_SQUARE_PX = (48, 192)
_KNOWN_PX = 0.1


@dataclass(frozen=True, eq=False, slots=True)
class Field:
    """What squares of the photograph say: ``middle_px``, ``moved_px`` and standard error, (n, 2) each.

    ``moved_px`` is where a square lies in the rendering as brought, minus where it lies in the photograph. ``of`` were
    looked at; the others are flat, alike, or have nothing in common.
    """

    middle_px: Floats
    moved_px: Floats
    standard_error_px: Floats
    of: int

    @property
    def residual_px(self) -> float | None:
        """Root mean square of how far squares lie apart, without the farthest twentieth; None of fewer than three."""
        parts = []
        for axis in (0, 1):
            known = self.moved_px[self.standard_error_px[:, axis] < _KNOWN_PX, axis]
            if len(known) < LEAST_SQUARES:
                return None
            kept = np.sort(known**2)[: max(LEAST_SQUARES, int(np.ceil(0.95 * len(known))))]
            parts.append(float(kept.mean()))
        return float(np.sqrt(sum(parts)))


def squares(photo: RowFile, rendering: RowFile, matrix: Floats) -> Field:
    """Return how squares of the photograph lie in the rendering once ``matrix`` is undone."""
    from stimuli.align.homography import mapped, warp
    from stimuli.align.register import register_planes

    height, width = photo.shape[:2]
    side = int(np.clip(min(height, width) // 4, *_SQUARE_PX))
    side = min(side, height, width)
    if side < 32:
        return Field(np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 2)), 0)
    across = max(2, min(_SQUARES_ACROSS, 2 * width // side))
    down = max(2, min(_SQUARES_ACROSS, 2 * height // side))
    found: list[tuple[float, ...]] = []
    plain = np.array_equal(matrix, np.eye(3))
    for top in np.linspace(0, height - side, down).round().astype(int).tolist():
        band = photo[top : top + side][:, :, 1]
        for left in np.linspace(0, width - side, across).round().astype(int).tolist():
            one = np.ascontiguousarray(band[:, left : left + side])
            box = np.array([[0, 0], [side, 0], [side, side], [0, side]]) + [left, top]
            seen = mapped(matrix, box.astype(np.float64))
            low = np.maximum(np.floor(seen.min(axis=0)).astype(int) - 16, 0)
            high = np.minimum(np.ceil(seen.max(axis=0)).astype(int) + 17, [rendering.shape[1], rendering.shape[0]])
            if not (np.all(seen > -0.5) and np.all(seen < [rendering.shape[1] + 0.5, rendering.shape[0] + 0.5])):
                continue
            part = rendering[int(low[1]) : int(high[1])][:, int(low[0]) : int(high[0]), 1]
            if plain:
                two = np.ascontiguousarray(part[top - low[1] :, left - low[0] :][:side, :side])
            else:
                two = warp(part[:, :, None], move(-low) @ matrix @ move((left, top)), (side, side)).picture[:, :, 0]
            try:
                lies = register_planes(one, two, most_px=(side // 4, side // 4))
            except StimulusError:
                continue
            middle = (left + (side - 1) / 2, top + (side - 1) / 2)
            found.append((*middle, *lies.shift_px, *lies.standard_error_px))
    table = np.array(found, dtype=np.float64).reshape(-1, 6)
    return Field(table[:, :2], table[:, 2:4], table[:, 4:6], across * down)


def move(by: ArrayLike) -> Floats:
    """Return the matrix (3, 3) of a shift (2,)."""
    x, y = np.asarray(by, dtype=np.float64)
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]])
