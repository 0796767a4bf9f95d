"""One photograph, from its file to an OpenEXR file of absolute XYZ or of linear camera RGB, and what was done to it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from devices.camera.camera_model import CameraModel
from devices.camera.exposure import Exposure
from documents import Finding
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.levels import Levels
from stimuli.develop.linear_files import write_camera_exr
from stimuli.develop.read import read_camera_image
from stimuli.develop.read_raw import DEFAULT_DEMOSAIC, Demosaic
from stimuli.develop.to_xyz import Negative, to_xyz
from stimuli.errors import StimulusError
from stimuli.pictures.exr_write import write_exr
from stimuli.pictures.stereo_image import StereoImage


@dataclass(frozen=True, slots=True)
class Choices:
    """How photographs are developed: see `read_camera_image` and `to_xyz`; without ``camera`` they stay camera RGB."""

    camera: CameraModel | None = None
    demosaic: Demosaic = DEFAULT_DEMOSAIC
    levels: Levels | None = None
    rotate: bool = True
    exposure: Exposure | None = None
    assume_linear: bool = False
    negative: Negative = "clip"


def develop_photograph(photo: Path, output: Path, choices: Choices) -> dict[str, Any]:
    """Write ``output`` (.exr) and, beside it, its steps (.steps.json); return what there is to tell.

    Raises
    ------
    StimulusError, DeviceError
        If the photograph cannot be read or does not go with the camera file, and neither file is then touched; or if
        they cannot be written.
    """
    image = read_camera_image(
        photo,
        demosaic=choices.demosaic,
        levels=choices.levels,
        rotate=choices.rotate,
        exposure=choices.exposure,
        assume_linear=choices.assume_linear,
    )
    if choices.camera is None:
        told = _told(photo, output, image, "camera RGB")
        write_camera_exr(output, image)
    else:
        developed = to_xyz(image, choices.camera, negative=choices.negative)
        told = _told(photo, output, image, "XYZ")
        luminance = developed.xyz[..., 1]
        told |= {
            "mean_luminance_cd_m2": float(luminance.mean(dtype=np.float64)),
            "max_luminance_cd_m2": float(luminance.max()),
            "safe_luminance_cd_m2": None if developed.safe_cd_m2 is None else list(developed.safe_cd_m2),
            "below_safe_pixels": developed.below_safe,
            "above_safe_pixels": developed.above_safe,
            "negative_pixels_set_to_0": developed.clipped,
            "exposure_was_characterised": None if image.exposure is None else choices.camera.tried_at(image.exposure),
            "steps": [dict(step) for step in developed.steps],
        }
        write_exr(output, StereoImage.flat(developed.xyz))
    sidecar = output.with_suffix(".steps.json")
    try:
        sidecar.write_text(json.dumps(told, indent=1, allow_nan=False, ensure_ascii=False) + "\n", encoding="utf-8")
    except OSError as error:
        raise StimulusError(Finding(f"the steps cannot be written: {error.strerror}", str(sidecar))) from error
    return told


def _told(photo: Path, output: Path, image: CameraImage, holds: str) -> dict[str, Any]:
    exposure = image.exposure
    return {
        "photo": photo.name,
        "output": output.name,
        "holds": holds,
        "width_px": int(image.rgb.shape[1]),
        "height_px": int(image.rgb.shape[0]),
        "exposure": None
        if exposure is None
        else {"time_s": exposure.time_s, "f_number": exposure.f_number, "iso": exposure.iso, "ev": exposure.ev},
        "saturated_share": list(image.saturated_share),
        "said": list(image.full_early()),
        "steps": [dict(step) for step in image.steps],
    }
