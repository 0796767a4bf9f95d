"""Measurements from and to files of any known kind, which the end of the name says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from devices.display.gamma_table import GammaTable
from devices.errors import DeviceError, MeasuringError
from devices.readings.arrangement import PatchEye
from devices.readings.csv_table import write_csv
from devices.readings.table import Measurements
from documents import Finding, InputError
from documents.extensions import Registry
from documents.files import whole_file, writing
from documents.tables import ENDINGS

if TYPE_CHECKING:
    from devices.readings.log import ReadingRun

PROFILE_ENDINGS = (".icc", ".icm")
# By the end of a file's name, without its dot.
READERS: Registry[Callable[..., Measurements]] = Registry(
    "cyclopean.readers",
    {
        **{ending[1:]: "devices.readings.csv_table:read_csv" for ending in ENDINGS},
        "ti3": "devices.readings.ti3:read_ti3",
        "mat": "devices.readings.psychtoolbox:read_psychtoolbox",
        "jsonl": "devices.readings.read:read_log",
        **{ending[1:]: "devices.readings.profile_readings:read_profile_measurements" for ending in PROFILE_ENDINGS},
    },
    lambda name, kind: None if callable(kind) else "is no function that reads a file",
)


def read_measurements(
    path: str | Path, code_range: str | None = None, *, white_cd_m2: float | None = None
) -> Measurements:
    """Read a table of measurements.

    Parameters
    ----------
    path
        A table, ``.csv``, ``.tsv``, ``.txt`` or ``.xlsx``, an ArgyllCMS ``.ti3``, a Psychtoolbox calibration ``.mat``,
        the ``.jsonl`` that `cyclopean display measure` writes, an ICC profile, ``.icc`` or ``.icm``, with measurements
        inside, or a file that another package reads (`READERS`). Of a profile without measurements the model is asked
        for the light of a set of codes, and ``assumptions`` says so.
    code_range
        The range of the codes of a CSV table that does not name it, such as ``0..255``; the others name theirs.
    white_cd_m2
        Luminance of the white of an ICC profile that does not say how bright it is, above 0.

    Returns
    -------
    Measurements
        Codes in 0..1 and XYZ in cd/m², a row for each reading.

    Raises
    ------
    InputError
        With file, line, column and remedy of what is wrong.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "readings.csv")
    ...     _ = file.write_text("R,G,B,X,Y,Z\\n0,0,0,0.1,0.1,0.1\\n255,255,255,95,100,109\\n")
    ...     read_measurements(file, "0..255").codes.tolist()
    [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]
    """
    path = Path(path)
    ending = path.suffix.lower()
    if white_cd_m2 is not None and ending not in PROFILE_ENDINGS:
        what = f"--white-cd-m2 {white_cd_m2:g} was given for a file that is no ICC profile"
        raise DeviceError(Finding(what, str(path), remedy="leave it out"))
    if code_range is not None and ending not in ENDINGS:
        raise DeviceError(Finding("only the codes of a CSV file need a range", str(path), remedy="leave out --codes"))
    reader = READERS.get(ending[1:])
    if reader is None:
        *most, last = (f".{name}" for name in READERS.names())
        remedy = f"{', '.join(most)} or {last}"
        raise DeviceError(Finding(f"'{ending}' is no known table of measurements", str(path), remedy=remedy))
    options = [option for option in (code_range, white_cd_m2) if option is not None]
    with READERS.blamed(ending[1:]):
        try:
            measurements = reader(path, *options)
        except InputError as error:
            if all(fault.file for fault in error.findings):
                raise
            raise DeviceError(
                tuple(replace(fault, file=fault.file or str(path)) for fault in error.findings)
            ) from error
        if not isinstance(measurements, Measurements):
            raise TypeError(f"{type(measurements).__name__} in place of Measurements")
    if not (whose := READERS.whose(ending[1:])):
        return measurements
    return replace(measurements, notes="; ".join(filter(None, (measurements.notes, f"read by {whose}"))))


def read_log(path: Path) -> Measurements:
    """Read the log of a measurement, ``.jsonl``, as `read_measurements` does."""
    from devices.readings.log import read_session

    return measurements_of(read_session(path))


def write_measurements(session: ReadingRun, file: Path) -> None:
    """Write the readings of a measurement, whole or not at all: ``.ti3`` with spectra, CSV by any other name.

    Parameters
    ----------
    session
        A measurement with at least one reading.
    file
        The table to write. Its folder must be there; a file in its place is replaced.

    Raises
    ------
    MeasuringError
        If there are no readings, or the file cannot be written.
    """
    table = measurements_of(session)
    with writing(file, "table", MeasuringError), whole_file(file, make_folder=False) as draft:
        if file.suffix.lower() == ".ti3":
            from devices.readings.ti3 import write_ti3

            write_ti3(table, draft)
        else:
            write_csv(table, draft, float(session.header["highest_code"]))


def measurements_of(session: ReadingRun) -> Measurements:
    """Return the readings of ``session`` in the order in which they were taken; the last of each step counts.

    Spectra are there if every reading has one at the same wavelengths.

    Raises
    ------
    MeasuringError
        If there are no readings.
    """
    kept = sorted(session.readings.values(), key=lambda reading: (reading.time_s, reading.position))
    if not kept:
        raise MeasuringError(Finding("the measurement has no readings yet", str(session.file), remedy="--resume it"))
    header = session.header
    patches = [session.steps[reading.position].patch for reading in kept]
    wavelengths = {reading.reading.wavelengths_nm for reading in kept}
    order = f"{header['set']} ({header['set_source']}), seed {header['seed']}, begun {header['begun_utc']}"
    accepted = tuple(f"readings were kept that were doubted while they were taken: {why}" for why in session.accepted)
    parts = any(patch.filled < 1 for patch in patches)
    spectral = len(wavelengths) == 1 and bool(kept[0].reading.wavelengths_nm)
    return Measurements(
        np.array(
            [reading.shown.own if reading.shown else session.steps[reading.position].patch.codes for reading in kept]
        ),
        np.array([reading.reading.XYZ_cd_m2 for reading in kept]),
        tuple(patch.name for patch in patches),
        np.array([reading.time_s for reading in kept]),
        tuple(patch.eye or cast(PatchEye, header["eye"]) for patch in patches),
        str(header["mode"]),
        np.array([reading.reading.spectrum for reading in kept]) if spectral else None,
        np.array(kept[0].reading.wavelengths_nm) if spectral else None,
        str(header["instrument"]),
        "; ".join(filter(None, (str(header.get("notes", "")), order, *accepted))),
        assumptions=accepted,
        panel=str(header.get("panel", "")),
        monitor_settings=str(header.get("monitor_settings", "")),
        area=np.array([patch.filled for patch in patches]) if parts else None,
        surround=np.array([patch.surround for patch in patches]) if parts else None,
        gamma_table=GammaTable.from_json(header["gamma_table"]) if "gamma_table" in header else None,
    )
