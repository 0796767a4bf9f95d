"""ArgyllCMS's ``.ti3``: CGATS tables of display readings, RGB in percent and XYZ."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from devices.errors import DeviceError
from devices.measurements.table import Measurements
from documents import Finding

_TOKEN = re.compile(r'"((?:[^"]|"")*)"|(\S+)')
_FIELDS = ("RGB_R", "RGB_G", "RGB_B", "XYZ_X", "XYZ_Y", "XYZ_Z")


def read_ti3(path: Path) -> Measurements:
    """Read the first table of the ``.ti3`` file at ``path``.

    XYZ that are normalised to a white of 100 are brought back to cd/m² by ``LUMINANCE_XYZ_CDM2``; where the file has
    none, they stay relative and ``assumptions`` says so. Spectra in the file are not read.

    Raises
    ------
    DeviceError
        With file, line, column and remedy of what is wrong.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as error:
        raise DeviceError(Finding(f"the table cannot be read: {error.strerror}", str(path))) from error
    return parse_ti3(lines, str(path))


def parse_ti3(lines: list[str], file: str) -> Measurements:
    """Read the first table in ``lines``; ``file`` is the name that findings carry; else as `read_ti3`."""
    said: dict[str, str] = {}
    fields: list[str] = []
    rows: list[tuple[int, list[tuple[str, int]]]] = []
    inside = ""
    for number, line in enumerate(lines, start=1):
        tokens = [(m[1].replace('""', '"') if m[1] is not None else m[2], m.start() + 1) for m in _TOKEN.finditer(line)]
        if not tokens or tokens[0][0].startswith("#"):
            continue
        word = tokens[0][0]
        if word.startswith("BEGIN_"):
            inside = word.removeprefix("BEGIN_")
        elif word == "END_DATA":
            break
        elif word.startswith("END_"):
            inside = ""
        elif inside == "DATA_FORMAT":
            fields += [text for text, _ in tokens]
        elif inside == "DATA":
            rows.append((number, tokens))
        elif len(tokens) > 1:
            said[word] = tokens[1][0]
    missing = [field for field in _FIELDS if field not in fields]
    if missing:
        raise DeviceError(
            Finding(f"the table has no {', '.join(missing)}", file, remedy="an ArgyllCMS .ti3 of a display, RGB_XYZ")
        )
    if not rows:
        raise DeviceError(Finding("the table holds no measurements", file))
    findings: list[Finding] = []
    values = np.full((len(rows), 6), np.nan)
    names = []
    for index, (number, tokens) in enumerate(rows):
        if len(tokens) != len(fields):
            findings.append(Finding(f"the line has {len(tokens)} fields, the format {len(fields)}", file, number))
            continue
        for place, field in enumerate(_FIELDS):
            text, column = tokens[fields.index(field)]
            try:
                value = float(text)
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                findings.append(Finding(f"{field} is '{text}'", file, number, column, "a finite number is needed"))
            elif place < 3 and not 0 <= value <= 100:
                findings.append(Finding(f"{field} is {text}", file, number, column, "device values are 0..100"))
            values[index, place] = value
        named = next((f for f in ("SAMPLE_NAME", "SAMPLE_LOC", "SAMPLE_ID") if f in fields), None)
        names.append(tokens[fields.index(named)][0] if named else f"patch{index + 1}")
    if findings:
        raise DeviceError(findings[:20])
    XYZ, assumed = _absolute(values[:, 3:], said, file)
    left_out = ["spectra in the file were not read"] if any(field.startswith("SPEC_") for field in fields) else []
    return Measurements(
        values[:, :3] / 100.0,
        XYZ,
        tuple(names),
        instrument=said.get("TARGET_INSTRUMENT", ""),
        notes=said.get("DESCRIPTOR", ""),
        assumptions=tuple([*assumed, *left_out]),
    )


def _absolute(XYZ: np.ndarray, said: dict[str, str], file: str) -> tuple[np.ndarray, list[str]]:
    if said.get("NORMALIZED_TO_Y_100", "NO").upper() != "YES":
        return XYZ, []
    if "LUMINANCE_XYZ_CDM2" not in said:
        return XYZ, ["XYZ are relative to a white of Y = 100; the file does not say how bright that is"]
    try:
        luminance = float(said["LUMINANCE_XYZ_CDM2"].split()[1])
    except (ValueError, IndexError):
        luminance = math.nan
    if not (math.isfinite(luminance) and luminance > 0):
        raise DeviceError(
            Finding(f"LUMINANCE_XYZ_CDM2 is '{said['LUMINANCE_XYZ_CDM2']}'", file, remedy="three numbers, Y above 0")
        )
    return XYZ * (luminance / 100.0), []


def write_ti3(measurements: Measurements, path: Path) -> None:
    """Write ``measurements`` to ``path`` as a ``.ti3`` with absolute XYZ, without eyes, times and spectra."""
    path.write_text(format_ti3(measurements), encoding="utf-8")


def format_ti3(measurements: Measurements) -> str:
    """Return ``measurements`` as the text of a ``.ti3``; see `write_ti3`."""
    white = measurements.XYZ[int(np.argmax(measurements.XYZ[:, 1]))] if len(measurements) else np.zeros(3)
    head = [
        "CTI3",
        "",
        f"DESCRIPTOR {_quoted(measurements.notes or 'Display measurements')}",
        'ORIGINATOR "cyclopean"',
        'DEVICE_CLASS "DISPLAY"',
        'COLOR_REP "RGB_XYZ"',
        'NORMALIZED_TO_Y_100 "NO"',
        f'LUMINANCE_XYZ_CDM2 "{white[0]:.6f} {white[1]:.6f} {white[2]:.6f}"',
    ]
    if measurements.instrument:
        head.append(f"TARGET_INSTRUMENT {_quoted(measurements.instrument)}")
    head += ["", "NUMBER_OF_FIELDS 8", "BEGIN_DATA_FORMAT", f"SAMPLE_ID SAMPLE_NAME {' '.join(_FIELDS)}"]
    head += ["END_DATA_FORMAT", "", f"NUMBER_OF_SETS {len(measurements)}", "BEGIN_DATA"]
    rows = [
        f"{index + 1} {_quoted(measurements.name[index])} "
        + " ".join(f"{round(100.0 * code, 10):.12g}" for code in measurements.codes[index])
        + " "
        + " ".join(repr(float(value)) for value in measurements.XYZ[index])
        for index in range(len(measurements))
    ]
    return "\n".join([*head, *rows, "END_DATA"]) + "\n"


def _quoted(text: str) -> str:
    return '"' + " ".join(text.split()).replace('"', '""') + '"'
