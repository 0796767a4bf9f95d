"""Measurements as CSV: ``name,red,green,blue,X,Y,Z[,time_s][,eye]``, with what holds for all in comments above.

Patches that did not fill the picture have the share of it that they filled in ``area``, and the codes around them in
``surround_red,surround_green,surround_blue``; empty cells stand for all of it, and for black.

The comments are ``# codes: 0..255``, ``# mode: quad-buffered``, ``# eye: left``, ``# instrument: ...``,
``# notes: ...``, ``# panel: 1920x1080,0.2768,120,8``, ``# observer: CIE 1964 10``, ``# gamma_table: ...``, the graphics
card's table as `display measure` read it, and ``# monitor_settings: {"brightness_percent": 35}``; ``R,G,B`` may stand
for ``red,green,blue``, and names may be left out.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from pathlib import Path
from typing import cast

import numpy as np

from devices.display.gamma_table import GammaTable
from devices.errors import DeviceError
from devices.measurements.code_range import full_code, parse_code_range
from devices.measurements.observer import CIE_1931_2, OBSERVERS, observer_name
from devices.measurements.table import PATCH_EYES, Measurements, PatchEye
from documents import Finding
from documents.files import is_comment, other_separator, read_regular_text
from documents.text import did_you_mean, nearest

_NUMBERS = ("red", "green", "blue", "X", "Y", "Z")
_SURROUND = ("surround_red", "surround_green", "surround_blue")
_KNOWN = ("name", *_NUMBERS, "time_s", "eye", "area", *_SURROUND)
_COLUMNS = "name,red,green,blue,X,Y,Z,time_s,eye"
_ALSO = {"r": "red", "g": "green", "b": "blue"}
_SAID = ("codes", "mode", "eye", "instrument", "notes", "panel", "observer", "gamma_table", "monitor_settings")
_MOST_FINDINGS = 20
_MOST_BYTES = 10_000_000


def read_csv(path: Path, code_range: str | None = None) -> Measurements:
    """Read the measurements in the CSV file at ``path`` (UTF-8, with or without a byte-order mark).

    Parameters
    ----------
    path
        A CSV file with the columns ``red,green,blue,X,Y,Z``, and ``name``, ``time_s`` and ``eye`` if it has them.
    code_range
        What the file's codes run over, such as ``0..255``. Where it is None, the file's own comment counts, and
        failing that the largest code, if it determines the range: the result's ``assumptions`` then say so.

    Returns
    -------
    Measurements
        Codes in 0..1 and XYZ in cd/m², each of shape (n, 3), a row for each reading.

    Raises
    ------
    DeviceError
        With file, line, column, value and remedy of the first twenty faults.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_csv(Measurements([[1, 1, 1]], [[95, 100, 108]], ("white",)), Path(folder, "white.csv"))
    ...     table = read_csv(Path(folder, "white.csv"))
    >>> table.name, table.codes.tolist(), table.XYZ.tolist()
    (('white',), [[1.0, 1.0, 1.0]], [[95.0, 100.0, 108.0]])
    """
    text = read_regular_text(path, _MOST_BYTES, "table", error=DeviceError)
    return parse_csv(text.splitlines(keepends=True), str(path), code_range)


def parse_csv(lines: Iterable[str], file: str, code_range: str | None = None) -> Measurements:
    """Read the measurements in ``lines``; ``file`` is the name that findings carry; else as `read_csv`."""
    header_values: dict[str, str] = {}
    said_line: dict[str, int] = {}
    kept: list[tuple[int, str]] = []
    for number, line in enumerate(lines, start=1):
        bare = line.strip().strip("\ufeff")
        if is_comment(bare):
            key, _, value = bare.lstrip("# ").partition(":")
            if key.strip().lower() in _SAID:
                header_values[key.strip().lower()] = value.strip()
                said_line[key.strip().lower()] = number
        elif bare:
            kept.append((number, bare))
    if len(kept) < 2:
        raise DeviceError(Finding("the table holds no measurements", file, remedy=f"columns: {_COLUMNS}"))
    try:
        rows = [(number, next(csv.reader([line], strict=True))) for number, line in kept]
    except csv.Error as error:
        raise DeviceError(Finding(f"the table is not CSV: {error}", file)) from error
    columns, ignored = _header(rows[0][1], file, rows[0][0])
    findings: list[Finding] = []
    values = np.full((len(rows) - 1, 7), np.nan)
    area, surround = np.ones(len(rows) - 1), np.zeros((len(rows) - 1, 3))
    names: list[str] = []
    eyes: list[PatchEye] = []
    everywhere = header_values.get("eye", "both")
    for index, (line_number, cells) in enumerate(rows[1:]):
        if len(cells) != len(rows[0][1]):
            findings.append(
                Finding(f"the line has {len(cells)} fields, the header {len(rows[0][1])}", file, line_number)
            )
            continue
        for place, column in enumerate((*_NUMBERS, "time_s")):
            if column in columns:
                values[index, place] = _number(cells[columns[column]], column, file, line_number, columns, findings)
        if "area" in columns and cells[columns["area"]].strip():
            area[index] = _number(cells[columns["area"]], "area", file, line_number, columns, findings)
            if area[index] <= 0 or area[index] > 1:
                what = f"the area is {cells[columns['area']].strip()}"
                remedy = "a share of the picture above 0 and at most 1"
                findings.append(Finding(what, file, line_number, columns["area"] + 1, remedy))
        for place, column in enumerate(_SURROUND):
            if column in columns and cells[columns[column]].strip():
                surround[index, place] = _number(cells[columns[column]], column, file, line_number, columns, findings)
        names.append(cells[columns["name"]].strip() if "name" in columns else f"patch{index + 1}")
        eye = (cells[columns["eye"]].strip() if "eye" in columns else "") or everywhere
        if eye not in PATCH_EYES:
            where = columns["eye"] + 1 if "eye" in columns else None
            findings.append(Finding(f"'{eye}' is no eye", file, line_number, where, "left, right or both"))
        eyes.append(cast(PatchEye, eye))
    observer = observer_name(header_values.get("observer", CIE_1931_2))
    if observer is None:
        what, remedy = f"the observer '{header_values['observer']}' is not known", f"one of {', '.join(OBSERVERS)}"
        findings.append(Finding(what, file, said_line["observer"], remedy=remedy))
    gamma_table = None
    if "gamma_table" in header_values:
        try:
            gamma_table = GammaTable.from_text(header_values["gamma_table"])
        except DeviceError as error:
            remedy = "copy the line as it was written, or leave it out"
            findings.append(Finding(str(error), file, said_line["gamma_table"], remedy=remedy))
    if findings or observer is None:
        raise DeviceError(findings[:_MOST_FINDINGS])
    declared = code_range if code_range is not None else header_values.get("codes")
    declared_line = None if code_range is not None else said_line.get("codes")
    largest = max(float(values[:, :3].max()), float(surround.max()))
    full, assumed = full_code(
        largest, None if declared is None else parse_code_range(declared, file, declared_line), file
    )
    codes = values[:, :3] / full
    for index, code_row in enumerate(codes):
        for place, code in enumerate(code_row):
            if not 0 <= code <= 1:
                asked = values[index, place]
                where = columns[_NUMBERS[place]] + 1
                findings.append(
                    Finding(f"the code {asked:g} lies outside 0..{full:g}", file, rows[index + 1][0], where)
                )
    for index, place in np.argwhere((surround < 0) | (surround > full)):
        what = f"the code {surround[index, place]:g} lies outside 0..{full:g}"
        findings.append(Finding(what, file, rows[index + 1][0], columns[_SURROUND[place]] + 1))
    if findings:
        raise DeviceError(findings[:_MOST_FINDINGS])
    left_out = f"the columns {', '.join(ignored)} were not read" if ignored else ""
    return Measurements(
        codes,
        values[:, 3:6],
        tuple(names),
        values[:, 6] if "time_s" in columns else None,
        tuple(eyes),
        header_values.get("mode", ""),
        instrument=header_values.get("instrument", ""),
        notes=header_values.get("notes", ""),
        assumptions=tuple(text for text in (assumed, left_out) if text),
        panel=header_values.get("panel", ""),
        observer=observer,
        monitor_settings=header_values.get("monitor_settings", ""),
        area=area if "area" in columns else None,
        surround=surround / full if set(_SURROUND) & set(columns) else None,
        gamma_table=gamma_table,
    )


def _header(cells: list[str], file: str, line: int) -> tuple[dict[str, int], list[str]]:
    if separated := other_separator(cells, file, line):
        raise DeviceError(separated)
    columns: dict[str, int] = {}
    ignored: list[str] = []
    for place, cell in enumerate(cells):
        bare = cell.strip()
        by_case = {known.lower(): known for known in _KNOWN}
        column = _ALSO.get(bare.lower()) or by_case.get(bare.lower())
        if column is None:
            if nearest(bare, _KNOWN, cutoff=0.75):
                remedy = did_you_mean(bare, _KNOWN)
                raise DeviceError(Finding(f"there is no column '{bare}'", file, line, place + 1, remedy))
            ignored.append(bare)
        elif column in columns:
            raise DeviceError(Finding(f"the column '{column}' stands twice", file, line, place + 1))
        else:
            columns[column] = place
    missing = [column for column in _NUMBERS if column not in columns]
    if set(_SURROUND) & set(columns):
        missing += [column for column in ("area", *_SURROUND) if column not in columns]
    if missing:
        raise DeviceError(Finding(f"the header has no {', '.join(missing)}", file, line, remedy=f"columns: {_COLUMNS}"))
    return columns, ignored


def _number(cell: str, column: str, file: str, line: int, columns: dict[str, int], findings: list[Finding]) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        findings.append(
            Finding(f"{column} is '{cell.strip()}'", file, line, columns[column] + 1, "a finite number is needed")
        )
    return value


def write_csv(measurements: Measurements, path: Path, full: float = 255.0) -> None:
    """Write ``measurements`` to ``path`` as CSV whose codes run over 0..``full``; reading it gives the same table.

    Parameters
    ----------
    measurements
        The readings: codes in 0..1 and XYZ in cd/m².
    path
        The file to write; its folder must be there.
    full
        The code of full drive in the file, above 0.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_csv(Measurements([[0, 0.2, 1]], [[20, 16, 90]]), Path(folder, "blue.csv"), 10.0)
    ...     text = Path(folder, "blue.csv").read_text()
    >>> "# codes: 0..10" in text
    True
    """
    path.write_text(format_csv(measurements, full), encoding="utf-8")


def format_csv(measurements: Measurements, full: float = 255.0) -> str:
    """Return ``measurements`` as CSV text, comments first; see `write_csv`. Spectra are not part of it."""
    out = io.StringIO()
    out.write(f"# codes: 0..{full:g}\n")
    for key in ("mode", "instrument", "notes", "panel", "monitor_settings"):
        if text := " ".join(str(getattr(measurements, key)).split()):
            out.write(f"# {key}: {text}\n")
    if measurements.observer != CIE_1931_2:
        out.write(f"# observer: {measurements.observer}\n")
    if measurements.gamma_table is not None:
        out.write(f"# gamma_table: {measurements.gamma_table.to_text()}\n")
    timed = measurements.time_s is not None
    writer = csv.writer(out, lineterminator="\n")
    parts = measurements.area is not None or measurements.surround is not None
    more = ["area", *_SURROUND] if parts else []
    writer.writerow(["name", *_NUMBERS, *(["time_s"] if timed else []), "eye", *more])
    for index in range(len(measurements)):
        codes = [_code(code, full) for code in measurements.codes[index]]
        light = [repr(float(value)) for value in measurements.XYZ[index]]
        time = [repr(float(measurements.time_s[index]))] if measurements.time_s is not None else []
        name = " ".join(measurements.name[index].split()).lstrip("#") or f"patch{index + 1}"
        filled = repr(float(measurements.filled[index]))
        around = [filled, *(_code(code, full) for code in measurements.around[index])] if parts else []
        writer.writerow([name, *codes, *light, *time, measurements.eye[index], *around])
    return out.getvalue()


def _code(code: float, full: float) -> str:
    return f"{round(code * full, 10):.12g}"
