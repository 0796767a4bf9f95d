"""ArgyllCMS's ``.ti3``: display readings as CGATS, RGB in percent, XYZ, and spectra where there are any.

Stereo mode, eyes, times, and the area and surround of patches that did not fill the picture have no place in Argyll's
own files; here they are a keyword and fields that are declared as CGATS asks (``KEYWORD "EYE"``), and that other
programs pass over.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import cast

import numpy as np

from devices.errors import DeviceError
from devices.readings.arrangement import PatchEye
from devices.readings.cgats import Cell, CgatsTable, later_table, read_table
from devices.readings.spectra import FIELD, Spectra, read_spectra, spectral_head, spectral_rows
from devices.readings.table import CIE_1931_2, PATCH_EYES, Measurements, argyll_observer
from devices.readings.ti3_statements import calibration_lines, read_statements
from documents import Finding
from documents.arrays import Floats
from documents.files import read_regular

_RGB, _XYZ = ("RGB_R", "RGB_G", "RGB_B"), ("XYZ_X", "XYZ_Y", "XYZ_Z")
_NAMES = ("SAMPLE_NAME", "SAMPLE_LOC", "SAMPLE_ID")
# Ten thousand readings with a spectrum each.
_MOST_BYTES = 50_000_000
_SETTINGS = "MONITOR_SETTINGS"
# Argyll writes a zero as -0.00100 at times. This much of 100 is a fortieth of a code of 8 bits.
_ROUNDING = 0.01
_MODE, _EYE, _TIME, _AREA = "STEREO_MODE", "EYE", "TIME_S", "PATCH_AREA"
_SURROUND = ("SURROUND_R", "SURROUND_G", "SURROUND_B")


def read_ti3(path: Path) -> Measurements:
    """Read the readings of the ``.ti3`` file at ``path``, and the calibration that they were taken through.

    A calibration (the table CAL after the readings) is applied to the codes: ``codes`` are those that the panel
    received, and ``gamma_table`` is the identity; ``assumptions`` says how far it is from that. One that lifts code 0,
    or ends far below full drive, is not: then ``codes`` are the file's, and ``gamma_table`` is the calibration.

    XYZ that are normalised to a white of 100 are brought back to cd/m² by ``LUMINANCE_XYZ_CDM2``; where the file has
    none, they stay relative and ``assumptions`` says so. Spectra (``SPEC_nnn``, in mW/(sr m² nm)) are brought to the
    unit of XYZ; where the file has no XYZ, these are summed from the spectra at their own spacing.

    Raises
    ------
    DeviceError
        With file, line, column and remedy of what is wrong: also readings of a printer, or of codes at video levels.
    """
    content = read_regular(path, _MOST_BYTES, "table", error=DeviceError)
    return parse_ti3(content.decode("utf-8-sig", errors="replace").splitlines(), str(path))


def parse_ti3(lines: list[str], file: str) -> Measurements:
    """Read the first table in ``lines``; ``file`` is the name that findings carry; else as `read_ti3`."""
    table = read_table(lines, file)
    names = table.names()
    spectral = [name for name in names if FIELD.fullmatch(name)]
    wanted = (*_RGB, *(_XYZ if not spectral or set(_XYZ) & set(names) else ()))
    missing = [name for name in wanted if name not in names]
    if missing:
        remedy = "an ArgyllCMS .ti3 of a display: RGB, and XYZ or spectra"
        raise DeviceError(table.finding(f"the table has no {', '.join(missing)}", table.fields[0], remedy))
    findings: list[Finding] = []
    codes = _numbers(table, _RGB, findings, highest=100.0)
    light = _numbers(table, _XYZ, findings) if _XYZ[0] in wanted else None
    values = _numbers(table, tuple(spectral), findings)
    eyes = _eyes(table, findings)
    times = _numbers(table, (_TIME,), findings)[:, 0] if _TIME in names else None
    area = _numbers(table, (_AREA,), findings, highest=100.0)[:, 0] / 100.0 if _AREA in names else None
    if area is not None and len(area) and area.min() <= 0:
        what = f"{_AREA} is {100 * area.min():g}"
        findings.append(table.finding(what, table.rows[int(area.argmin())][names.index(_AREA)], "above 0, in percent"))
    surrounded = set(_SURROUND) <= set(names)
    surround = _numbers(table, _SURROUND, findings, highest=100.0) / 100.0 if surrounded else None
    if findings:
        raise DeviceError(findings[:20])
    stated = read_statements(table, later_table(lines, table, "CAL"), codes / 100.0)
    scale, notes = _absolute(table)
    notes = [*stated.notes(), *notes]
    XYZ = None if light is None else light * scale
    spectra: Spectra | None = None
    if spectral:
        spectra = read_spectra(table, spectral, values * scale, XYZ, stated.observer)
        notes += spectra.notes
    if XYZ is None:
        assert spectra is not None
        XYZ = spectra.XYZ
    named = next((names.index(name) for name in _NAMES if name in names), None)
    return Measurements(
        stated.codes_sent,
        XYZ,
        tuple(f"patch{i + 1}" if named is None else row[named].text for i, row in enumerate(table.rows)),
        times,
        eyes,
        _keyword_text(table, _MODE),
        spectra=None if spectra is None else spectra.per_nm,
        wavelengths_nm=None if spectra is None else spectra.wavelengths_nm,
        instrument=_keyword_text(table, "TARGET_INSTRUMENT"),
        notes=_keyword_text(table, "DESCRIPTOR"),
        assumptions=tuple(notes),
        observer=stated.observer,
        monitor_settings=_keyword_text(table, _SETTINGS),
        gamma_table=stated.gamma_table,
        area=area,
        surround=surround,
    )


def _numbers(table: CgatsTable, names: tuple[str, ...], findings: list[Finding], highest: float = math.inf) -> Floats:
    """Return the columns of ``names``, shape (n, k); what is no number, or too high, goes to ``findings``."""
    every = table.names()
    places = [every.index(name) for name in names]
    values = np.full((len(table.rows), len(names)), np.nan)
    for index, row in enumerate(table.rows):
        for column, place in enumerate(places):
            cell: Cell = row[place]
            try:
                value = float(cell.text)
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                findings.append(table.finding(f"{every[place]} is '{cell.text}'", cell, "a finite number is needed"))
            elif highest < math.inf and not -_ROUNDING <= value <= highest + _ROUNDING:
                what = f"{every[place]} is {cell.text}"
                findings.append(table.finding(what, cell, f"device values are 0..{highest:g}"))
            values[index, column] = value if highest == math.inf else min(max(value, 0.0), highest)
    return values


def _eyes(table: CgatsTable, findings: list[Finding]) -> tuple[PatchEye, ...]:
    if _EYE not in table.names():
        return ()
    cells = [row[table.names().index(_EYE)] for row in table.rows]
    findings += [
        table.finding(f"'{c.text}' is no eye", c, "left, right or both") for c in cells if c.text not in PATCH_EYES
    ]
    return tuple(cast(PatchEye, cell.text) for cell in cells)


def _keyword_text(table: CgatsTable, keyword: str) -> str:
    return table.keywords[keyword].text if keyword in table.keywords else ""


def _absolute(table: CgatsTable) -> tuple[float, list[str]]:
    """Return what brings the file's light to cd/m², and what was taken for granted."""
    normalised = table.keywords.get("NORMALIZED_TO_Y_100")
    answer = normalised.text.strip().upper() if normalised else "NO"
    if normalised is not None and answer not in ("YES", "NO"):
        raise DeviceError(table.finding(f"NORMALIZED_TO_Y_100 is '{normalised.text}'", normalised, "YES or NO"))
    if answer == "NO":
        return 1.0, []
    luminance = table.keywords.get("LUMINANCE_XYZ_CDM2")
    if luminance is None:
        return 1.0, ["XYZ are relative to a white of Y = 100; the file does not say how bright that is"]
    try:
        value = float(luminance.text.split()[1])
    except (ValueError, IndexError):
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        what = f"LUMINANCE_XYZ_CDM2 is '{luminance.text}'"
        raise DeviceError(table.finding(what, luminance, "three numbers, Y above 0"))
    return value / 100.0, []


