"""Where a picture leaves the gamut, as a picture: for looking at, not for measuring."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.display.model import GAMUT_TOLERANCE, DisplayModel

# What is inside the gamut is shown grey, at this share of its own luminance, so that the marks stand out.
_DIMMED = 0.5


def clip_marks(model: DisplayModel, xyz_cd_m2: ArrayLike) -> NDArray[np.float32]:
    """Return XYZ, float32, shape (..., 3): pixels that ask too much light in red, those that ask too little in blue.

    A pixel that does both is magenta; the others keep half their luminance, in the display's white.
    """
    asked = np.asarray(xyz_cd_m2, dtype=np.float64)
    linear = model.linear(asked)
    above = np.any(linear > 1.0 + GAMUT_TOLERANCE, axis=-1, keepdims=True)
    below = np.any(linear < -GAMUT_TOLERANCE, axis=-1, keepdims=True)
    white = model.white_XYZ_cd_m2
    share = np.clip(_DIMMED * asked[..., 1:2] / white[1], 0.0, 1.0)
    marked = share * white
    red, blue = model.primaries_XYZ_cd_m2[:, 0], model.primaries_XYZ_cd_m2[:, 2]
    marks = above * red + below * blue + model.black_XYZ_cd_m2
    return np.asarray(np.where(above | below, marks, marked), dtype=np.float32)
