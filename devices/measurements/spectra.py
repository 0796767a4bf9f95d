"""Spectral radiance to XYZ, summed at the spectrum's own spacing."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.errors import DeviceError

Floats = NDArray[np.float64]

# Luminous efficacy, lm/W, at 540 THz.
EFFICACY = 683.0
_MOST_SPACING_NM = 20.0
_MUST_COVER_NM = (400.0, 700.0)


def xyz_from_spectra(spectra: ArrayLike, wavelengths_nm: ArrayLike) -> Floats:
    """Return XYZ in cd/m², shape (n, 3), of spectral radiance in W/(sr m² nm), shape (n, m).

    683 lm/W times the sum of spectrum, colour-matching functions of CIE 1931 2° (every nm, from colour-science) and the
    width of each band, which is half the way to either neighbour: any spacing up to 20 nm, even or not, such as 4 nm.

    Raises
    ------
    DeviceError
        If wavelengths do not rise, are too far apart, or leave out a part of 400..700 nm; or if shapes disagree.
    """
    light = np.atleast_2d(np.asarray(spectra, dtype=np.float64))
    waves = np.asarray(wavelengths_nm, dtype=np.float64)
    if waves.ndim != 1 or len(waves) < 2 or light.shape[1] != len(waves):
        raise DeviceError(f"spectra of shape {light.shape} do not go with {waves.size} wavelengths")
    gaps = np.diff(waves)
    if not np.all(np.isfinite(waves)) or np.any(gaps <= 0) or gaps.max() > _MOST_SPACING_NM:
        raise DeviceError(f"wavelengths must rise in steps of at most {_MOST_SPACING_NM:g} nm")
    if waves[0] > _MUST_COVER_NM[0] or waves[-1] < _MUST_COVER_NM[1]:
        raise DeviceError(f"spectra run over {waves[0]:g}..{waves[-1]:g} nm; 400..700 nm is the least that tells XYZ")
    width = np.concatenate([[gaps[0]], 0.5 * (gaps[:-1] + gaps[1:]), [gaps[-1]]])
    return np.asarray(EFFICACY * light @ (matching_functions(waves) * width[:, None]))


def matching_functions(wavelengths_nm: Floats) -> Floats:
    """Return x̄, ȳ, z̄ of CIE 1931 2°, shape (m, 3), at any wavelengths, 0 where they are not tabulated."""
    # Importing all of colour-science takes a second; only reading spectra waits for it.
    from colour.colorimetry.datasets.cmfs import MSDS_CMFS

    table = MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    known, values = np.asarray(table.wavelengths, dtype=np.float64), np.asarray(table.values, dtype=np.float64)
    columns = [np.interp(wavelengths_nm, known, values[:, i], left=0.0, right=0.0) for i in range(3)]
    return np.stack(columns, axis=1)
