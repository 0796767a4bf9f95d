"""Colour-matching functions x̄, ȳ, z̄ from cone fundamentals, for any field and age, by the method of CIE 170-2:2015.

    ȳ = a₂₁ l̄ + a₂₂ m̄     z̄ = a₃₃ s̄     x̄ = a₁₁ l̄ + a₁₂ m̄ + a₁₃ s̄

ȳ is the luminous efficiency, whose share of L is that of CIE 170-2 for 2° and age 32 (1.89 in quanta), with the same
pigments behind other media; it peaks at 1. z̄ has the area of ȳ, and so has x̄: light of equal energy has the
chromaticity (1/3, 1/3). Of all such x̄, those are kept whose spectrum has the same least chromaticity x as the
reference; and of these the one is taken whose spectrum locus lies nearest to the reference's by least squares. The
reference is CIE 1931 for 2°, CIE 1964 for 10°, and in between the locus that the programme of CIE TC 1-97 draws from
the two [CIETC197]. For 2° and 10° at age 32 the tables of CIE 2015 come out.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from devices.colour_matching.fundamentals import cone_fundamentals, peaks, quantal_fundamentals
from devices.colour_matching.observers import (
    CANDELA_NM,
    CIE_2006_NAME,
    ColorimetricObserver,
    canonical_name,
    cie_2006_name,
    standard_observer,
)
from documents.arrays import Floats

# Quanta of L per quantum of M in the luminous efficiency, both with a peak of 1, at 2° and age 32 [Sharpe2011].
_L_PER_M = 1.89


def cie_2006_functions(field_deg: float, age_years: float) -> tuple[Floats, Floats]:
    """Return the wavelengths (441,) and x̄, ȳ, z̄ (441, 3) for a field of 1..10 degrees and an age of 20..80 years."""
    waves, lms = cone_fundamentals(field_deg, age_years)
    return waves, lms @ xyz_from_lms(field_deg, age_years).T


def xyz_from_lms(field_deg: float, age_years: float) -> Floats:
    """Return the matrix (3, 3) from l̄, m̄, s̄ with peaks of 1 to x̄, ȳ, z̄.

    Parameters
    ----------
    field_deg
        The field of view in degrees, 1 to 10.
    age_years
        The age in years, 20 to 80.

    Returns
    -------
    ndarray
        Shape (3, 3). Its columns are XYZ of light that L, M or S cones alone would answer to.

    Raises
    ------
    DeviceError
        If the field or the age is out of range.

    Examples
    --------
    >>> xyz_from_lms(2.0, 32.0).round(3).tolist()
    [[1.947, -1.414, 0.365], [0.69, 0.348, 0.0], [0.0, 0.0, 1.935]]
    """
    waves, lms = cone_fundamentals(field_deg, age_years)
    matrix = np.zeros((3, 3))
    matrix[1, :2] = _luminous_shares(field_deg, age_years)
    luminance = lms @ matrix[1]
    top = peaks(luminance[:, None])[0]
    matrix[1] /= top
    luminance /= top
    matrix[2, 2] = luminance.sum() / lms[:, 2].sum()
    matrix[0] = _x_row(waves, lms, luminance, matrix[2, 2] * lms[:, 2], _reference_locus(field_deg))
    return matrix


def _luminous_shares(field_deg: float, age_years: float) -> tuple[float, float]:
    """Return the shares of l̄ and m̄, both with a peak of 1 in energy, in the luminous efficiency, in any unit."""

    def long_per_middle(age: float) -> float:
        tops = peaks(quantal_fundamentals(2.0, age))
        return float(tops[0] / tops[1])

    quanta = quantal_fundamentals(field_deg, age_years)
    waves, _ = cone_fundamentals(field_deg, age_years)
    # From a peak of 1 in quanta to a peak of 1 in energy.
    energy = peaks(quanta / peaks(quanta) * waves[:, None])
    long = _L_PER_M * long_per_middle(age_years) / long_per_middle(32.0)
    return long * float(energy[0]), float(energy[1])


def _reference_locus(field_deg: float) -> Floats:
    """Return the chromaticities x, y, z of the spectrum, 390..830 nm, shape (441, 3), that x̄ is fitted to."""
    share = (field_deg - 2.0) / 8.0
    loci = []
    for name in ("CIE 1931 2", "CIE 1964 10"):
        functions = colorimetric_observer(name).functions
        loci.append(functions / functions.sum(axis=1, keepdims=True))
    waves = colorimetric_observer("CIE 1931 2").wavelengths_nm
    # Features of the one locus are led to those of the other: the least x and the largest y.
    marks = [np.array([360.0, waves[np.argmin(xyz[:, 0])], waves[np.argmax(xyz[:, 1])], 700.0, 830.0]) for xyz in loci]
    between = (1.0 - share) * marks[0] + share * marks[1]
    at = np.arange(390.0, 831.0)
    drawn = np.zeros((len(at), 2))
    from scipy.interpolate import CubicSpline

    for xyz, own, weight in zip(loci, marks, (1.0 - share, share), strict=True):
        drawn += weight * CubicSpline(waves, xyz[:, :2])(np.interp(at, between, own))
    return np.column_stack([drawn, 1.0 - drawn.sum(axis=1)])


def _x_row(waves: Floats, lms: Floats, y: Floats, z: Floats, reference: Floats) -> Floats:
    """Return a₁₁, a₁₂, a₁₃: see the module; the wavelength of the least x is found by repetition."""
    least = float(reference[:, 0].min())
    place = int(np.searchsorted(waves, 502.0))
    for _ in range(20):
        # Two linear conditions on three numbers: the area, and x at the place of its least.
        conditions = np.stack([lms.sum(axis=0), (1.0 - least) * lms[place]])
        values = np.array([y.sum(), least * (y[place] + z[place])])
        start = np.linalg.lstsq(conditions, values, rcond=None)[0]
        along = np.cross(conditions[0] / np.linalg.norm(conditions[0]), conditions[1] / np.linalg.norm(conditions[1]))
        along /= np.linalg.norm(along)
        row = start + _nearest(lms @ start, lms @ along, y, z, reference) * along
        x = lms @ row
        found = int(np.argmin(x / (x + y + z)))
        if found == place:
            break
        place = found
    return np.asarray(row)


def _nearest(start: Floats, along: Floats, y: Floats, z: Floats, reference: Floats) -> float:
    """Return t for which the locus of x = start + t · along, y, z lies nearest to the reference's: Gauss-Newton."""
    t = 0.0
    for _ in range(50):
        x = start + t * along
        total = x + y + z
        off = np.stack([x, y, z], axis=1) / total[:, None] - reference
        slope = np.stack([y + z, -y, -z], axis=1) * (along / total**2)[:, None]
        step = float((slope * off).sum() / (slope * slope).sum())
        t -= step
        if abs(step) < 1e-13:
            break
    return t


