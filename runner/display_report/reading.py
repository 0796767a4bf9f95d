"""The files of readings that a report is on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from devices.diagnostics.examine import MeasuredSet
from devices.errors import DeviceError
from documents import Finding, InputError


def read_sets(files: Sequence[Path], codes: str | None) -> list[MeasuredSet]:
    """Return the readings of each of ``files``, called by their files' names.

    Raises
    ------
    InputError
        With what is wrong with every file, or if one is named twice.
    """
    from devices.measurements import read_csv

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
            found = read_csv(file, codes)
        except InputError as error:
            findings += error.findings
            continue
        sets.append(MeasuredSet(file.name if names.count(file.name) == 1 else str(file), found))
    if findings:
        raise DeviceError(findings)
    return sets
