"""From a camera's picture to an OpenEXR file that reads back as the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from stimuli.develop.camera_image import CameraImage
from stimuli.develop.metadata import EXPOSURE_ATTRIBUTE
from stimuli.develop.read_linear import SATURATED, STEPS_ATTRIBUTE
from stimuli.pictures.exr.whole_file import write_whole


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
    spec.attribute(STEPS_ATTRIBUTE, json.dumps(list(image.steps), ensure_ascii=False))
    if image.exposure:
        numbers = (image.exposure.time_s, image.exposure.f_number, image.exposure.iso)
        spec.attribute(EXPOSURE_ATTRIBUTE, json.dumps(numbers))
        spec.attribute("ExposureTime", numbers[0])
        spec.attribute("FNumber", numbers[1])
    write_whole(path, spec, np.concatenate([image.rgb, image.saturated.astype(np.float32)], axis=-1))
