"""Psychtoolbox calibrations: each channel's spectra at each level, from a MATLAB ``.mat`` file.

Psychtoolbox keeps power per band, not per nm, takes the ambient light off each spectrum, and stacks the spectra of one
channel's levels in one column of ``rawdata.mon``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.errors import DeviceError
from devices.readings.mat_file import MatFileError, Value, read_mat
from devices.readings.spectra import xyz_from_spectra
from devices.readings.table import Measurements
from documents import Finding
from documents.files import read_regular

_COLOURS = ("red", "green", "blue")
_NEEDED = "a Psychtoolbox calibration"
_MOST_BYTES = 50_000_000
_MOST_BANDS = 5000
_LEAST_STEP_NM = 0.01
_MOST_LIGHT = 1e30


def read_psychtoolbox(path: Path) -> Measurements:
    """Read the last calibration in the file at ``path``: black, where ambient light was measured, and three ramps.

    Raises
    ------
    DeviceError
        If the file is no calibration, or what it holds does not fit together.
    """
    try:
        content = read_mat(read_regular(path, _MOST_BYTES, "calibration", error=DeviceError), "cals", "cal")
    except MatFileError as error:
        raise DeviceError(
            Finding(f"the file cannot be read as MATLAB data: {error}", str(path), remedy="save it with -v7, not -v7.3")
        ) from error
    notes: list[str] = []
    every = content.get("cals", content.get("cal"))
    if every is None:
        raise DeviceError(Finding("the file holds no 'cals' or 'cal'", str(path), remedy=_NEEDED))
    if isinstance(every, list) and len(every) > 1:
        notes.append(f"the last of {len(every)} calibrations in the file was read")
    cal = _last(every)
    raw = _last(_part(cal, "rawdata", "rawData"))
    levels = _numbers(raw, path, "rawGammaInput", "gammaInput")
    spacing = _numbers(cal, path, "S_device", "describe.S").ravel()
    mon = _numbers(raw, path, "mon")
    if levels.ndim == 2 and min(levels.shape) > 1:
        levels = levels[:, 0]
    levels = levels.ravel()
    if spacing.size != 3 or spacing[1] < _LEAST_STEP_NM or not 1 < spacing[2] <= _MOST_BANDS or spacing[2] % 1:
        given = ", ".join(f"{value:g}" for value in spacing[:4])
        remedy = f"first wavelength, spacing and number of bands, 2 to {_MOST_BANDS}"
        raise DeviceError(Finding(f"S_device is [{given}]", str(path), remedy=remedy))
    start, step = spacing[:2]
    n_bands, n_levels = int(spacing[2]), len(levels)
    if not n_levels or mon.shape != (n_bands * n_levels, 3):
        raise DeviceError(
            Finding(
                f"rawdata.mon is {' by '.join(map(str, mon.shape))}, not {n_bands} bands times {n_levels} levels by 3",
                str(path),
                remedy="a calibration of three channels",
            )
        )
    if levels.min() < 0 or levels.max() > 255:
        what = f"the levels of rawGammaInput lie in {levels.min():g}..{levels.max():g}"
        raise DeviceError(Finding(what, str(path), remedy="levels are 0..1 or 0..255"))
    if levels.max() > 1:
        notes.append("levels were taken to be 0..255, because they exceed 1")
        levels = levels / 255.0
    waves = start + step * np.arange(n_bands)
    ambient = _ambient(cal, path, n_bands)
    if ambient is None:
        notes.append("the file holds no ambient light; black is not measured")
    codes: list[np.ndarray] = [] if ambient is None else [np.zeros(3)]
    spectra: list[np.ndarray] = [] if ambient is None else [ambient / step]
    names = [] if ambient is None else ["black"]
    for channel, colour in enumerate(_COLOURS):
        for level, spectrum in zip(levels, mon[:, channel].reshape(n_levels, n_bands), strict=True):
            codes.append(np.eye(3)[channel] * level)
            spectra.append((spectrum + (0.0 if ambient is None else ambient)) / step)
            names.append(f"{colour}{round(255 * level)}")
    per_nm = np.array(spectra)
    try:
        XYZ = xyz_from_spectra(per_nm, waves)
        return Measurements(
            np.array(codes),
            XYZ,
            tuple(names),
            spectra=per_nm,
            wavelengths_nm=waves,
            instrument=_text(_part(cal, "describe.whichMeterType")),
            assumptions=tuple(notes),
        )
    except DeviceError as error:
        raise DeviceError([Finding(f.message, str(path), remedy=f.remedy) for f in error.findings]) from error


def _part(whole: Value, *names: str) -> Value:
    """Return the first of ``names`` that ``whole`` has; a full stop leads into a struct within it."""
    for name in names:
        part = whole
        for step in name.split("."):
            inner = _last(part)
            part = inner.get(step) if isinstance(inner, dict) else None
        if part is not None:
            return part
    return None


def _last(value: Value) -> Value:
    """Return the last of a cell or struct array, and whatever is none itself."""
    while isinstance(value, list):
        value = value[-1] if value else None
    return value


def _numbers(whole: Value, path: Path, *names: str) -> NDArray[np.float64]:
    part = _part(whole, *names)
    if part is None:
        raise DeviceError(Finding(f"the calibration has no '{names[0]}'", str(path), remedy=_NEEDED))
    if not isinstance(part, np.ndarray) or not np.all(np.abs(part) < _MOST_LIGHT):
        what = f"'{names[0]}' is not made of numbers below {_MOST_LIGHT:g}"
        raise DeviceError(Finding(what, str(path), remedy=_NEEDED))
    return part


def _text(value: Value) -> str:
    if isinstance(value, np.ndarray) and value.size == 1:
        return f"{value.item():g}"
    return value if isinstance(value, str) else ""


def _ambient(cal: Value, path: Path, bands: int) -> NDArray[np.float64] | None:
    """Return the ambient light; None where there is none, or none of as many bands."""
    if _part(cal, "P_ambient") is None:
        return None
    ambient = _numbers(cal, path, "P_ambient").ravel()
    return ambient if len(ambient) == bands else None
