"""Saturated pixels where nobody marked them: values at full scale."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.validation.row_source import RowSource


class AtFullScale:
    """Which channels of a picture, (height, width, 3), reach ``full_scale``: rows of booleans, by slicing.

    The picture is that of the sensor, such as linear camera RGB in shares of full scale; XYZ has no full scale.
    """

    def __init__(self, picture: RowSource, full_scale: float = 1.0) -> None:
        self._picture = picture
        self._full_scale = full_scale

    def __getitem__(self, rows: slice, /) -> NDArray[np.bool_]:
        """Return those rows, (rows, width, 3)."""
        return np.asarray(self._picture[rows] >= self._full_scale)
