"""From a photograph's file, raw or developed elsewhere, to a camera's picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from devices.camera import Exposure
from documents.files import open_regular
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.levels import Levels
from stimuli.develop.linear_files import read_linear
from stimuli.develop.metadata import camera_name
from stimuli.develop.raw_files import read_sensor
from stimuli.develop.sensor_image import DEFAULT_DEMOSAIC, DEMOSAICS, Demosaic, SensorImage, make_picture
from stimuli.errors import StimulusError

if TYPE_CHECKING:
    from stimuli.develop.calibration_frames import Calibration

_LINEAR_SUFFIXES = (".tif", ".tiff", ".exr")
# The first bytes of files that a camera or a browser has already given a tone curve.
_CURVED = {b"\xff\xd8\xff": "a JPEG", b"\x89PNG": "a PNG", b"GIF8": "a GIF", b"RIFF": "a WebP"}


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


def read_sensor_image(
    path: Path,
    *,
    levels: Levels | None = None,
    rotate: bool = True,
    exposure: Exposure | None = None,
    assume_linear: bool = False,
) -> SensorImage:
    """Return the linear values of the sensor in a raw file, or those of a TIFF or OpenEXR file of linear camera RGB.

    Parameters and errors as of `read_camera_image`. The values of a TIFF or OpenEXR stand upright already.
    """
    path = Path(path)
    if path.suffix.lower() in _LINEAR_SUFFIXES:
        image = read_linear(path, levels=levels, rotate=rotate, exposure=exposure, assume_linear=assume_linear)
        steps = image.steps[:-1] if image.exposure else image.steps
        source = "told" if exposure else "metadata"
        return SensorImage(image.rgb, image.saturated, None, path, steps, image.exposure, source, camera_name(path))
    if path.exists():
        with open_regular(path, "photograph", error=StimulusError) as file:
            start = file.read(4)
        for magic, name in _CURVED.items():
            if start.startswith(magic):
                raise StimulusError.at(
                    path,
                    f"the picture is {name}: the camera's tone curve is in it, and cannot be taken out",
                    "give the raw file; or show the picture as it is, by a recipe of kind: pictures",
                )
    return read_sensor(path, levels=levels, rotate=rotate, exposure=exposure)
