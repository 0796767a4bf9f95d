"""Psychtoolbox calibrations: each channel's spectra at each level, from a MATLAB ``.mat`` file.

Psychtoolbox keeps power per band, not per nm, takes the ambient light off each spectrum, and stacks the spectra of one
channel's levels in one column of ``rawdata.mon``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from devices.errors import DeviceError
from devices.measurements.spectra import xyz_from_spectra
from devices.measurements.table import Measurements
from documents import Finding
from documents.files import looked_for

_COLOURS = ("red", "green", "blue")


def read_psychtoolbox(path: Path) -> Measurements:
    """Read the last calibration in the file at ``path``: black, where ambient light was measured, and three ramps.

    Raises
    ------
    DeviceError
        If the file is no calibration, or what it holds does not fit together.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content = loadmat(path, squeeze_me=True, struct_as_record=False)
    except FileNotFoundError as error:
        raise DeviceError(Finding("there is no such file", str(path), remedy=looked_for(path))) from error
    except (MatReadError, ValueError, TypeError, NotImplementedError, OSError, EOFError, KeyError) as error:
        raise DeviceError(
            Finding(f"the file cannot be read as MATLAB data: {error}", str(path), remedy="save it with -v7, not -v7.3")
        ) from error
    notes: list[str] = []
    cals = content.get("cals", content.get("cal"))
    if cals is None:
        raise DeviceError(Finding("the file holds no 'cals' or 'cal'", str(path), remedy="a Psychtoolbox calibration"))
    every = np.atleast_1d(cals)
    if len(every) > 1:
        notes.append(f"the last of {len(every)} calibrations in the file was read")
    cal = every[-1]
    raw = _part(cal, path, "rawdata", "rawData")
    levels = np.atleast_1d(np.asarray(_part(raw, path, "rawGammaInput", "gammaInput"), dtype=np.float64))
    start, step, bands = np.asarray(_part(cal, path, "S_device", "describe.S"), dtype=np.float64).ravel()
    mon = np.atleast_2d(np.asarray(_part(raw, path, "mon"), dtype=np.float64))
    if levels.ndim == 2:
        levels = levels[:, 0]
    n_bands, n_levels = int(bands), len(levels)
    if step <= 0 or mon.shape != (n_bands * n_levels, 3):
        raise DeviceError(
            Finding(
                f"rawdata.mon is {mon.shape[0]} by {mon.shape[1]}, not {n_bands} bands times {n_levels} levels by 3",
                str(path),
                remedy="a calibration of three channels",
            )
        )
    if levels.max() > 1:
        notes.append("levels were taken to be 0..255, because they exceed 1")
        levels = levels / 255.0
    waves = start + step * np.arange(n_bands)
    ambient = _ambient(cal, n_bands)
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
            instrument=str(getattr(getattr(cal, "describe", None), "whichMeterType", "")),
            assumptions=tuple(notes),
        )
    except DeviceError as error:
        raise DeviceError([Finding(f.message, str(path), remedy=f.remedy) for f in error.findings]) from error


def _part(whole: Any, path: Path, *names: str) -> Any:
    for name in names:
        part = whole
        for step in name.split("."):
            part = getattr(part, step, None)
        if part is not None:
            return part
    raise DeviceError(Finding(f"the calibration has no '{names[0]}'", str(path), remedy="a Psychtoolbox calibration"))


def _ambient(cal: Any, bands: int) -> np.ndarray | None:
    ambient = getattr(cal, "P_ambient", None)
    if ambient is None:
        return None
    ambient = np.asarray(ambient, dtype=np.float64)
    if ambient.size == bands:
        return ambient.ravel()
    return None
