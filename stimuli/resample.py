"""Pictures onto the display's pixel grid at true size: each new pixel holds the mean light over its own area."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stimuli.errors import StimulusError

if TYPE_CHECKING:
    from scipy.sparse import csr_array

MAX_PIXELS = 16384  # along one axis; no display has more


def area_weights(pixels: int, length_mm: float, pixel_pitch_mm: float) -> csr_array:
    """Return the sparse matrix (display pixels, pixels) of area weights along one axis.

    The ``pixels`` span ``length_mm``, centred on the display's whole pixels; their number is the nearest to the
    length. A weight is the share of the display pixel's width that a pixel covers: a display pixel that reaches
    beyond the picture receives light on the covered part only, and what the display pixels do not reach is cropped.
    """
    from scipy.sparse import csr_array

    if not (np.isfinite(pixel_pitch_mm) and pixel_pitch_mm > 0):
        raise StimulusError(f"pixel_pitch_mm is {pixel_pitch_mm}; it must be a finite number above 0")
    if length_mm / pixel_pitch_mm > MAX_PIXELS:
        raise StimulusError(f"{length_mm} mm at pixel_pitch_mm {pixel_pitch_mm} is more than {MAX_PIXELS} pixels")
    count = max(1, round(length_mm / pixel_pitch_mm))
    edges = (np.arange(count + 1) - 0.5 * count) * pixel_pitch_mm
    source = (np.arange(pixels + 1) / pixels - 0.5) * length_mm
    size = length_mm / pixels
    first = np.clip(np.floor((edges[:-1] - source[0]) / size).astype(np.int64) - 1, 0, pixels - 1)
    span = int(np.ceil(pixel_pitch_mm / size)) + 3
    index = np.minimum(first[:, None] + np.arange(span), pixels - 1)
    fresh = np.diff(index, axis=1, prepend=-1) > 0
    overlap = np.minimum(source[index + 1], edges[1:, None]) - np.maximum(source[index], edges[:-1, None])
    share = np.where(fresh, np.maximum(overlap, 0.0), 0.0) / pixel_pitch_mm
    rows = np.repeat(np.arange(count), span)
    keep = share.ravel() > 0
    return csr_array((share.ravel()[keep], (rows[keep], index.ravel()[keep])), shape=(count, pixels))


def resample(image: NDArray[np.floating], rows: csr_array, columns: csr_array) -> NDArray[np.float64]:
    """Return ``image`` (rows, columns) on the display's grid, float64, by the weights of `area_weights`."""
    return np.asarray((columns @ np.asarray(rows @ image).T).T)