def write_ti3(measurements: Measurements, path: Path) -> None:
    """Write ``measurements`` to ``path`` as a ``.ti3`` with absolute XYZ, and spectra where there are any.

    DeviceError if the spectra's wavelengths have no place in the format: they must be evenly spaced, or whole numbers
    of nm.
    """
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
    if measurements.observer != CIE_1931_2:
        head.append(f"OBSERVER {_quoted(argyll_observer(measurements.observer))}")
    if measurements.mode:
        head += [f'KEYWORD "{_MODE}"', f"{_MODE} {_quoted(measurements.mode)}"]
    if measurements.monitor_settings:
        head += [f'KEYWORD "{_SETTINGS}"', f"{_SETTINGS} {_quoted(measurements.monitor_settings)}"]
    keywords, spectral = spectral_head(measurements)
    eyes = [] if set(measurements.eye) <= {"both"} else [[_EYE, *measurements.eye]]
    times = [] if measurements.time_s is None else [[_TIME, *(repr(float(time)) for time in measurements.time_s)]]
    besides = [*eyes, *times, *_parts(measurements)]
    head += [f'KEYWORD "{column[0]}"' for column in besides]
    fields = ["SAMPLE_ID", "SAMPLE_NAME", *_RGB, *_XYZ, *spectral, *(column[0] for column in besides)]
    head += [*keywords, "", f"NUMBER_OF_FIELDS {len(fields)}", "BEGIN_DATA_FORMAT", " ".join(fields)]
    head += ["END_DATA_FORMAT", "", f"NUMBER_OF_SETS {len(measurements)}", "BEGIN_DATA"]
    spectra = spectral_rows(measurements)
    rows = []
    for index in range(len(measurements)):
        codes = [f"{round(100.0 * code, 10):.12g}" for code in measurements.codes[index]]
        light = [repr(float(value)) for value in measurements.XYZ[index]]
        own = [column[index + 1] for column in besides]
        rows.append(
            " ".join([str(index + 1), _quoted(measurements.name[index]), *codes, *light, *spectra[index], *own])
        )
    return "\n".join([*head, *rows, "END_DATA", *calibration_lines(measurements.gamma_table)]) + "\n"


def _parts(measurements: Measurements) -> list[list[str]]:
    """Return the columns, in percent, of what the patches filled and what was around them; none if all filled it."""
    if measurements.area is None and measurements.surround is None:
        return []
    area = [_AREA, *(f"{round(100.0 * share, 10):.12g}" for share in measurements.filled)]
    around = measurements.around.T
    sides = [[name, *(f"{round(100.0 * code, 10):.12g}" for code in around[i])] for i, name in enumerate(_SURROUND)]
    return [area, *sides]


def _quoted(text: str) -> str:
    return '"' + " ".join(text.split()).replace('"', '""') + '"'
