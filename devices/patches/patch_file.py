"""Sets of patches in CSV files.

The columns are ``name,red,green,blue``, with ``# codes: 0..255`` above. A patch that does not fill the picture has the
share of it that it fills in ``area``, and the codes around it in ``surround_red,surround_green,surround_blue``; empty
cells stand for all of it, and for black.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

from devices.errors import DeviceError
from devices.measurements.code_range import full_code, parse_code_range
from devices.patches.patch import Codes, Patch, PatchSet
from documents import Finding
from documents.files import is_comment, other_separator, read_regular_text

_COLUMNS = ("red", "green", "blue")
_SURROUND = ("surround_red", "surround_green", "surround_blue")
_MOST_FINDINGS = 20
_MOST_BYTES = 10_000_000


def read_patches(path: Path, code_range: str | None = None) -> PatchSet:
    """Read the patches in the CSV file at ``path``; ``code_range`` is what its codes run over, if it does not say.

    Raises
    ------
    DeviceError
        With file, line, column, value and remedy of the first twenty faults.
    """
    text = read_regular_text(path, _MOST_BYTES, "table of patches", error=DeviceError)
    return parse_patches(text, str(path), path.stem, code_range)


def parse_patches(text: str, file: str, name: str, code_range: str | None = None) -> PatchSet:
    """Read the patches in ``text``; ``file`` is the name that findings carry; else as `read_patches`."""
    header_values: dict[str, tuple[str, int]] = {}
    lines: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if is_comment(line):
            key, _, value = line.lstrip("# ").partition(":")
            header_values[key.strip().lower()] = value.strip(), number
        elif line.strip():
            lines.append((number, line))
    if len(lines) < 2:
        raise DeviceError(Finding("there are no patches", file, remedy="a header name,red,green,blue and a line each"))
    try:
        rows = [(number, [cell.strip() for cell in next(csv.reader([line], strict=True))]) for number, line in lines]
    except csv.Error as error:
        raise DeviceError(Finding(f"the patches are not CSV: {error}", file)) from None
    if separated := other_separator(rows[0][1], file, rows[0][0]):
        raise DeviceError(separated)
    header = [cell.lower() for cell in rows[0][1]]
    missing = [column for column in _COLUMNS if column not in header]
    if missing:
        remedy = "columns: name,red,green,blue"
        raise DeviceError(Finding(f"the header has no {', '.join(missing)}", file, rows[0][0], remedy=remedy))
    findings: list[Finding] = []
    values = [_codes(cells, number, header, _COLUMNS, file, findings) for number, cells in rows[1:]]
    if set(_SURROUND) & set(header) and not set(_SURROUND) <= set(header):
        lacking = ", ".join(column for column in _SURROUND if column not in header)
        findings.append(Finding(f"the header has no {lacking}", file, rows[0][0], remedy="all three, or none"))
    parts = [_part(cells, number, header, file, findings) for number, cells in rows[1:]]
    if findings:
        raise DeviceError(findings[:_MOST_FINDINGS])
    declared, declared_line = (code_range, None) if code_range is not None else header_values.get("codes", (None, None))
    largest = max(max(*codes, *(around or ())) for codes, (_, around) in zip(values, parts, strict=True))
    full, _ = full_code(largest, None if declared is None else parse_code_range(declared, file, declared_line), file)
    patches: list[Patch] = []
    seen: dict[str, int] = {}
    for (number, cells), (red, green, blue), (area, around) in zip(rows[1:], values, parts, strict=True):
        called = cells[header.index("name")] if "name" in header else f"patch{len(patches) + 1}"
        if called in seen:
            findings.append(Finding(f"'{called}' stands in line {seen[called]} too", file, number, remedy="rename one"))
            continue
        seen[called] = number
        try:
            surround = None if around is None else (around[0] / full, around[1] / full, around[2] / full)
            patches.append(Patch(called, (red / full, green / full, blue / full), surround, area=area))
        except DeviceError as error:
            remedy = f"codes run over 0..{full:g}"
            findings += [Finding(finding.message, file, number, remedy=remedy) for finding in error.findings]
    if findings:
        raise DeviceError(findings[:_MOST_FINDINGS])
    return PatchSet(name, tuple(patches), header_values.get("source", (file, 0))[0])


def _codes(
    cells: list[str], line: int, header: list[str], columns: tuple[str, ...], file: str, findings: list[Finding]
) -> Codes:
    if len(cells) != len(header):
        findings.append(Finding(f"the line has {len(cells)} fields, the header {len(header)}", file, line))
        return 0.0, 0.0, 0.0
    codes = []
    for column in columns:
        place = header.index(column)
        try:
            value = float(cells[place])
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            remedy = "a finite number is needed"
            findings.append(Finding(f"{column} is '{cells[place]}'", file, line, place + 1, remedy))
        codes.append(value)
    return codes[0], codes[1], codes[2]


def _part(
    cells: list[str], line: int, header: list[str], file: str, findings: list[Finding]
) -> tuple[float | None, Codes | None]:
    """Return the share of the picture that a patch fills, and the codes around it; None where the cells are empty."""
    if len(cells) != len(header):
        return None, None
    area = None
    if "area" in header and cells[header.index("area")]:
        cell = cells[header.index("area")]
        try:
            area = float(cell)
        except ValueError:
            area = math.nan
        if not 0 < area <= 1:
            remedy = "a share of the picture above 0 and at most 1"
            findings.append(Finding(f"the area is '{cell}'", file, line, header.index("area") + 1, remedy))
    empty = not set(_SURROUND) <= set(header) or not any(cells[header.index(column)] for column in _SURROUND)
    return area, None if empty else _codes(cells, line, header, _SURROUND, file, findings)
