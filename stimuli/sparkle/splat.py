"""Sparkles on the camera's pixel grid, spread by the lens.

A flake is far smaller than what the lens resolves: it is a point whose light falls on pixels as a Gaussian integrated
over each pixel's area, cut at four standard deviations beyond its pixel and scaled back to keep all its light.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stimuli.sparkle.optics import Sparkles
from stimuli.sparkle.scene import Camera, Plate

# Flakes splatted at a time: the weights of a block stay in memory that the processor's cache can hold.
_BLOCK = 8192


def splat(sparkles: Sparkles, plate: Plate, camera: Camera) -> NDArray[np.float32]:
    """Return the luminance that sparkles add to each camera pixel, float32 (rows, columns), in cd/m²."""
    columns, rows = camera.grid_px(plate)
    column_mm, row_mm = plate.width_mm / columns, plate.height_mm / rows
    across = (sparkles.x_mm + 0.5 * plate.width_mm) / column_mm
    down = (0.5 * plate.height_mm - sparkles.y_mm) / row_mm
    light = sparkles.luminance_cd_m2 * sparkles.area_mm2 / (column_mm * row_mm)
    reach = int(np.ceil(4.0 * camera.point_spread_sd_px))
    width = columns + 2 * reach + 2
    padded = np.zeros((rows + 2 * reach + 2) * width)
    offsets = np.arange(-reach, reach + 1)
    # From top to bottom, so that a block of flakes touches few rows.
    order = np.argsort(down)
    for start in range(0, len(order), _BLOCK):
        part = order[start : start + _BLOCK]
        first_column, horizontal = _weights(across[part], columns, offsets, camera.point_spread_sd_px)
        first_row, vertical = _weights(down[part], rows, offsets, camera.point_spread_sd_px)
        vertical *= light[part, None]
        top = int(first_row.min())
        places = (first_row[:, None] - top + offsets + reach)[:, :, None] * width
        places = places + (first_column[:, None] + offsets + reach + 1)[:, None, :]
        weights = vertical[:, :, None] * horizontal[:, None, :]
        added = np.bincount(places.ravel(), weights.ravel())
        first = (top + 1) * width
        padded[first : first + len(added)] += added
    image = padded.reshape(-1, width)[reach + 1 : reach + 1 + rows, reach + 1 : reach + 1 + columns]
    return image.astype(np.float32)


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
