"""Spectral radiance to XYZ, summed at the spectrum's own spacing; the spectra of a ``.ti3`` file.

A ``.ti3`` has the keywords ``SPECTRAL_BANDS``, ``SPECTRAL_START_NM`` and ``SPECTRAL_END_NM``, and fields ``SPEC_nnn``.
ArgyllCMS writes radiance in mW/(sr m² nm) and names each field by the nearest whole nm, so that bands of 3⅓ nm follow
from the first, the last and their number. Some programs scale the spectra with XYZ and some do not: where a file has
both, the scale comes from them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from devices.colour_matching.cie_2006_xyz import colorimetric_observer
from devices.colour_matching.observers import canonical_name
from devices.errors import DeviceError
from devices.readings.cgats import CgatsTable
from devices.readings.table import CIE_1931_2, Measurements
from documents import Finding
from documents.arrays import Floats

_MOST_SPACING_NM = 20.0
# Beyond it what the spacing may do to XYZ is said.
_FINE_NM = 5.0
_MUST_COVER_NM = (400.0, 700.0)
FIELD = re.compile(r"SPEC_(\d+(?:\.\d+)?)")
_WATTS = 1e-3
# Beyond the first the scale is another than mW; beyond the second, the light: shares of the brightest Y.
_OTHER_SCALE, _OTHER_LIGHT = 0.05, 0.02


def xyz_from_spectra(spectra: ArrayLike, wavelengths_nm: ArrayLike, observer: str = CIE_1931_2) -> Floats:
    """Return XYZ in cd/m², shape (n, 3), of spectral radiance in W/(sr m² nm), shape (n, m).

    The observer's luminous efficacy (683 lm/W for CIE 1931 2°) times the sum of spectrum, colour-matching functions and
    the width of each band, which is half the way to either neighbour: any spacing up to 20 nm, even or not, such as
    4 nm.

    Parameters
    ----------
    spectra
        Spectral radiance in W/(sr m² nm), shape (n, m), or (m,) for a single one.
    wavelengths_nm
        Wavelengths in nanometres, shape (m,), rising, at most 20 nm apart, over 400..700 nm at least.
    observer
        The name of a colorimetric observer, such as ``CIE 1931 2``, ``CIE 2015 10`` or ``CIE 2006 4 age 45``.

    Returns
    -------
    ndarray
        XYZ in cd/m², shape (n, 3).

    Raises
    ------
    DeviceError
        If there is no such observer; if wavelengths do not rise, are too far apart, or leave out a part of 400..700 nm;
        or if shapes disagree.

    Examples
    --------
    >>> wavelengths_nm = np.arange(380, 781, 5)
    >>> xyz_from_spectra(np.full(81, 0.001), wavelengths_nm).round(1).tolist()
    [[73.0, 73.0, 73.0]]
    """
    light = np.atleast_2d(np.asarray(spectra, dtype=np.float64))
    waves = np.asarray(wavelengths_nm, dtype=np.float64)
    if waves.ndim != 1 or len(waves) < 2 or light.shape[1] != len(waves):
        raise DeviceError(f"spectra of shape {light.shape} do not go with {waves.size} wavelengths")
    gaps = np.diff(waves)
    if not np.all(np.isfinite(waves)) or np.any(gaps <= 0) or gaps.max() > _MOST_SPACING_NM:
        what = f"wavelengths must rise in steps of at most {_MOST_SPACING_NM:g} nm"
        raise DeviceError(Finding(what, remedy=f"measure finer: XYZ for {observer} cannot be summed"))
    if waves[0] > _MUST_COVER_NM[0] or waves[-1] < _MUST_COVER_NM[1]:
        what = f"spectra run over {waves[0]:g}..{waves[-1]:g} nm; 400..700 nm is the least that XYZ need"
        raise DeviceError(Finding(what, remedy=f"measure wider: XYZ for {observer} cannot be summed"))
    with np.errstate(over="ignore", invalid="ignore"):
        XYZ = light @ _band_weights(waves, observer)
    if not np.all(np.isfinite(XYZ)):
        raise DeviceError(Finding("spectra hold numbers that are no light", remedy="W/(sr m² nm), finite"))
    return np.asarray(XYZ)


def _band_weights(waves: Floats, observer: str) -> Floats:
    """Return XYZ in cd/m², shape (m, 3), of 1 W/(sr m² nm) in each band alone."""
    gaps = np.diff(waves)
    width = np.concatenate([[gaps[0]], 0.5 * (gaps[:-1] + gaps[1:]), [gaps[-1]]])
    seen = colorimetric_observer(observer)
    return np.asarray(seen.efficacy_lm_W * seen.functions_at(waves) * width[:, None])


def sampling_error(spectra: ArrayLike, wavelengths_nm: ArrayLike, observer: str = CIE_1931_2) -> float:
    """Return what the spacing of spectra may do to their XYZ, as a share of the largest Y.

    It is by how much XYZ change where the spectra are joined by straight lines and summed at every nm. For 9 of
    10 spectra of three peaks, 20 to 100 nm wide, drawn at random, the true error stays below it up to 20 nm.

    Parameters
    ----------
    spectra
        Spectral radiance, shape (n, m), or (m,) for a single one.
    wavelengths_nm
        Wavelengths in nanometres, shape (m,), as `xyz_from_spectra` takes them.
    observer
        The name of a colorimetric observer.

    Returns
    -------
    float
        The largest change of X, Y or Z, divided by the largest Y; 0 where there is no light.

    Raises
    ------
    DeviceError
        As `xyz_from_spectra`.

    Examples
    --------
    >>> coarse, fine = np.arange(380, 781, 20), np.arange(380, 781)
    >>> sampling_error(np.exp(-(((coarse - 530) / 12) ** 2)), coarse) > 0.02
    True
    >>> sampling_error(np.exp(-(((fine - 530) / 12) ** 2)), fine) < 1e-12
    True
    """
    light, waves = np.atleast_2d(np.asarray(spectra, dtype=np.float64)), np.asarray(wavelengths_nm, dtype=np.float64)
    own = xyz_from_spectra(light, waves, observer)
    fine = np.union1d(np.arange(np.ceil(waves[0]), np.floor(waves[-1]) + 1), waves)
    # Straight lines between bands: each band's weight is spread over the wavelengths up to its neighbours.
    hats = np.stack([np.interp(fine, waves, row) for row in np.eye(len(waves))], axis=1)
    joined = light @ (hats.T @ _band_weights(fine, observer))
    brightest = float(own[:, 1].max(initial=0.0))
    return float(np.abs(joined - own).max() / brightest) if brightest > 0 else 0.0


def sampling_note(spectra: Floats, wavelengths_nm: Floats, observer: str) -> list[str]:
    """Return a sentence on what the spacing of spectra may do to their XYZ; none where it is 5 nm or less."""
    spacing = float(np.diff(wavelengths_nm).max())
    if spacing <= _FINE_NM:
        return []
    share = 100 * sampling_error(spectra, wavelengths_nm, observer)
    return [f"spectra at steps of {spacing:g} nm: XYZ for {observer} may be off by up to {share:.2g} % of white"]


@dataclass(frozen=True, slots=True, eq=False)
class Spectra:
    """``per_nm`` (n, m) in W/(sr m² nm) at ``wavelengths_nm`` (m,), their ``XYZ`` (n, 3), and ``notes`` on them."""

    per_nm: Floats
    wavelengths_nm: Floats
    XYZ: Floats
    notes: list[str]


def read_spectra(
    table: CgatsTable, fields: Sequence[str], values: Floats, XYZ: Floats | None, observer: str = CIE_1931_2
) -> Spectra:
    """Return the spectra whose ``fields`` hold ``values`` (n, m); ``XYZ`` (n, 3) are the file's, if it has any.

    ``XYZ`` are compared with those of the spectra for the same ``observer``.

    Raises
    ------
    DeviceError
        With line and column: if the wavelengths do not fit together, or are too few for XYZ.
    """
    waves, notes = _wavelengths(table, fields)
    order = np.argsort(waves)
    waves, per_nm = waves[order], values[:, order] * _WATTS
    at = table.keywords.get("SPECTRAL_BANDS", next(cell for cell in table.fields if cell.text == fields[0]))
    try:
        own = xyz_from_spectra(per_nm, waves, observer)
    except DeviceError as error:
        raise DeviceError([table.finding(f.message, at, f.remedy or "") for f in error.findings]) from error
    if XYZ is None:
        notes += ["XYZ were summed from the spectra, which were taken to be in mW"]
        return Spectra(per_nm, waves, own, [*notes, *sampling_note(per_nm, waves, observer)])
    power = float(own[:, 1] @ own[:, 1])
    scale = float(own[:, 1] @ XYZ[:, 1]) / power if power > 0 else 1.0
    if scale <= 0 or not math.isfinite(scale):
        return Spectra(per_nm, waves, own, [*notes, "the spectra do not go with XYZ; their scale is not known"])
    if abs(scale - 1) > _OTHER_SCALE:
        notes.append(f"the spectra were multiplied by {scale:.4g}, so that their Y is that of the file")
        per_nm, own = per_nm * scale, own * scale
    off = float(np.abs(own - XYZ).max() / max(XYZ[:, 1].max(), 1e-12))
    if off > _OTHER_LIGHT:
        notes.append(f"XYZ differ from those of the spectra by up to {100 * off:.1f} % of white; XYZ were kept")
    return Spectra(per_nm, waves, own, notes)


def _wavelengths(table: CgatsTable, fields: Sequence[str]) -> tuple[Floats, list[str]]:
    """Return the wavelength (m,) of each of ``fields``, by first, last and number where the file has them."""
    named = np.array([float(match[1]) for name in fields if (match := FIELD.fullmatch(name))])
    keywords = [_keyword(table, f"SPECTRAL_{what}") for what in ("BANDS", "START_NM", "END_NM")]
    bands, start, end = keywords
    if bands is not None and bands != len(fields):
        at = table.keywords["SPECTRAL_BANDS"]
        raise DeviceError(
            table.finding(
                f"SPECTRAL_BANDS is {at.text}, and there are {len(fields)} spectral fields", at, "as many as bands"
            )
        )
    if start is None or end is None:
        return named, ["the wavelengths were taken from the names of the spectral fields"]
    waves = np.linspace(start, end, len(fields))
    wrong = np.flatnonzero(np.abs(waves - named) > 0.5 + 1e-6)
    if len(wrong):
        at = next(cell for cell in table.fields if cell.text == fields[wrong[0]])
        remedy = f"from {start:g} to {end:g} nm in {len(fields)} bands"
        raise DeviceError(table.finding(f"{at.text} stands where {waves[wrong[0]]:g} nm should", at, remedy))
    return waves, []


def _keyword(table: CgatsTable, keyword: str) -> float | None:
    cell = table.keywords.get(keyword)
    if cell is None:
        return None
    try:
        value = float(cell.text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise DeviceError(table.finding(f"{keyword} is '{cell.text}'", cell, "a number above 0 is needed"))
    return value


def spectral_head(measurements: Measurements) -> tuple[list[str], list[str]]:
    """Return the keywords' lines and the names of the fields that spectra need; none where there are none."""
    waves = measurements.wavelengths_nm
    if waves is None or len(waves) == 0:
        return [], []
    fields = [f"SPEC_{math.floor(wave + 0.5):03d}" for wave in waves.tolist()]
    steps = np.diff(waves)
    even = len(steps) > 0 and bool(np.all(steps > 0) and np.ptp(steps) < 1e-6 * steps.mean())
    if len(set(fields)) < len(fields) or not (even or np.all(waves == np.round(waves))):
        raise DeviceError("a .ti3 cannot hold these wavelengths: they must be evenly spaced, at least 1 nm apart")
    lines = ['INSTRUMENT_TYPE_SPECTRAL "YES"', f'SPECTRAL_BANDS "{len(waves)}"']
    if even:
        lines += [f'SPECTRAL_START_NM "{waves[0]:.6f}"', f'SPECTRAL_END_NM "{waves[-1]:.6f}"']
    return lines, fields


