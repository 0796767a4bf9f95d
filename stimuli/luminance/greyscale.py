"""A picture without colour: each pixel keeps its luminance and gets one chromaticity."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from devices.colour.spaces import XYZ_from_xyY
from stimuli.errors import StimulusError
from stimuli.pictures.stereo_image import StereoImage, XYZImage


def greyscale(xyz_cd_m2: XYZImage, white_xy: ArrayLike) -> XYZImage:
    """Return XYZ (..., 3), float32, with the Y of ``xyz_cd_m2``, bit for bit, and the chromaticity ``white_xy`` (x, y).

    Thesis Section 4.5.1.1: the grayscale series.

    Raises
    ------
    StimulusError
        If no light has that chromaticity.
    """
    xy = np.asarray(white_xy, dtype=np.float64)
    if xy.shape != (2,) or not np.all(np.isfinite(xy)) or xy[0] < 0 or xy[1] <= 0 or xy.sum() > 1:
        raise StimulusError(f"no light has the chromaticity {xy.tolist()}; x, y and 1 - x - y are shares, y above 0")
    white = XYZ_from_xyY([*xy, 1.0]).astype(np.float32)
    return np.asarray(xyz_cd_m2[..., 1:2] * white)


def grey_picture(image: StereoImage, white_xy: ArrayLike) -> StereoImage:
    """Return the picture without colour; a flat picture stays flat. Raises as `greyscale` does."""
    left = greyscale(image.left, white_xy)
    return StereoImage(left, left if image.is_flat else greyscale(image.right, white_xy))
