"""From photosites to pixels in float: no interpolation at half size, or two linear interpolations at full size.

Each has a saturation map beside it that marks exactly the values in which a saturated photosite has a part.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stimuli.develop.mosaic import Mosaic

Linear = Literal["bilinear", "malvar"]
RGB = tuple[NDArray[np.float32], NDArray[np.bool_]]

_MARGIN = 2  # what the widest kernel reaches
_CROSS = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]]) / 4
_DIAGONAL = np.array([[1, 0, 1], [0, 0, 0], [1, 0, 1]]) / 4
_ROW = np.array([[0, 0, 0], [1, 0, 1], [0, 0, 0]]) / 2
# Malvar, He and Cutler, "High-quality linear interpolation", Figure 2: the bilinear value, corrected by the Laplacian
# of the colour that was measured there. [Malvar2004]
_GREEN = np.array([[0, 0, -1, 0, 0], [0, 0, 2, 0, 0], [-1, 2, 4, 2, -1], [0, 0, 2, 0, 0], [0, 0, -1, 0, 0]]) / 8
_BESIDE = np.array([[0, 0, 1, 0, 0], [0, -2, 0, -2, 0], [-2, 8, 10, 8, -2], [0, -2, 0, -2, 0], [0, 0, 1, 0, 0]]) / 16
_ACROSS = np.array([[0, 0, -3, 0, 0], [0, 4, 0, 4, 0], [-3, 0, 12, 0, -3], [0, 4, 0, 4, 0], [0, 0, -3, 0, 0]]) / 16


def superpixel(mosaic: Mosaic) -> RGB:
    """Return RGB float32 (height // 2, width // 2, 3) and its saturation map: one pixel of each 2 × 2 photosites.

    Nothing is interpolated: red and blue are the photosites' own values, green the mean of its two. A last row or
    column without a partner is left out. The three colours of a pixel are measured half a pixel apart.
    """
    height, width = (length // 2 for length in mosaic.values.shape)
    rgb = np.empty((height, width, 3), np.float32)
    saturated = np.zeros((height, width, 3), bool)
    for colour in range(3):
        places = mosaic.places(colour)
        planes = [mosaic.values[place][:height, :width] for place in places]
        rgb[..., colour] = planes[0] if len(planes) == 1 else (planes[0] + planes[1]) * np.float32(0.5)
        for place in places:
            saturated[..., colour] |= mosaic.saturated[place][:height, :width]
    return rgb, saturated


def interpolate(mosaic: Mosaic, method: Linear) -> RGB:
    """Return RGB float32 (height, width, 3) and its saturation map, by ``bilinear`` or ``malvar`` interpolation.

    Measured values stay as they are. ``bilinear`` is the mean of the nearest photosites of that colour and never
    leaves their range. ``malvar`` adds the curvature of the colour measured there: sharper, and it may overshoot at
    edges, to below 0 as well. At the border the photosites are mirrored about the last one, which keeps the pattern.
    """
    height, width = mosaic.values.shape
    values = np.pad(mosaic.values, _MARGIN, mode="reflect")
    full = np.pad(mosaic.saturated, _MARGIN, mode="reflect")
    rgb = np.empty((height, width, 3), np.float32)
    saturated = np.empty((height, width, 3), bool)
    for row in range(2):
        for column in range(2):
            place = slice(row, None, 2), slice(column, None, 2)
            size = (height - row + 1) // 2, (width - column + 1) // 2
            for colour in range(3):
                kernel = _kernel(mosaic.pattern, row, column, colour, method)
                total, held = np.zeros(size, np.float32), np.zeros(size, bool)
                for down, across in np.argwhere(kernel):
                    rows = _every_second(row + int(down) - len(kernel) // 2, size[0])
                    columns = _every_second(column + int(across) - len(kernel) // 2, size[1])
                    total += np.float32(kernel[down, across]) * values[rows, columns]
                    held |= full[rows, columns]
                rgb[..., colour][place], saturated[..., colour][place] = total, held
    return rgb, saturated


def _every_second(first: int, count: int) -> slice:
    """Return where ``count`` photosites stand in the padded plane, the first of them at ``first`` of the plane."""
    return slice(first + _MARGIN, first + _MARGIN + 2 * count - 1, 2)


def _kernel(pattern: NDArray[np.int64], row: int, column: int, colour: int, method: Linear) -> NDArray[np.float64]:
    """Return the weights that make ``colour`` at the photosite (row, column) of the pattern."""
    here = int(pattern[row, column])
    if here == colour:
        return np.ones((1, 1))
    if colour == 1:
        return _GREEN if method == "malvar" else _CROSS
    if here == 1:
        along_row = pattern[row, 1 - column] == colour
        kernel = _BESIDE if method == "malvar" else _ROW
        return kernel if along_row else kernel.T
    return _ACROSS if method == "malvar" else _DIAGONAL
