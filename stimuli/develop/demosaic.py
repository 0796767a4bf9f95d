"""From photosites to pixels: no interpolation at half size, two linear interpolations, or LibRaw's adaptive ones.

Each has a saturation map beside it that marks the values in which a saturated photosite has a part: exactly, or, for
LibRaw's, all that it could have changed.

LibRaw would subtract black, scale, balance and clip in 16-bit integers on the way. Here it gets values that need none
of it: they are laid over its 16-bit range, with room below black so that noise stays, and laid back afterwards. What
was measured at a photosite is put back in full precision, so that only interpolated values are rounded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from documents import in_threads
from stimuli.errors import StimulusError

if TYPE_CHECKING:
    import rawpy


COLOURS = ("red", "green", "blue")
Linear = Literal["bilinear", "malvar"]
RGB = tuple[NDArray[np.float32], NDArray[np.bool_]]

# Photosites of which the picture is interpolated at a time: some tens of megabytes of intermediate values.
BAND_PHOTOSITES = 1 << 20
_MARGIN = 2  # what the widest kernel reaches
_CROSS = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]]) / 4
_DIAGONAL = np.array([[1, 0, 1], [0, 0, 0], [1, 0, 1]]) / 4
_ROW = np.array([[0, 0, 0], [1, 0, 1], [0, 0, 0]]) / 2
# Malvar, He and Cutler, "High-quality linear interpolation", Figure 2: the bilinear value, corrected by the Laplacian
# of the colour that was measured there. [Malvar2004]
_GREEN = np.array([[0, 0, -1, 0, 0], [0, 0, 2, 0, 0], [-1, 2, 4, 2, -1], [0, 0, 2, 0, 0], [0, 0, -1, 0, 0]]) / 8
_BESIDE = np.array([[0, 0, 1, 0, 0], [0, -2, 0, -2, 0], [-2, 8, 10, 8, -2], [0, -2, 0, -2, 0], [0, 0, 1, 0, 0]]) / 16
_ACROSS = np.array([[0, 0, -3, 0, 0], [0, 4, 0, 4, 0], [-3, 0, 12, 0, -3], [0, 4, 0, 4, 0], [0, 0, -3, 0, 0]]) / 16

Adaptive = Literal["vng", "ppg", "ahd"]

# How far, in photosites, a value reaches: interpolated from, or decided upon by. AHD interpolates green from 2, its
# colour differences from 1 more, and compares directions over 1 and 1 more.
REACH_PX: dict[Adaptive, int] = {"vng": 2, "ppg": 4, "ahd": 5}
_TOP = 65535


@dataclass(frozen=True, eq=False, slots=True)
class Mosaic:
    """One linear value per photosite behind a Bayer filter.

    ``values`` is float32, (height, width): 0 is black, 1 full scale. ``saturated`` is bool of the same shape.
    ``pattern`` is (2, 2) with 0, 1, 2 for red, green, blue: the filter of the photosites in rows 0, 1 and columns
    0, 1, repeated over the sensor. Raises StimulusError if the shapes disagree, the sensor is smaller than 2 × 2, or
    the pattern is not one red, two diagonal greens and one blue.
    """

    values: NDArray[np.float32]
    saturated: NDArray[np.bool_]
    pattern: NDArray[np.int64]

    def __post_init__(self) -> None:
        if self.values.ndim != 2 or min(self.values.shape) < 2 or self.saturated.shape != self.values.shape:
            raise StimulusError(f"photosites of shape {self.values.shape}, saturation of {self.saturated.shape}")
        greens = np.argwhere(self.pattern == 1)
        if (
            self.pattern.shape != (2, 2)
            or sorted(self.pattern.ravel().tolist()) != [0, 1, 1, 2]
            or greens[0, 1] == greens[1, 1]
            or greens[0, 0] == greens[1, 0]
        ):
            raise StimulusError(f"the colour filter is {self.pattern.tolist()}; only Bayer patterns are developed")

    def places(self, colour: int) -> list[tuple[slice, slice]]:
        """Return where the photosites of ``colour`` (0, 1, 2) stand: one pair of slices, or two for green."""
        return [(slice(int(y), None, 2), slice(int(x), None, 2)) for y, x in np.argwhere(self.pattern == colour)]

    def saturated_photosites(self) -> dict[str, dict[str, float]]:
        """Return, per colour, how many photosites are saturated and the share of its photosites that is."""
        counts = {}
        for colour, name in enumerate(COLOURS):
            full = sum(int(self.saturated[place].sum()) for place in self.places(colour))
            of = sum(self.saturated[place].size for place in self.places(colour))
            counts[name] = {"photosites": full, "share": full / of}
        return counts


def by_bands(mosaic: Mosaic, method: Linear | Literal["superpixel"], keep: Callable[[slice, RGB], None]) -> None:
    """Call ``keep`` with a band of rows of the picture at a time: which rows, their RGB and their saturation map.

    Bands are shared among threads, so that ``keep`` is called by several, in any order; only the intermediate values of
    a band a thread are in memory.
    """
    height, width = mosaic.values.shape
    step = max(2, BAND_PHOTOSITES // width // 2 * 2)

    def make(first: int) -> None:
        rows = slice(first, min(first + step, height))
        if method == "superpixel":
            part = superpixel(Mosaic(mosaic.values[rows], mosaic.saturated[rows], mosaic.pattern))
            keep(slice(first // 2, first // 2 + len(part[0])), part)
        else:
            keep(rows, interpolate(mosaic, method, rows))

    in_threads(make, range(0, height // 2 * 2 if method == "superpixel" else height, step))


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


def interpolate(mosaic: Mosaic, method: Linear, rows: slice = slice(None)) -> RGB:
    """Return RGB float32 (rows, width, 3) and its saturation map, by ``bilinear`` or ``malvar`` interpolation.

    ``rows`` begin at an even row. A band of rows is computed from its own photosites and the two rows on either side,
    by the same operations in the same order as in the whole: the numbers are the same to the last bit.

    Measured values stay as they are. ``bilinear`` is the mean of the nearest photosites of that colour and never
    leaves their range. ``malvar`` adds the curvature of the colour measured there: sharper, and it may overshoot at
    edges, to below 0 as well. At the border the photosites are mirrored about the last one, which keeps the pattern.
    """
    first, last, _ = rows.indices(mosaic.values.shape[0])
    height, width = last - first, mosaic.values.shape[1]
    take = _mirrored(np.arange(first - _MARGIN, last + _MARGIN), mosaic.values.shape[0])
    beside = ((0, 0), (_MARGIN, _MARGIN))
    values = np.pad(mosaic.values[take], beside, mode="reflect")
    full = np.pad(mosaic.saturated[take], beside, mode="reflect")
    rgb = np.empty((height, width, 3), np.float32)
    saturated = np.empty((height, width, 3), bool)
    for row in range(2):
        for column in range(2):
            place = slice(row, None, 2), slice(column, None, 2)
            size = (height - row + 1) // 2, (width - column + 1) // 2
            for colour in range(3):
                kernel = _kernel(mosaic.pattern, row, column, colour, method)
                total, any_full = np.zeros(size, np.float32), np.zeros(size, bool)
                for down, across in np.argwhere(kernel):
                    rows = _every_second(row + int(down) - len(kernel) // 2, size[0])
                    columns = _every_second(column + int(across) - len(kernel) // 2, size[1])
                    total += np.float32(kernel[down, across]) * values[rows, columns]
                    any_full |= full[rows, columns]
                rgb[..., colour][place], saturated[..., colour][place] = total, any_full
    return rgb, saturated


def _mirrored(index: NDArray[np.intp], length: int) -> NDArray[np.intp]:
    """Return ``index`` with what lies outside 0 to ``length`` mirrored about the first or the last place."""
    period = 2 * (length - 1)
    inside = index % period
    return np.minimum(inside, period - inside)


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
