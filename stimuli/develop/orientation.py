"""Which way up a picture stands."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

# LibRaw's flip for each orientation of Exif (and TIFF), 1 to 8.
EXIF_FLIPS = {1: 0, 2: 1, 3: 3, 4: 2, 5: 4, 6: 6, 7: 7, 8: 5}


def turned(array: NDArray[Any], flip: int) -> NDArray[Any]:
    """Return ``array`` (height, width, ...) turned by the bits of LibRaw's ``flip``.

    2 reverses the rows, 1 the columns, and 4, done last, swaps rows with columns.
    """
    if flip & 2:
        array = array[::-1]
    if flip & 1:
        array = array[:, ::-1]
    return array.swapaxes(0, 1) if flip & 4 else array
