"""From a photograph's file, raw or developed elsewhere, to a camera's picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from devices.camera import Exposure
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.levels import Levels
from stimuli.develop.options import DEFAULT_DEMOSAIC, Demosaic
from stimuli.develop.raw_files import read_sensor_image
from stimuli.develop.sensor_image import DEMOSAICS, make_picture
from stimuli.errors import StimulusError

if TYPE_CHECKING:
    from stimuli.develop.calibration_frames import Calibration


def read_camera_image(
    path: Path,
    *,
    demosaic: Demosaic = DEFAULT_DEMOSAIC,
    levels: Levels | None = None,
    rotate: bool = True,
    exposure: Exposure | None = None,
    assume_linear: bool = False,
    calibration: Calibration | None = None,
) -> CameraImage:
    """Return the linear camera RGB in a raw file, or in a TIFF or OpenEXR file of linear camera RGB.

    Parameters
    ----------
    path
        The file.
    demosaic
        One of `stimuli.develop.raw_files.DEMOSAICS`, for raw files alone.
    levels
        Black, white and saturated level, in place of the file's.
    rotate
        Whether to turn the picture upright by the file's orientation.
    exposure
        In place of that of the file's metadata.
    assume_linear
        Whether to take a TIFF or OpenEXR file for linear camera RGB, whatever it declares.
    calibration
        Dark frames and flat fields, applied before colours are interpolated.

    Returns
    -------
    CameraImage
        RGB in shares of full scale, float32 (height, width, 3), and which values are saturated.

    Raises
    ------
    StimulusError
        If the file cannot be read as either; the finding names the file and the reason.
    """
    if demosaic not in DEMOSAICS:
        raise StimulusError.of(f"there is no demosaicing '{demosaic}'", f"one of {', '.join(DEMOSAICS)}")
    sensor = read_sensor_image(path, levels=levels, rotate=rotate, exposure=exposure, assume_linear=assume_linear)
    if calibration is not None:
        sensor = calibration.applied(sensor)
    return make_picture(sensor, demosaic)
