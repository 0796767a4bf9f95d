"""From a camera's picture to absolute XYZ through the camera's characterisation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from devices.camera import CameraModel
from devices.colour_matching import DEFAULT_OBSERVER
from documents import Finding
from documents.text import counted
from stimuli.develop.camera_image import CameraImage
from stimuli.errors import StimulusError

Negative = Literal["clip", "refuse"]


@dataclass(frozen=True, eq=False, slots=True)
class Developed:
    """XYZ in cd/m², float32 (height, width, 3), 0 or above, and how far it can be trusted.

    ``saturated`` is bool (height, width): a channel was full, so that the XYZ is a lower bound. ``below_safe`` and
    ``above_safe`` count pixels whose luminance is outside the zone that the camera was tested in, ``safe_cd_m2``, None
    where the camera file has none. ``clipped`` counts pixels with a negative XYZ that was set to 0, ``lowest`` is the
    lowest before. ``steps`` record all of it, after the steps of the camera's picture.
    """

    xyz: NDArray[np.float32]
    saturated: NDArray[np.bool_]
    safe_cd_m2: tuple[float, float] | None
    below_safe: int
    above_safe: int
    clipped: int
    lowest: float
    steps: tuple[Mapping[str, Any], ...]


def to_xyz(image: CameraImage, camera: CameraModel, *, negative: Negative = "clip") -> Developed:
    """Return the absolute XYZ of a photograph, scaled by its exposure relative to that of the camera model.

    Parameters
    ----------
    image
        Linear camera RGB.
    camera
        The camera's characterisation.
    negative
        What to do with XYZ below 0, from noise about black and colours outside the camera's gamut: ``clip`` it to 0 and
        count it, or ``refuse`` the picture.

    Returns
    -------
    Developed
        XYZ in cd/m² of the camera file's observer, float32 (height, width, 3), and how far it can be trusted.

    Raises
    ------
    StimulusError
        If the exposure is not known while the camera model's is, or XYZ is negative and refused.
    DeviceError
        If the camera model does not serve this exposure: see `CameraModel.xyz`.
    """
    if image.exposure is None and camera.exposure is not None:
        raise StimulusError(
            Finding(
                "the photograph's file has no exposure, and luminance depends on it",
                image.source,
                remedy=f"give it; the camera was characterised at {camera.exposure}",
            )
        )
    xyz = np.asarray(camera.xyz(image.rgb, image.exposure), dtype=np.float32)
    below, above = camera.unsafe(xyz, image.exposure)
    lowest = float(xyz.min())
    under = (xyz < 0).any(axis=-1)
    clipped = int(under.sum())
    if clipped and negative == "refuse":
        raise StimulusError(
            Finding(
                f"{counted(clipped, 'pixel has', 'pixels have')} negative XYZ, down to {lowest:.3g} cd/m²",
                image.source,
                remedy="check black level and camera file, or let them be set to 0",
            )
        )
    np.maximum(xyz, np.float32(0), out=xyz)
    saturated = np.asarray(image.saturated.any(axis=-1))
    zone = camera.safe_luminance(image.exposure)
    pixels = saturated.size
    step = {
        "step": "camera_to_xyz",
        "camera": camera.name,
        "camera_source": camera.source,
        "form": camera.form,
        "signal_beside_characterisation": camera.signal_scale(image.exposure),
        "safe_luminance_cd_m2": None if zone is None else list(zone),
        "below_safe_pixels": int(below.sum()),
        "above_safe_pixels": int(above.sum()),
        "saturated_pixels": int(saturated.sum()),
        "negative_pixels_set_to_0": clipped,
        "lowest_XYZ_cd_m2": min(lowest, 0.0),
        "pixels": pixels,
    } | ({} if camera.observer == DEFAULT_OBSERVER else {"observer": camera.observer})
    return Developed(xyz, saturated, zone, int(below.sum()), int(above.sum()), clipped, lowest, (*image.steps, step))
