"""From a camera's picture to an OpenEXR file that reads back as the same."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path

import numpy as np

from documents import Finding
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.metadata import EXPOSURE_ATTRIBUTE
from stimuli.develop.read_linear import SATURATED, STEPS_ATTRIBUTE
from stimuli.errors import StimulusError

_NO_TIME = "0000:00:00 00:00:00"


def write_camera_exr(path: Path, image: CameraImage) -> None:
    """Write ``image`` to ``path``, as a whole or not at all: R, G, B in single precision and the saturation map.

    Exposure and steps go along, and no chromaticities, because a camera's RGB has none. Nothing is rounded:
    `read_linear` returns the same numbers.

    Raises
    ------
    StimulusError
        If the file cannot be written.
    """
    import OpenImageIO as oiio

    path = Path(path)
    height, width, _ = image.rgb.shape
    spec = oiio.ImageSpec(width, height, 6, "float")
    spec.channelnames = ("R", "G", "B", *SATURATED)
    spec.channelformats = (oiio.FLOAT,) * 3 + (oiio.HALF,) * 3
    spec.attribute("compression", "zip")
    spec.attribute("DateTime", _NO_TIME)
    spec.attribute(STEPS_ATTRIBUTE, json.dumps(list(image.steps), ensure_ascii=False))
    if image.exposure:
        numbers = (image.exposure.time_s, image.exposure.f_number, image.exposure.iso)
        spec.attribute(EXPOSURE_ATTRIBUTE, json.dumps(numbers))
        spec.attribute("ExposureTime", numbers[0])
        spec.attribute("FNumber", numbers[1])
    pixels = np.concatenate([image.rgb, image.saturated.astype(np.float32)], axis=-1)
    try:
        descriptor, temporary = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=".exr", dir=path.parent)
        os.close(descriptor)
    except OSError as error:
        raise StimulusError(Finding(f"the picture cannot be written: {error.strerror}", str(path))) from error
    try:
        output = oiio.ImageOutput.create(temporary)
        if output is None:
            raise StimulusError(Finding(f"the picture cannot be written: {oiio.geterror().strip()}", str(path)))
        written = output.open(temporary, spec) and output.write_image(pixels)
        if not (output.close() and written):
            raise StimulusError(Finding(f"the picture cannot be written: {output.geterror().strip()}", str(path)))
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except OSError as error:
        raise StimulusError(Finding(f"the picture cannot be written: {error.strerror}", str(path))) from error
    finally:
        Path(temporary).unlink(missing_ok=True)
