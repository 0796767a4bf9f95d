"""From a spectral picture to what the standard observer sees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from documents.text.counting import counted
from stimuli.spectral.light import Light, observer_weights, spectral_step, weighted
from stimuli.spectral.picture import SpectralPicture


@dataclass(frozen=True, eq=False, slots=True)
class Observed:
    """XYZ in cd/m², float32 (height, width, 3), 0 or above; ``clipped`` pixels were below, down to ``lowest``."""

    xyz: NDArray[np.float32]
    clipped: int
    lowest: float
    steps: tuple[Mapping[str, Any], ...]


def spectral_to_xyz(
    picture: SpectralPicture, light: Light | None = None, *, negative: Literal["clip", "refuse"] = "refuse"
) -> Observed:
    """Return the absolute XYZ of ``picture`` by CIE 1931 2°, summed at its own spacing, a block of rows at a time.

    The sum is that of `devices.measurements.spectra.xyz_from_spectra`.

    Raises
    ------
    StimulusError
        If the light does not go with the picture, a value is NaN or infinite, or XYZ is negative and refused.
    """
    light = light or Light()
    waves = picture.wavelengths_nm
    weights = observer_weights(waves) * light.per_band(picture)[:, None]
    xyz = weighted(picture, weights)
    lowest = float(xyz.min())
    clipped = int((xyz < 0).any(axis=-1).sum())
    if clipped and negative == "refuse":
        raise picture.wrong(
            f"{counted(clipped, 'pixel has', 'pixels have')} negative XYZ, down to {lowest:.3g} cd/m²",
            "mend it, or let them be set to 0",
        )
    np.maximum(xyz, np.float32(0), out=xyz)
    step = {
        **spectral_step("spectra_to_xyz", picture, light),
        "observer": "CIE 1931 2°",
        "negative_pixels_set_to_0": clipped,
        "lowest_XYZ_cd_m2": min(lowest, 0.0),
    }
    return Observed(xyz, clipped, lowest, (step,))
