"""From a photograph's file, raw or developed elsewhere, to a camera's picture."""

from __future__ import annotations

from pathlib import Path

from devices.camera import Exposure
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.levels import Levels
from stimuli.develop.linear_files import read_linear
from stimuli.develop.raw_files import DEFAULT_DEMOSAIC, Demosaic, read_raw
from stimuli.errors import StimulusError

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

    Returns
    -------
    CameraImage
        RGB in shares of full scale, float32 (height, width, 3), and which values are saturated.

    Raises
    ------
    StimulusError
        If the file cannot be read as either; the finding names the file and the reason.
    """
    path = Path(path)
    if path.suffix.lower() in _LINEAR_SUFFIXES:
        return read_linear(path, levels=levels, rotate=rotate, exposure=exposure, assume_linear=assume_linear)
    if path.is_file():
        with path.open("rb") as file:
            start = file.read(4)
        for magic, name in _CURVED.items():
            if start.startswith(magic):
                raise StimulusError.at(
                    path,
                    f"the picture is {name}: the camera's tone curve is in it, and cannot be taken out",
                    "give the raw file; or show the picture as it is, by a recipe of kind: pictures",
                )
    return read_raw(path, demosaic=demosaic, levels=levels, rotate=rotate, exposure=exposure)
