"""Radiance of a spectral picture: its own, or that of a reflecting picture in a light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.colour_matching import DEFAULT_OBSERVER
from devices.readings import xyz_from_spectra
from documents.arrays import Floats
from documents.text import JsonResult
from stimuli.errors import StimulusError
from stimuli.spectral.curves import read_illuminant
from stimuli.spectral.picture import SpectralPicture, seen_bands

# Beyond these numbers overflow, or nothing is left of them.
LEAST, MOST = 1e-30, 1e30


@dataclass(frozen=True, slots=True)
class Illumination(JsonResult):
    """The illumination that turns a picture's values into radiance in W/(sr m² nm).

    Radiance is multiplied by ``scale`` where the file has another unit. Reflectance needs an ``illuminant`` (a CIE
    name, or a CSV file); a perfect diffuser in it has ``white_luminance_cd_m2``, or, where that is None, radiates
    E/π, the illuminant being irradiance E in W/(m² nm). Raises StimulusError if a number is not above 0.
    """

    illuminant: str | None = None
    white_luminance_cd_m2: float | None = None
    scale: float = 1.0

    def __post_init__(self) -> None:
        for name, value in (("white_luminance_cd_m2", self.white_luminance_cd_m2), ("scale", self.scale)):
            if value is not None and not (np.isfinite(value) and value > 0):
                raise StimulusError.of(f"'{name}' is {value}", "give a number above 0")
            if value is not None and not LEAST <= value <= MOST:
                raise StimulusError.of(f"'{name}' is {value:g}", f"give {LEAST:g} to {MOST:g}")

    def per_band(self, picture: SpectralPicture, observer: str = DEFAULT_OBSERVER) -> Floats:
        """Return the radiance that the value 1 stands for in each band, shape (bands,); white is for ``observer``.

        Raises
        ------
        StimulusError
            If a picture of reflectance has no illuminant, one of radiance has one, or the illuminant is dark.
        """
        waves = picture.wavelengths_nm
        if picture.quantity == "radiance":
            if self.illuminant is not None or self.white_luminance_cd_m2 is not None:
                raise picture.wrong("the picture is radiance, which has its light in it", "name no illuminant or white")
            return np.full(len(waves), self.scale)
        if self.illuminant is None:
            raise picture.wrong("the picture is reflectance, and no light falls on it", "name an illuminant")
        light = read_illuminant(self.illuminant, waves) * self.scale / np.pi
        if self.white_luminance_cd_m2 is None:
            return light
        luminance = float(light @ observer_weights(waves, observer)[:, 1])
        if not luminance > 0:
            raise picture.wrong(f"the illuminant {self.illuminant} has no light in the picture's bands", "name another")
        return np.asarray(light * (self.white_luminance_cd_m2 / luminance))


def observer_weights(wavelengths_nm: Floats, observer: str = DEFAULT_OBSERVER) -> Floats:
    """Return XYZ in cd/m², shape (bands, 3), of 1 W/(sr m² nm) in each band alone; 0 where the observer sees nothing.

    The rule is that of `devices.readings.spectra.xyz_from_spectra`: linear, so that bands can be weighted singly.
    """
    seen = seen_bands(wavelengths_nm)
    weights = np.zeros((len(wavelengths_nm), 3))
    weights[seen] = xyz_from_spectra(np.eye(int(seen.sum())), wavelengths_nm[seen], observer)
    return weights


def weighted(picture: SpectralPicture, weights: Floats) -> NDArray[np.float32]:
    """Return the picture's values times ``weights`` (bands, 3), summed over bands: float32 (height, width, 3)."""
    out = np.empty((picture.height_px, picture.width_px, 3), np.float32)
    used = np.flatnonzero(weights.any(axis=1))
    bands = slice(used[0], used[-1] + 1)
    for rows, values in picture.blocks():
        with np.errstate(over="ignore"):
            out[rows] = values[..., bands].astype(np.float64) @ weights[bands]
        if not np.isfinite(out[rows]).all():
            raise picture.wrong("its XYZ are beyond single precision", "correct the picture's values or their unit")
    return out


def spectral_step(name: str, picture: SpectralPicture, light: Illumination) -> dict[str, Any]:
    """Return the step with the file, its bands and its light."""
    from documents.files import sha256_of_file

    waves = picture.wavelengths_nm
    return {
        "step": name,
        "file": picture.path.name,
        "sha256": sha256_of_file(picture.path),
        "quantity": picture.quantity,
        "bands": len(waves),
        "first_nm": float(waves[0]),
        "last_nm": float(waves[-1]),
        "said": list(picture.notes),
        **light.to_json(),
    }
