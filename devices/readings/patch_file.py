"""Sets of patches in CSV files.

The columns are ``name,red,green,blue``, with ``# codes: 0..255`` above. A patch that does not fill the picture has the
share of it that it fills in ``area``, and the codes around it in ``surround_red,surround_green,surround_blue``; empty
cells stand for all of it, and for black.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import cast

from devices.errors import DeviceError
from devices.readings.code_range import DRIVEN, PARTS, SURROUND, driven, part_faults
from devices.readings.patch import Codes, Patch, PatchSet
from documents import Finding
from documents.tables import MOST_FINDINGS, Form, Table

_FORM = Form((*DRIVEN, *PARTS), "table of patches", DeviceError)


def read_patches(path: Path, code_range: str | None = None) -> PatchSet:
    """Read the patches in the CSV file at ``path``; ``code_range`` is what its codes run over, if it does not say.

    Raises
    ------
    DeviceError
        With file, line, column, value and remedy of the first twenty faults.
    """
    return _patches(_FORM.read(path, _more_faults), path.stem, code_range)


def parse_patches(text: str, file: str, name: str, code_range: str | None = None) -> PatchSet:
    """Read the patches in ``text``; ``file`` is the name that findings carry; else as `read_patches`."""
    return _patches(_FORM.parse(text, file, _more_faults), name, code_range)


def _more_faults(table: Table) -> Iterator[Finding]:
    """Yield what is wrong with a table of patches beside its numbers."""
    yield from part_faults(table)
    first: dict[str, int] = {}
    for row, name in enumerate(_names(table)):
        if name in first:
            yield table.fault(row, None, f"'{name}' stands in line {table.lines[first[name]]} too", "rename one")
        first.setdefault(name, row)


def _names(table: Table) -> list[str]:
    return table.texts("name") if "name" in table else [f"patch{row + 1}" for row in range(len(table))]


def _patches(table: Table, name: str, code_range: str | None) -> PatchSet:
    drive = driven(table, code_range)
    patches: list[Patch] = []
    findings: list[Finding] = []
    for row, called in enumerate(_names(table)):
        surround = None
        if drive.around is not None and any(table.texts(column)[row] for column in SURROUND):
            surround = cast(Codes, tuple(drive.around[row].tolist()))
        area = float(table.numbers("area")[row]) if table.texts("area")[row] else None
        try:
            patches.append(Patch(called, cast(Codes, tuple(drive.codes[row].tolist())), surround, area=area))
        except DeviceError as error:
            findings += [table.fault(row, None, finding.message, finding.remedy) for finding in error.findings]
    if findings:
        raise DeviceError(findings[:MOST_FINDINGS])
    return PatchSet(name, tuple(patches), table.comment("source", table.file))
