"""The tables of colours that `cyclopean display convert` reads: three columns of numbers, and others carried along."""

from __future__ import annotations

import csv
import io
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from devices.errors import DeviceError
from documents import Finding
from documents.files.tables import other_separator

Kind = Literal["code", "xyz"]
COLUMNS: dict[Kind, tuple[str, str, str]] = {"code": ("red", "green", "blue"), "xyz": ("X", "Y", "Z")}


@dataclass(frozen=True, slots=True, eq=False)
class ColourTable:
    """``values``: shape (n, 3), codes as shares of full drive or XYZ; ``others`` and ``rows`` are carried along."""

    values: NDArray[np.float64]
    others: tuple[str, ...]
    rows: list[list[str]]


def read_colours(file: str, kind: Kind, full: float) -> ColourTable:
    """Read codes or XYZ from ``file``: CSV, ``-`` for CSV from standard input, or the readings of a ``.ti3``.

    Codes of CSV lie in 0..``full``.

    Raises
    ------
    DeviceError
        With file, line, column and value of what is wrong.
    """
    if file.lower().endswith(".ti3"):
        from devices.measurements.read import read_measurements

        found = read_measurements(Path(file))
        return ColourTable(found.codes if kind == "code" else found.XYZ, ("name",), [[name] for name in found.name])
    name = "standard input" if file == "-" else file
    try:
        data = sys.stdin.buffer.read() if file == "-" else Path(file).read_bytes()
        text = io.StringIO(data.decode("utf-8-sig"), newline="")
        lines = [(n, row) for n, row in enumerate(csv.reader(text, strict=True), 1) if row and row[0][:1] != "#"]
    except OSError as error:
        raise DeviceError(Finding(f"the table cannot be read: {error.strerror}", name)) from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise DeviceError(Finding(f"the table is not CSV in UTF-8: {error}", name)) from error
    return _parse(lines, name, kind, full)


def _parse(lines: list[tuple[int, list[str]]], file: str, kind: Kind, full: float) -> ColourTable:
    given = COLUMNS[kind]
    if lines and (separated := other_separator(lines[0][1], file, lines[0][0])):
        raise DeviceError(separated)
    head = [cell.strip() for cell in lines[0][1]] if lines else []
    missing = [name for name in given if name not in head]
    if missing:
        raise DeviceError(
            Finding(f"the header has no {', '.join(missing)}", file, remedy=f"columns: {','.join(given)}")
        )
    values = np.empty((len(lines) - 1, 3))
    wish = f"a number in 0..{full:g}" if kind == "code" else "a finite number"
    findings: list[Finding] = []
    for index, (line, cells) in enumerate(lines[1:]):
        for place, name in enumerate(given):
            cell = cells[head.index(name)] if len(cells) == len(head) else ""
            try:
                value = float(cell)
            except ValueError:
                value = np.nan
            if not np.isfinite(value) or (kind == "code" and not 0 <= value <= full):
                findings.append(Finding(f"{name} is '{cell}'", file, line, head.index(name) + 1, f"{wish} is needed"))
            values[index, place] = value
    if findings:
        raise DeviceError(findings[:20])
    others = tuple(name for name in head if name not in (*COLUMNS["code"], *COLUMNS["xyz"]))
    kept = [head.index(name) for name in others]
    rows = [[cells[at] for at in kept] for _, cells in lines[1:]]
    return ColourTable(values / full if kind == "code" else values, others, rows)
