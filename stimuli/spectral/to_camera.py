"""From a spectral picture to what a camera records: the virtual camera of thesis Section 5.4.

Two spectra that the observer cannot tell apart may differ to a camera. Through the sensor's own sensitivities a
rendering becomes comparable with a photograph, number by number, metamerism included.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from devices.camera.exposure import Exposure
from documents import Finding
from stimuli.develop.camera_image import CameraImage
from stimuli.errors import StimulusError
from stimuli.spectral.curves import read_sensitivities
from stimuli.spectral.light import LEAST, MOST, Light, observer_weights, spectral_step, weighted
from stimuli.spectral.picture import SpectralPicture


def spectral_to_camera(
    picture: SpectralPicture,
    sensitivities: Path,
    full_scale_luminance_cd_m2: float,
    light: Light | None = None,
    *,
    exposure: Exposure | None = None,
) -> CameraImage:
    """Return linear camera RGB of ``picture``, summed at its own spacing, a block of rows at a time.

    The sensor's gain is such that light of equal energy at every wavelength and of ``full_scale_luminance_cd_m2``
    just fills the first of its channels. Channels beyond that stay at 1 and are marked saturated; noise and lens are
    left out. ``exposure`` is kept with the picture.

    Raises
    ------
    StimulusError
        If the sensitivities or the light do not go with the picture, or a value is NaN or infinite.
    """
    if not (np.isfinite(full_scale_luminance_cd_m2) and full_scale_luminance_cd_m2 > 0):
        raise StimulusError(
            Finding(f"full scale is at {full_scale_luminance_cd_m2} cd/m²", remedy="give a luminance above 0")
        )
    if not LEAST <= full_scale_luminance_cd_m2 <= MOST:
        message = f"full scale is at {full_scale_luminance_cd_m2:g} cd/m²"
        raise StimulusError(Finding(message, remedy=f"{LEAST:g} to {MOST:g} is what it can be"))
    light = light or Light()
    waves = picture.wavelengths_nm
    # As wide as half the way to either neighbour, and to the only one at the ends.
    seen = read_sensitivities(sensitivities, waves) * np.gradient(waves)[:, None]
    luminance = float(observer_weights(waves)[:, 1].sum())
    filled = float(seen.sum(axis=0).max())
    if not filled > 0:
        raise picture.wrong(f"{sensitivities.name} sees nothing in the picture's bands", "check its wavelengths")
    gain = luminance / (full_scale_luminance_cd_m2 * filled)
    rgb = weighted(picture, gain * seen * light.per_band(picture)[:, None])
    saturated = rgb >= 1
    np.minimum(rgb, np.float32(1), out=rgb)
    step = {
        **spectral_step("spectra_to_camera", picture, light),
        "sensitivities": sensitivities.name,
        "full_scale_luminance_cd_m2": full_scale_luminance_cd_m2,
        "saturated_pixels": saturated.reshape(-1, 3).sum(axis=0).tolist(),
    }
    return CameraImage(rgb, saturated, exposure, str(picture.path), (step,))
