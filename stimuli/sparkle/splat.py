"""Sparkles on the camera's pixel grid, spread by the lens.

A flake is far smaller than what the lens resolves: it is a point whose light falls on pixels as a Gaussian integrated
over each pixel's area, cut at four standard deviations beyond its pixel and scaled back to keep all its light. The
plate is drawn tile by tile, and tiles without sparkles are not visited.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stimuli.sparkle.optics import Sparkles
from stimuli.sparkle.scene import Camera, Plate
from stimuli.sparkle.tiles import TILE_PX, tiles_of

# Flakes splatted at a time: the weights of a block stay in memory that the processor's cache can hold.
_BLOCK = 8192


def splat(sparkles: Sparkles, plate: Plate, camera: Camera, tile_px: int = TILE_PX) -> tuple[NDArray[np.float32], int]:
    """Return the luminance that sparkles add to each camera pixel, in cd/m², and how many tiles had any.

    The luminance is float32 (rows, columns). Where tiles begin makes no difference but in its last digit.
    """
    tiles = tiles_of(plate, camera, tile_px)
    columns, rows = tiles.columns_px, tiles.rows_px
    column_mm, row_mm = plate.width_mm / columns, plate.height_mm / rows
    across = (sparkles.x_mm + 0.5 * plate.width_mm) / column_mm
    down = (0.5 * plate.height_mm - sparkles.y_mm) / row_mm
    light = sparkles.luminance_cd_m2 * sparkles.area_mm2 / (column_mm * row_mm)
    reach = int(np.ceil(4.0 * camera.point_spread_sd_px))
    offsets = np.arange(-reach, reach + 1)
    # A sparkle beyond the border belongs to the pixel next to it outside, and spreads from there.
    margin = reach + 1
    padded = np.zeros((rows + 2 * margin, columns + 2 * margin))
    tile = tiles.of_pixels(across, down)
    order = np.argsort(tile, kind="stable")
    ends = np.cumsum(np.bincount(tile, minlength=len(tiles)))
    visited = 0
    for index, (start, end) in enumerate(zip(np.append(0, ends[:-1]), ends, strict=True)):
        if start == end:
            continue
        visited += 1
        top, left = index // tiles.columns * tile_px, index % tiles.columns * tile_px
        height = min(tile_px, rows - top) + 2 * margin
        width = min(tile_px, columns - left) + 2 * margin
        added = np.zeros(height * width)
        for first in range(start, end, _BLOCK):
            part = order[first : min(first + _BLOCK, end)]
            column, horizontal = _weights(across[part], columns, offsets, camera.point_spread_sd_px)
            row, vertical = _weights(down[part], rows, offsets, camera.point_spread_sd_px)
            vertical *= light[part, None]
            places = (row[:, None] - top + offsets + margin)[:, :, None] * width
            places = places + (column[:, None] - left + offsets + margin)[:, None, :]
            added += np.bincount(places.ravel(), (vertical[:, :, None] * horizontal[:, None, :]).ravel(), len(added))
        padded[top : top + height, left : left + width] += added.reshape(height, width)
    return padded[margin : margin + rows, margin : margin + columns].astype(np.float32), visited


def _weights(
    place_px: NDArray[np.float64], pixels: int, offsets: NDArray[np.int64], sd_px: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the pixel (n,) that holds each place, and the shares (n, k) of its light in the pixels around it."""
    from scipy.special import ndtr

    pixel = np.clip(np.floor(place_px), -1, pixels).astype(np.int64)
    edges = np.append(offsets, offsets[-1] + 1)
    below = ndtr((pixel[:, None] + edges - place_px[:, None]) / sd_px)
    shares = np.diff(below, axis=1)
    shares /= shares.sum(axis=1, keepdims=True)
    return pixel, shares
