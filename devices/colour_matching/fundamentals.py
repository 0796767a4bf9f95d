"""Cone fundamentals for a field size and an age, by the expressions of CIE 170-1:2006 [CIE170-1].

The fundamentals at the cornea are what the photopigments absorb, behind the macular pigment and the ocular media:

    l̄(λ) = [1 − 10^(−D_L · 10^A_L(λ))] · 10^(−D_macula(λ) − D_ocular(λ)) · λ

and m̄ and s̄ likewise, A the low-density absorbance of the pigment. The peak densities depend on the field, the ocular
media's on the age. Tables: the absorbances and densities of Stockman and Sharpe [Stockman2000] at every nm, 390 to 830;
at 551..564 nm (macular pigment) and 661..673 nm (ocular media) densities are not 0 but up to 1.2e-4, so that the
published fundamentals come out, in which a spline rings there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from devices.colour_matching.observers import cie_2006_name, read_columns
from documents.arrays import Floats

# The macular pigment is tabulated with a peak of 0.35, the density for 2°.
_TABULATED_MACULA = 0.35


@dataclass(frozen=True, slots=True)
class Departure:
    """How far an individual is from the average of one age: shares of densities, and nanometres.

    ``lens``, ``macula``, ``density_L``, ``density_M``, ``density_S`` are added to 1 and multiply the optical densities;
    ``shift_L_nm`` and so on move the pigments' absorbances towards longer wavelengths.
    """

    lens: float = 0.0
    macula: float = 0.0
    density_L: float = 0.0
    density_M: float = 0.0
    density_S: float = 0.0
    shift_L_nm: float = 0.0
    shift_M_nm: float = 0.0
    shift_S_nm: float = 0.0


def peak_densities(field_deg: float) -> tuple[float, float, float]:
    """Return the peak optical densities of macular pigment, L and M pigment, S pigment (CIE 170-1, 3 decimals)."""
    macula = 0.485 * np.exp(-field_deg / 6.132)
    long_and_middle = 0.38 + 0.54 * np.exp(-field_deg / 1.333)
    short = 0.30 + 0.45 * np.exp(-field_deg / 1.333)
    return round(float(macula), 3), round(float(long_and_middle), 3), round(float(short), 3)


def ocular_density(age_years: float) -> Floats:
    """Return the optical density of lens and other media at 390..830 nm, shape (441,) [CIE170-1, Pokorny1987]."""
    table = _tables()
    growth = 1 + 0.02 * (age_years - 32) if age_years <= 60 else 1.56 + 0.0667 * (age_years - 60)
    return growth * (table.ocular_age_32 - table.ocular_2) + table.ocular_2


def quantal_fundamentals(field_deg: float, age_years: float, departure: Departure | None = None) -> Floats:
    """Return the quanta absorbed by L, M and S per quantum at the cornea, 390..830 nm, shape (441, 3), in any unit."""
    table = _tables()
    person = departure or Departure()
    macula, long_and_middle, short = peak_densities(field_deg)
    pigments = np.array([long_and_middle, long_and_middle, short])
    pigments *= 1 + np.array([person.density_L, person.density_M, person.density_S])
    shifts = (person.shift_L_nm, person.shift_M_nm, person.shift_S_nm)
    absorbance = np.stack([_shifted(i, shift) for i, shift in enumerate(shifts)], axis=1)
    absorbed = -np.expm1(-np.log(10) * pigments * 10.0**absorbance)
    before = macula * (1 + person.macula) * table.macula / _TABULATED_MACULA
    before += (1 + person.lens) * ocular_density(age_years)
    return np.asarray(absorbed * 10.0 ** -before[:, None])


def cone_fundamentals(field_deg: float, age_years: float) -> tuple[Floats, Floats]:
    """Return the cone fundamentals l̄, m̄, s̄ of CIE 170-1 in units of energy, each with a peak of 1.

    Parameters
    ----------
    field_deg
        The field of view in degrees, 1 to 10.
    age_years
        The age in years, 20 to 80.

    Returns
    -------
    tuple of ndarray
        The wavelengths 390..830 nm, shape (441,), and l̄, m̄, s̄, shape (441, 3). s̄ is 0 above 615 nm.

    Raises
    ------
    DeviceError
        If the field or the age lies outside what CIE 170-1 covers.

    Examples
    --------
    >>> waves, lms = cone_fundamentals(2.0, 32.0)
    >>> lms[100].round(4).tolist()
    [0.1916, 0.3036, 0.2119]
    """
    cie_2006_name(field_deg, age_years)
    waves = _tables().wavelengths_nm
    energy = quantal_fundamentals(field_deg, age_years) * waves[:, None]
    return waves, energy / peaks(energy)


def peaks(functions: Floats) -> Floats:
    """Return the largest value of each column between the tabulated nm, shape (k,): of a parabola at the top."""
    tops = []
    for column in functions.T:
        place = int(np.clip(np.argmax(column), 1, len(column) - 2))
        low, top, high = column[place - 1 : place + 2]
        tops.append(top + (high - low) ** 2 / (8.0 * (2.0 * top - low - high)))
    return np.array(tops)


@dataclass(frozen=True, slots=True)
class _Tables:
    wavelengths_nm: Floats
    log_absorbance: Floats
    macula: Floats
    ocular_age_32: Floats
    ocular_2: Floats


@lru_cache(maxsize=1)
def _tables() -> _Tables:
    waves, columns = read_columns("cie_2006.csv", 6)
    return _Tables(waves, columns[:, :3], columns[:, 3], columns[:, 4], columns[:, 5])


def _shifted(pigment: int, shift_nm: float) -> Floats:
    """Return an absorbance moved by ``shift_nm``: a cubic between the tabulated nm, a straight line beyond them."""
    table = _tables()
    if shift_nm == 0:
        return table.log_absorbance[:, pigment]
    cubic, slope = _cubics()[pigment]
    first, last = float(cubic.x[0]), float(cubic.x[-1])
    at = table.wavelengths_nm - shift_nm
    inner = np.clip(at, first, last)
    moved = cubic(inner) + slope(inner) * (at - inner)
    if last < table.wavelengths_nm[-1]:
        # Beyond the tabulated end of S there is nothing to see; the end moves along.
        moved[at > last] = -np.inf
    return np.asarray(moved)


@lru_cache(maxsize=1)
def _cubics() -> tuple[tuple[Any, Any], ...]:
    """Return the absorbance of each pigment, and its slope, as functions of wavelength."""
    from scipy.interpolate import CubicSpline

    table = _tables()
    cubics = []
    for column in table.log_absorbance.T:
        known = np.isfinite(column)
        cubic = CubicSpline(table.wavelengths_nm[known], column[known])
        cubics.append((cubic, cubic.derivative()))
    return tuple(cubics)