def spectral_rows(measurements: Measurements) -> list[list[str]]:
    """Return for each reading its spectrum's numbers as text, in mW/(sr m² nm); none where there are none."""
    if measurements.spectra is None:
        return [[] for _ in range(len(measurements))]
    return [[repr(float(value)) for value in row / _WATTS] for row in measurements.spectra]


def for_observer(measurements: Measurements, observer: str, file: str | None = None) -> Measurements:
    """Return the readings with XYZ for another colorimetric observer, summed from their spectra.

    Parameters
    ----------
    measurements
        The readings.
    observer
        The observer's name, as `devices.colour_matching.colorimetric_observer` reads it.
    file
        The file of the readings, for messages.

    Returns
    -------
    Measurements
        The same table where it is for that observer already.

    Raises
    ------
    DeviceError
        If the readings are for another observer and have no spectra, or spectra from which XYZ cannot be summed.
    """
    from devices.readings.spectra import sampling_note, xyz_from_spectra

    name = canonical_name(observer)
    if name == measurements.observer:
        return measurements
    if measurements.spectra is None or measurements.wavelengths_nm is None:
        remedy = f"give readings with spectra, or use them for {measurements.observer}"
        what = f"the readings are XYZ for {measurements.observer} without spectra: they give none for {name}"
        raise DeviceError(Finding(what, file, remedy=remedy))
    waves = measurements.wavelengths_nm
    XYZ = xyz_from_spectra(measurements.spectra, waves, name)
    seen = replace(measurements, XYZ=XYZ, observer=name)
    notes = sampling_note(measurements.spectra, waves, name)
    return seen.says(f"XYZ for {name} were summed from the spectra", *notes)
