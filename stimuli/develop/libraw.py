"""LibRaw's demosaicing, of values that have been linearised outside of it.

LibRaw would subtract black, scale, balance and clip in 16-bit integers on the way. Here it gets values that need none
of it: they are laid over its 16-bit range, with room below black so that noise stays, and laid back afterwards. What
was measured at a photosite is put back in full precision, so that only interpolated values are rounded.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from stimuli.develop.mosaic import Mosaic

if TYPE_CHECKING:
    import rawpy

    from stimuli.develop.demosaic import RGB

Adaptive = Literal["vng", "ppg", "ahd"]

# How far, in photosites, a value reaches: interpolated from, or decided upon by. AHD interpolates green from 2, its
# colour differences from 1 more, and compares directions over 1 and 1 more.
REACH_PX: dict[Adaptive, int] = {"vng": 2, "ppg": 4, "ahd": 5}
_TOP = 65535


def libraw_interpolate(raw: rawpy.RawPy, mosaic: Mosaic, method: Adaptive, gains: NDArray[np.float64]) -> RGB:
    """Return RGB float32 (height, width, 3) of ``mosaic``, and its saturation map, by LibRaw's ``method``.

    ``raw`` is the open file that the mosaic was read from; its photosites are overwritten. ``gains`` (3,) balance
    red, green and blue while directions are chosen and are taken back afterwards. The map marks every value within
    ``REACH_PX`` of a saturated photosite: all that it could have changed.
    """
    import rawpy

    low, high = _laid(mosaic, gains)
    scale = _TOP / (high - low)
    filters = np.empty(mosaic.values.shape, np.uint8)
    codes = raw.raw_image_visible
    for colour in range(3):
        for place in mosaic.places(colour):
            filters[place] = colour
            codes[place] = np.rint((mosaic.values[place] * gains[colour] - low) * scale)
    picture = raw.postprocess(
        demosaic_algorithm=rawpy.DemosaicAlgorithm[method.upper()],
        output_color=rawpy.ColorSpace.raw,
        output_bps=16,
        gamma=(1, 1),
        user_wb=[1, 1, 1, 1],
        user_black=0,
        user_cblack=[0, 0, 0, 0],
        user_sat=_TOP,
        user_flip=0,
        no_auto_bright=True,
        no_auto_scale=True,
        adjust_maximum_thr=0.0,
    )
    rgb = picture.astype(np.float32)
    rgb /= np.float32(scale)
    rgb += np.float32(low)
    rgb /= gains.astype(np.float32)
    for colour in range(3):
        for place in mosaic.places(colour):
            rgb[..., colour][place] = mosaic.values[place]
    near = _within(mosaic.saturated, REACH_PX[method])
    return rgb, np.repeat(near[..., None], 3, axis=2)


def quantum(mosaic: Mosaic, gains: NDArray[np.float64]) -> float:
    """Return the largest step, in shares of full scale, between the values that LibRaw is given of ``mosaic``."""
    low, high = _laid(mosaic, gains)
    return float((high - low) / _TOP / gains.min())


def _laid(mosaic: Mosaic, gains: NDArray[np.float64]) -> tuple[float, float]:
    """Return the balanced values that LibRaw's 0 and 65535 stand for: at least 0 and 1."""
    ends = [
        (float(mosaic.values[place].min()) * gains[colour], float(mosaic.values[place].max()) * gains[colour])
        for colour in range(3)
        for place in mosaic.places(colour)
    ]
    return min(0.0, *(low for low, _ in ends)), max(1.0, *(high for _, high in ends))


def _within(saturated: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    from scipy.ndimage import maximum_filter

    if not saturated.any():
        return saturated
    return np.asarray(maximum_filter(saturated, size=2 * reach + 1, mode="constant"))
