"""The files of readings that a report is on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from devices.diagnostics.examine import MeasuredSet
from devices.errors import DeviceError
from devices.measurements import Measurements
from documents import Finding, InputError


def read_sets(files: Sequence[Path], codes: str | None) -> list[MeasuredSet]:
    """Return the readings of each of ``files``, called by their files' names.

    A ``.jsonl`` file is what `cyclopean display measure` keeps, with spectra where the instrument gives them; see
    `devices.measurements.read` for the others. ``codes`` is what the codes of CSV files run over, None if they say.

    Raises
    ------
    InputError
        With what is wrong with every file, or if one is named twice.
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
            found = _read(file, codes)
        except InputError as error:
            findings += error.findings
            continue
        sets.append(MeasuredSet(file.name if names.count(file.name) == 1 else str(file), found))
    if findings:
        raise DeviceError(findings)
    return sets


def _read(file: Path, codes: str | None) -> Measurements:
    if file.suffix.lower() == ".jsonl":
        from runner.measuring.export import measurements
        from runner.measuring.log import read_session

        return measurements(read_session(file))
    from devices.measurements.read import read_measurements

    return read_measurements(file, codes if file.suffix.lower() == ".csv" else None)
