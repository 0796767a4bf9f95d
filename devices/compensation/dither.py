"""Dithering that keeps the mean light: between two adjacent codes, as often the upper as the light needs.

For light y between what codes k and k + 1 give, the upper is shown with probability p = (y − y_k)/(y_{k+1} − y_k):
the mean over a mask is then y itself. Dithering the code instead keeps the mean *code*, and because a tone curve is
convex that makes dark patches too bright. Which pixels show the upper code is decided by a void-and-cluster mask
[Ulichney1993], whose ranks, divided into 4096 equal steps, are compared with p.

`dither_codes` is the reference, in float64. `tabled_dither_codes` works as a shader does: a code from the fourth-root
table of `devices.display.code_table`, a neighbouring code where rounding put it on the wrong side, and p from a second
table
that holds the light of every code.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.compensation.dither_mask import SIZE_PX, load_mask
from devices.display.code_table import CodeTables, code_tables
from devices.display.curves import ENTRIES, Curve
from devices.display.display_file import Eye
from devices.display.model import DisplayModel
from devices.errors import DeviceError
from documents.arrays import Floats

Codes = NDArray[np.int64]
Masks = Literal["shared", "independent"]

LEVELS_8_BITS = 255

# (x, y) steps into the mask for red, green and blue of each eye. Six pieces of blue noise so far apart are as good as
# unrelated: the correlation of any two is below 0.05.
_SHIFTS_PX = {
    "left": ((42, 21), (0, 0), (20, 43)),
    "right": ((31, 53), (10, 32), (53, 11)),
}


@dataclass(frozen=True, slots=True)
class DitherTables:
    """What a shader needs for dithering: the code tables, and the light of each code, float32 (3, levels + 1).

    Light is as the code tables have it: lift taken off, full light still 1, never below 0.
    """

    codes: CodeTables
    lights: NDArray[np.float32]

    @property
    def levels(self) -> int:
        """The highest code."""
        return int(self.lights.shape[1]) - 1


def code_lights(curve: Curve, levels: int = LEVELS_8_BITS) -> Floats:
    """Return the light (share of full) of codes 0..levels, shape (levels + 1,).

    Parameters
    ----------
    curve
        The channel's tone curve.
    levels
        The highest code, in 1..65535: 255 for 8 bits.

    Returns
    -------
    ndarray
        Light as a share of full, shape (levels + 1,).

    Raises
    ------
    DeviceError
        If levels is not in 1..65535.

    Examples
    --------
    >>> from devices.display import ToneCurve
    >>> code_lights(ToneCurve(1.0, 0.0, 2.0), 4).tolist()
    [0.0, 0.0625, 0.25, 0.5625, 1.0]
    """
    if not 1 <= levels <= 65535:
        raise DeviceError(f"the highest code is {levels}; it must be in 1..65535 (255 for 8 bits, 1023 for 10)")
    return curve.linear(np.arange(levels + 1) / levels)


def dither_tables(model: DisplayModel, levels: int = LEVELS_8_BITS, entries: int = ENTRIES) -> DitherTables:
    """Build the tables of ``model`` for codes 0..levels, the code table with ``entries`` entries.

    Raises
    ------
    DeviceError
        If levels is not in 1..65535.
    """
    model = model.normalised
    tables = code_tables(model, entries)
    lights = [np.maximum(code_lights(curve, levels) - curve.lift, 0.0) / (1.0 - curve.lift) for curve in model.curves]
    return DitherTables(tables, np.stack(lights).astype(np.float32))


def mask_shifts_px(eye: Eye = "left", masks: Masks = "shared") -> NDArray[np.int64]:
    """Return how far into the mask each channel of ``eye`` starts, (3, 2): x and y of red, green and blue.

    ``shared`` gives both eyes the same masks, so that a flat picture stays the same in both; ``independent`` gives
    each eye its own, so that the grain of the two averages.

    Parameters
    ----------
    eye
        ``left`` or ``right``.
    masks
        ``shared`` or ``independent``.

    Returns
    -------
    ndarray
        Steps in pixels, integers in 0..63, shape (3, 2).

    Examples
    --------
    >>> mask_shifts_px("right").tolist() == mask_shifts_px("left").tolist()
    True
    >>> mask_shifts_px("right", "independent").tolist()
    [[31, 53], [10, 32], [53, 11]]
    """
    return np.array(_SHIFTS_PX[eye if masks == "independent" else "left"])


def dither_thresholds(height_px: int, width_px: int, eye: Eye = "left", masks: Masks = "shared") -> Floats:
    """Return u, strictly between 0 and 1, shape (height, width, 3): a channel shows the upper code where u < p.

    Pixel (0, 0) is the top left one of the eye's area. A mask period is 64 × 64 pixels.

    Parameters
    ----------
    height_px, width_px
        Size of the picture in pixels.
    eye
        ``left`` or ``right``; it counts only with independent masks.
    masks
        Whether both eyes have the same masks, ``shared``, or each its own, ``independent``.

    Returns
    -------
    ndarray
        u, shape (height_px, width_px, 3).

    Examples
    --------
    >>> u = dither_thresholds(64, 64)
    >>> u.shape, bool(u.min() > 0.0), bool(u.max() < 1.0), round(float(u.mean()), 6)
    ((64, 64, 3), True, True, 0.5)
    """
    mask = load_mask()
    rows, columns = np.arange(height_px), np.arange(width_px)
    channels = [
        mask[np.ix_((rows + y_px) % SIZE_PX, (columns + x_px) % SIZE_PX)] for x_px, y_px in mask_shifts_px(eye, masks)
    ]
    return (np.stack(channels, axis=-1) + 0.5) / mask.size


def adjacent_codes(light: ArrayLike, lights: Floats) -> tuple[Codes, Floats]:
    """Return the lower code k and the probability p of k + 1, both of the shape of ``light`` (share of full).

    ``lights`` is what `code_lights` gives. Light beyond the ends is shown as the end: p is then 0 or 1. Where a curve's
    first codes all give the same light, the highest of them stands for it, as in `DisplayModel.code`.
    """
    wanted = np.maximum(np.asarray(light, dtype=np.float64), lights[0])
    lower = np.clip(np.searchsorted(lights, wanted, side="right") - 1, 0, len(lights) - 2)
    step = lights[lower + 1] - lights[lower]
    share = np.divide(wanted - lights[lower], step, out=np.zeros_like(wanted), where=step > 0)
    return lower, np.clip(share, 0.0, 1.0)


def dither_codes(model: DisplayModel, xyz_cd_m2: ArrayLike, thresholds: Floats, levels: int = LEVELS_8_BITS) -> Codes:
    """Return dithered codes 0..levels for a picture in XYZ (cd/m², (height, width, 3)), in float64.

    ``thresholds`` broadcasts against the picture; see `dither_thresholds`. A colour outside the gamut is clipped.

    Parameters
    ----------
    model
        The display.
    xyz_cd_m2
        The picture, XYZ in cd/m², shape (height, width, 3).
    thresholds
        Thresholds in 0..1, shape (height, width, 3).
    levels
        The highest code, in 1..65535: 255 for 8 bits.

    Returns
    -------
    ndarray
        Integer codes 0..levels, shape (height, width, 3).

    Raises
    ------
    DeviceError
        If the picture holds a value that is not finite, or levels is not in 1..65535.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_display
    >>> display = read_display(Path("configs/displays/asus_vg248qe.yaml"))
    >>> model = display.models("side-by-side").left
    >>> grey = np.broadcast_to(0.2 * model.white_XYZ_cd_m2, (64, 64, 3))
    >>> codes = dither_codes(model, grey, dither_thresholds(64, 64))
    >>> codes.shape, np.ptp(codes, axis=(0, 1)).tolist()
    ((64, 64, 3), [1, 1, 1])
    """
    linear = _linear(model, xyz_cd_m2)
    out = np.empty(linear.shape, dtype=np.int64)
    thresholds = np.broadcast_to(thresholds, linear.shape)
    for channel, curve in enumerate(model.curves):
        lower, share = adjacent_codes(linear[..., channel], code_lights(curve, levels))
        out[..., channel] = lower + (thresholds[..., channel] < share)
    return out


def tabled_dither_codes(
    model: DisplayModel,
    xyz_cd_m2: ArrayLike,
    thresholds: Floats,
    tables: DitherTables,
    dtype: type[np.float32] | type[np.float64] = np.float32,
) -> Codes:
    """Return dithered codes by way of the tables, arithmetic after the primary matrix in ``dtype``: a shader's twin.

    Arguments and errors are those of `dither_codes`; the number of levels is that of ``tables``.
    """
    model = model.normalised
    linear = _linear(model, xyz_cd_m2)
    # The matrix and the lift work in 64 bits, as in the colour pass; from here on a shader has 32.
    lift = np.array([curve.lift for curve in model.curves])
    light = np.maximum((linear - lift) / (1.0 - lift), 0.0).astype(dtype)
    thresholds = np.broadcast_to(thresholds, linear.shape).astype(dtype)
    out = np.empty(linear.shape, dtype=np.int64)
    for channel in range(3):
        lights = tables.lights[channel].astype(dtype)
        lower = _lower_code(light[..., channel], tables.codes.codes[channel].astype(dtype), lights)
        step = lights[lower + 1] - lights[lower]
        above = light[..., channel] - lights[lower]
        share = np.divide(above, step, out=np.zeros_like(above), where=step > 0)
        out[..., channel] = lower + (thresholds[..., channel] < share)
    return out


def _lower_code(
    light: NDArray[np.floating], codes: NDArray[np.floating], lights: NDArray[np.floating]
) -> NDArray[np.int64]:
    """Return k with lights[k] ≤ light < lights[k + 1]: from the code table, moved by one where rounding erred."""
    last, levels = len(codes) - 1, len(lights) - 1
    place = np.sqrt(np.sqrt(light)) * light.dtype.type(last)
    below = np.clip(place.astype(np.int64), 0, last - 1)
    code = codes[below] + (codes[below + 1] - codes[below]) * (place - below.astype(light.dtype))
    lower = np.clip(np.floor(code * light.dtype.type(levels)).astype(np.int64), 0, levels - 1)
    lower = lower - (light < lights[lower]) + (light >= lights[lower + 1])
    return np.asarray(np.clip(lower, 0, levels - 1))


def _linear(model: DisplayModel, xyz_cd_m2: ArrayLike) -> Floats:
    linear = model.linear(xyz_cd_m2)
    if not np.all(np.isfinite(linear)):
        raise DeviceError(f"{np.count_nonzero(~np.isfinite(linear))} values of the picture are not finite numbers")
    return np.clip(linear, *model.limits)
