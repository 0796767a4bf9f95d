"""Luminance and chroma to R, G and B, as OpenEXR defines them [OpenEXR]: Y, RY = (R − Y) / Y and BY = (B − Y) / Y.

Chroma of half the resolution is interpolated by OpenEXR's own library, in half floats, as OpenImageIO hands it over;
chroma of full resolution is converted here.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from devices.colour import rgb_to_xyz_matrix
from devices.errors import DeviceError
from stimuli.errors import StimulusError
from stimuli.pictures.exr_header import REC709

if TYPE_CHECKING:
    import OpenImageIO


def is_reconstructed(spec: OpenImageIO.ImageSpec) -> bool:
    """Whether the picture's chroma was stored at half its resolution: each row then depends on 26 others."""
    return bool(spec.getattribute("openexr:luminancechroma"))


def rgb_of(
    luminance_chroma: NDArray[np.float32], chromaticities: NDArray[np.float64] | None, path: Path
) -> NDArray[np.float32]:
    """Return R, G, B, float32 (height, width, 3), of Y, RY, BY of that shape, by (4, 2) ``chromaticities`` of RGB.

    Without ``chromaticities``, Rec. 709's, as OpenEXR defines. Without chroma all three are exactly Y.

    Raises
    ------
    StimulusError
        If the chromaticities are those of no RGB with a luminance of green.
    """
    try:
        weights = rgb_to_xyz_matrix(*(REC709 if chromaticities is None else chromaticities))[1]
    except DeviceError as error:
        raise StimulusError.at(path, str(error), "correct the picture's header") from error
    if not weights[1] > 0:
        message = "its chromaticities give green no luminance, and luminance and chroma then leave green open"
        raise StimulusError.at(path, message, "correct the picture's header")
    # What is not finite, or becomes so, is refused with the pixels of any other picture.
    with np.errstate(over="ignore", invalid="ignore"):
        Y, RY, BY = np.moveaxis(luminance_chroma.astype(np.float64), -1, 0)
        red, blue = (RY + 1.0) * Y, (BY + 1.0) * Y
        green = (Y - weights[0] * red - weights[2] * blue) / weights[1]
        rgb = np.stack([red, np.where((RY == 0) & (BY == 0), Y, green), blue], axis=-1)
        return rgb.astype(np.float32)