def colorimetric_observer(name: str) -> ColorimetricObserver:
    """Return the colorimetric observer of a name.

    Parameters
    ----------
    name
        ``CIE 1931 2``, ``CIE 1964 10``, ``CIE 2015 2``, ``CIE 2015 10`` (year and field in degrees), or
        ``CIE 2006 FIELD age AGE`` with a field of 1 to 10 degrees and an age of 20 to 80 years, such as
        ``CIE 2006 4 age 45``. Case, dashes, underscores and degree signs do not matter; ``1964_10`` is understood.

    Returns
    -------
    ColorimetricObserver
        Its colour-matching functions at every nm.

    Raises
    ------
    DeviceError
        If there is no such observer, or the field or the age lies outside what CIE 170-1 covers.

    Examples
    --------
    >>> observer = colorimetric_observer("CIE 2015 10")
    >>> observer.field_deg, observer.functions_at([555.0]).tolist()
    (10.0, [[0.6230892, 0.9997775, 0.001426627]])
    """
    canonical = canonical_name(name)
    if match := CIE_2006_NAME.fullmatch(canonical):
        return _of_cie_2006(float(match[1]), float(match[2]))
    return standard_observer(canonical)


@lru_cache(maxsize=64)
def _of_cie_2006(field_deg: float, age_years: float) -> ColorimetricObserver:
    from devices.colour_matching.cie_2006_xyz import cie_2006_functions

    waves, functions = cie_2006_functions(field_deg, age_years)
    efficacy = 683.0 / float(np.interp(CANDELA_NM, waves, functions[:, 1]))
    return ColorimetricObserver(cie_2006_name(field_deg, age_years), field_deg, age_years, waves, functions, efficacy)
