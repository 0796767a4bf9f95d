"""Measurements by the names that a report calls them, and apart by eye."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from devices.diagnostics.readings import plain
from devices.errors import DeviceError
from devices.readings import Measurements, PatchEye
from devices.readings.read import PROFILE_ENDINGS, read_measurements
from devices.readings.spectra import for_observer
from devices.readings.table import CIE_1931_2
from documents import Finding, InputError
from documents.tables import ENDINGS


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredSet:
    """Measurements and the name by which a report calls them."""

    label: str
    measurements: Measurements


def read_sets(
    files: Sequence[Path],
    codes: str | None,
    observer: str | None = CIE_1931_2,
    *,
    white_cd_m2: float | None = None,
) -> list[MeasuredSet]:
    """Return the readings of each of ``files``, called by their files' names.

    Parameters
    ----------
    files
        Files of measurements, as `devices.readings.read_measurements` reads them, each named once.
    codes
        The range of the codes of CSV files that do not name it, such as ``0..255``; None if they all do.
    observer
        The colorimetric observer of all XYZ, to which readings with spectra are turned; None leaves each at its own.
    white_cd_m2
        Luminance of the white of ICC profiles among them that do not say how bright it is.

    Returns
    -------
    list of MeasuredSet
        A set for each file, in the order of ``files``. Its label is the file's name, or the path where names repeat.

    Raises
    ------
    InputError
        With what is wrong with every file, if one is named twice, or if readings are for another observer and have no
        spectra.

    Examples
    --------
    >>> import tempfile
    >>> from devices.readings import write_csv
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_csv(Measurements([[1, 1, 1]], [[95, 100, 108]]), Path(folder, "white.csv"))
    ...     sets = read_sets([Path(folder, "white.csv")], None)
    >>> sets[0].label, sets[0].measurements.XYZ.tolist()
    ('white.csv', [[95.0, 100.0, 108.0]])
    """
    findings: list[Finding] = []
    seen: set[Path] = set()
    sets: list[MeasuredSet] = []
    names = [file.name for file in files]
    for file in files:
        if file.resolve() in seen:
            findings.append(Finding("the file is named twice", str(file), remedy="name it once"))
            continue
        seen.add(file.resolve())
        try:
            ending = file.suffix.lower()
            white = white_cd_m2 if ending in PROFILE_ENDINGS else None
            measurements = read_measurements(file, codes if ending in ENDINGS else None, white_cd_m2=white)
            if observer is not None:
                measurements = for_observer(measurements, observer, str(file))
        except InputError as error:
            findings += error.findings
            continue
        sets.append(MeasuredSet(file.name if names.count(file.name) == 1 else str(file), measurements))
    if findings:
        raise DeviceError(findings)
    return sets


def by_eye(measured: MeasuredSet) -> tuple[tuple[MeasuredSet, PatchEye], ...]:
    """Return the readings through each lens apart, or all together where none is of one lens alone."""
    eyes_read = set(plain(measured.measurements).eye) or set(measured.measurements.eye)
    if not eyes_read & {"left", "right"}:
        return ((measured, "both"),)
    eyes: tuple[PatchEye, ...] = ("left", "right")
    return tuple(
        (MeasuredSet(f"{measured.label}, {eye} eye", measured.measurements.for_eye(eye)), eye)
        for eye in eyes
        if eye in eyes_read
    )
