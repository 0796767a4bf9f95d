"""The plate cut into tiles of camera pixels: each is culled by a bound of its own, and drawn only if it has content."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stimuli.sparkle.scene import Camera, Plate

Floats = NDArray[np.float64]

TILE_PX = 256


@dataclass(frozen=True, slots=True)
class Tiles:
    """Tiles of ``tile_px`` camera pixels a side; those at the right and at the bottom may be smaller.

    Tiles are counted from the top left, row by row.
    """

    width_mm: float
    height_mm: float
    columns_px: int
    rows_px: int
    tile_px: int

    @property
    def columns(self) -> int:
        """Tiles from left to right."""
        return -(-self.columns_px // self.tile_px)

    @property
    def rows(self) -> int:
        """Tiles from top to bottom."""
        return -(-self.rows_px // self.tile_px)

    def __len__(self) -> int:
        return self.columns * self.rows

    def of_pixels(self, across_px: Floats, down_px: Floats) -> NDArray[np.int64]:
        """Return the tile (n,) that each place on the pixel grid, (n,) each, lies in, or the one next to it."""
        # What lies outside is cut towards the first tile or clipped to the last.
        column = np.clip((across_px * (1.0 / self.tile_px)).astype(np.int64), 0, self.columns - 1)
        row = np.clip((down_px * (1.0 / self.tile_px)).astype(np.int64), 0, self.rows - 1)
        return row * self.columns + column

    def of_places(self, x_mm: NDArray[np.float32], y_mm: NDArray[np.float32]) -> NDArray[np.int64]:
        """Return the tile (n,) that each place on the plate lies in."""
        across = (x_mm.astype(np.float64) + 0.5 * self.width_mm) * (self.columns_px / self.width_mm)
        down = (0.5 * self.height_mm - y_mm.astype(np.float64)) * (self.rows_px / self.height_mm)
        return self.of_pixels(across, down)

    def middles_mm(self) -> tuple[Floats, Floats, Floats]:
        """Return x and y of each tile's middle, and how far its corners lie from there, in mm; (tiles,) each."""
        left, right = self._edges(self.columns_px, self.columns)
        top, bottom = self._edges(self.rows_px, self.rows)
        column_mm, row_mm = self.width_mm / self.columns_px, self.height_mm / self.rows_px
        x = 0.5 * (left + right) * column_mm - 0.5 * self.width_mm
        y = 0.5 * self.height_mm - 0.5 * (top + bottom) * row_mm
        half_width, half_height = 0.5 * (right - left) * column_mm, 0.5 * (bottom - top) * row_mm
        reach = np.hypot(half_width[None, :], half_height[:, None])
        return np.tile(x, self.rows), np.repeat(y, self.columns), reach.ravel()

    def _edges(self, pixels: int, tiles: int) -> tuple[Floats, Floats]:
        first = np.arange(tiles, dtype=np.float64) * self.tile_px
        return first, np.minimum(first + self.tile_px, pixels)


def tiles_of(plate: Plate, camera: Camera, tile_px: int = TILE_PX) -> Tiles:
    """Return the plate's tiles in the camera's pixels."""
    columns, rows = camera.grid_px(plate)
    return Tiles(plate.width_mm, plate.height_mm, columns, rows, tile_px)


def whole(plate: Plate) -> Tiles:
    """Return the plate as one tile."""
    return Tiles(plate.width_mm, plate.height_mm, 1, 1, 1)
