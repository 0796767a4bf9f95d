"""Spectra of lamps and reflectances on the CIE's grid of 5 nm, and the colours that they make."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stimuli.sparkle.scene import Spectrum

Floats = NDArray[np.float64]

FIRST_NM, LAST_NM, STEP_NM = 380, 780, 5
# Planck's second constant, in nm · K (CODATA 2018; exact since 2019).
_SECOND_CONSTANT_NM_K = 1.438776877e7


def wavelengths_nm() -> Floats:
    """Return the grid, shape (81,): 380 to 780 nm."""
    return np.arange(FIRST_NM, LAST_NM + 1, STEP_NM, dtype=np.float64)


def planck(temperature_K: float) -> Spectrum:
    """Return the spectrum of a black body, relative to its value at 560 nm; halogen lamps are close to one."""
    waves = wavelengths_nm()
    exponent = _SECOND_CONSTANT_NM_K / temperature_K
    light = (560.0 / waves) ** 5 * np.expm1(exponent / 560.0) / np.expm1(exponent / waves)
    return tuple(light.tolist())


def on_grid(nm: Sequence[float], values: Sequence[float]) -> Spectrum:
    """Return values at rising wavelengths on the grid: straight lines between, the first and last held beyond."""
    return tuple(np.interp(wavelengths_nm(), nm, values).tolist())


def XYZ_of(spectrum: Spectrum) -> Floats:
    """Return XYZ (3,) in cd/m² of a spectral radiance in W/(sr m² nm) on the grid."""
    from devices.measurements.spectra import xyz_from_spectra

    return np.asarray(xyz_from_spectra(np.array(spectrum), wavelengths_nm())[0])
