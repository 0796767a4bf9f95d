"""ΔE00 pixel by pixel, and its mean as a measure; two pictures are read a few rows at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from devices.colour import delta_e_2000_of_xyz
from documents.arrays import Floats32
from stimuli.errors import StimulusError
from stimuli.measures.measure import MapMeasure
from stimuli.measures.viewing import ViewingConditions
from stimuli.pictures.rows import Rows, RowsDone, over_bands


def difference_map(
    photo: Rows, rendering: Rows, white_XYZ: ArrayLike, rows_done: RowsDone | None = None, *, filtered: bool = False
) -> Floats32:
    """Return ΔE00 between two pictures, pixel by pixel.

    Parameters
    ----------
    photo, rendering
        XYZ in one unit, (height, width, 3) each: arrays, or anything whose rows can be sliced. Light below 0, as a
        sensor's noise makes it, counts as none.
    white_XYZ
        The white of CIELAB, (3,), in the pictures' unit.
    rows_done
        Called with how many rows of how many are done.
    filtered
        The pictures are what the eye's filters leave: beside bright places that is below 0, and counts as it is. CIELAB
        goes on in a straight line there, so that a difference in the dark is not lost.

    Returns
    -------
    numpy.ndarray
        ΔE00, float32, (height, width).

    Raises
    ------
    StimulusError
        If the pictures differ in size, or hold NaN or infinity.

    Examples
    --------
    >>> photo = np.full((2, 3, 3), 50.0)
    >>> difference_map(photo, photo, [95.047, 100.0, 108.883]).tolist()
    [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    """
    if tuple(photo.shape) != tuple(rendering.shape) or len(photo.shape) != 3 or photo.shape[2] != 3:
        raise StimulusError(
            f"the pictures' shapes are {tuple(photo.shape)} and {tuple(rendering.shape)}; "
            "they must be one (height, width, 3): bring them to one grid first"
        )
    height, width = photo.shape[:2]
    out = np.empty((height, width), dtype=np.float32)

    def compare(band: slice) -> int:
        rows = (photo[band], rendering[band])
        if not all(np.isfinite(picture).all() for picture in rows):
            return int(np.count_nonzero(~np.logical_and(*(np.isfinite(picture).all(axis=-1) for picture in rows))))
        first, second = (picture if filtered else np.maximum(picture, 0.0) for picture in rows)
        out[band] = delta_e_2000_of_xyz(first, second, white_XYZ, of=height * width)
        return 0

    bad = sum(over_bands(compare, photo.shape, rows_done))
    if bad:
        raise StimulusError(f"{bad} pixels cannot be compared: one of the pictures holds NaN or infinity there")
    return out


class DeltaE2000(MapMeasure):
    """The mean of CIEDE2000 over the pixels."""

    name = "delta-e-2000"
    title = "ΔE00"
    unit = "ΔE"
    better = "lower"
    identical = 0.0
    source = "Sharma2005"
    map_title = "ΔE00"
    map_highest = 10.0
    symmetric = True

    def error_map(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> Floats32:
        """Return ΔE00 of each pixel, float32 (height, width)."""
        return difference_map(reference_XYZ, test_XYZ, viewing.cielab_white_XYZ)
