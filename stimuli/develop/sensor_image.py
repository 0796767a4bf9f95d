"""What a sensor recorded, before its colours are interpolated, and the picture made of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from devices.camera import Exposure
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.demosaic import (
    REACH_PX,
    RGB,
    Adaptive,
    Linear,
    Mosaic,
    by_bands,
    libraw_interpolate,
    quantum,
)
from stimuli.develop.metadata import exposure_step
from stimuli.develop.options import DEFAULT_DEMOSAIC, Demosaic
from stimuli.errors import StimulusError
from stimuli.pictures.picture_pixels import turned, unturned

DEMOSAICS: tuple[Demosaic, ...] = get_args(Demosaic)


@dataclass(frozen=True, eq=False, slots=True)
class SensorImage:
    """Linear values of a sensor, black 0 and full scale 1, and all that is needed to make a picture of them.

    ``values`` is float32 and ``saturated`` bool: (height, width), one value for each photosite behind a Bayer filter of
    ``pattern`` (2, 2); or (height, width, 3) where the file has three colours for each pixel; ``pattern`` is then None.
    ``camera`` is its make and model, empty where the file does not say. ``flip`` is LibRaw's, applied when the picture
    is made. ``exposure_source`` says whether the exposure is the file's or was given. ``gains`` (3,) balance the
    colours while LibRaw chooses directions.
    """

    values: NDArray[np.float32]
    saturated: NDArray[np.bool_]
    pattern: NDArray[np.int64] | None
    source: Path
    steps: tuple[Mapping[str, Any], ...]
    exposure: Exposure | None = None
    exposure_source: str = "metadata"
    camera: str = ""
    flip: int = 0
    gains: NDArray[np.float64] | None = None

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the sensor's picture as it is stored."""
        return self.values.shape[1], self.values.shape[0]

    def planes(self) -> list[list[tuple[slice, ...]]]:
        """Return where the values of red, green and blue stand: a list of places for each colour."""
        if self.pattern is None:
            return [[(slice(None), slice(None), colour)] for colour in range(3)]  # type: ignore[list-item]
        mosaic = Mosaic(self.values, self.saturated, self.pattern)
        return [list(mosaic.places(colour)) for colour in range(3)]

    def upright(self, array: NDArray[Any]) -> NDArray[Any]:
        """Return an ``array`` (height, width, ...) that lies as the sensor does, turned as ``flip`` says."""
        return turned(array, self.flip)


def make_picture(sensor: SensorImage, method: Demosaic = DEFAULT_DEMOSAIC) -> CameraImage:
    """Return the picture of a sensor's values: colours interpolated by ``method``, turned as ``sensor.flip`` says.

    Superpixel, bilinear and malvar go through the sensor a band of rows at a time; LibRaw's own methods through all of
    it.

    Raises
    ------
    StimulusError
        If there is no such method.
    """
    if method not in DEMOSAICS:
        raise StimulusError.of(f"there is no demosaicing '{method}'", f"one of {', '.join(DEMOSAICS)}")
    step: dict[str, Any] = {"step": "demosaic", "method": method}
    if sensor.pattern is None:
        step["method"] = "none"
        rgb, saturated = (np.ascontiguousarray(sensor.upright(plane)) for plane in (sensor.values, sensor.saturated))
    elif method in get_args(Adaptive):
        rgb, saturated = _adaptive(sensor, cast(Adaptive, method), step)
    else:
        rgb, saturated = _linear(sensor, cast(Linear, method))
    steps = sensor.steps
    if sensor.pattern is not None:
        step["saturated_pixels"] = [int(np.count_nonzero(saturated[..., colour])) for colour in range(3)]
        steps += (step,)
    if sensor.pattern is not None or sensor.flip:
        steps += ({"step": "rotate", "libraw_flip": sensor.flip, "size_px": [rgb.shape[1], rgb.shape[0]]},)
    if sensor.exposure:
        steps += (exposure_step(sensor.exposure, sensor.exposure_source),)
    return CameraImage(rgb, saturated, sensor.exposure, str(sensor.source), steps)


def _linear(sensor: SensorImage, method: Linear | Literal["superpixel"]) -> RGB:
    assert sensor.pattern is not None
    height, width = (side // (2 if method == "superpixel" else 1) for side in sensor.values.shape)
    upright = (width, height) if sensor.flip & 4 else (height, width)
    rgb = np.empty((*upright, 3), np.float32)
    saturated = np.empty((*upright, 3), bool)
    # Views that stand as the sensor does, of pictures that stand upright.
    as_stored = unturned(rgb, sensor.flip), unturned(saturated, sensor.flip)

    def keep(rows: slice, part: RGB) -> None:
        as_stored[0][rows], as_stored[1][rows] = part

    by_bands(Mosaic(sensor.values, sensor.saturated, sensor.pattern), method, keep)
    return rgb, saturated


def _adaptive(sensor: SensorImage, method: Adaptive, step: dict[str, Any]) -> RGB:
    import rawpy

    assert sensor.pattern is not None
    mosaic = Mosaic(sensor.values, sensor.saturated, sensor.pattern)
    gains = np.ones(3) if sensor.gains is None else sensor.gains
    step["balance_while_choosing_directions"] = gains.tolist()
    step["rounded_to_full_scale"] = quantum(mosaic, gains)
    step["saturation_reach_px"] = REACH_PX[method]
    with rawpy.imread(str(sensor.source)) as raw:
        rgb, saturated = libraw_interpolate(raw, mosaic, method, gains)
    return np.ascontiguousarray(turned(rgb, sensor.flip)), np.ascontiguousarray(turned(saturated, sensor.flip))
