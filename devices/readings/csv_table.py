"""Measurements as CSV: ``name,red,green,blue,X,Y,Z[,time_s][,eye]``, with what holds for all in comments above.

Patches that did not fill the picture have the share of it that they filled in ``area``, and the codes around them in
``surround_red,surround_green,surround_blue``; empty cells stand for all of it, and for black.

The comments are ``# codes: 0..255``, ``# mode: quad-buffered``, ``# eye: left``, ``# instrument: ...``,
``# notes: ...``, ``# panel: 1920x1080,0.2768,120,8``, ``# observer: CIE 1964 10``, ``# gamma_table: ...``, the graphics
card's table as `display measure` read it, and ``# monitor_settings: {"brightness_percent": 35}``; ``R,G,B`` may stand
for ``red,green,blue``, and names may be left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import cast

import numpy as np

from devices.colour.spaces import XYZ_from_xyY
from devices.display.gamma_table import GammaTable
from devices.errors import DeviceError
from devices.readings.arrangement import PatchEye
from devices.readings.code_range import CODES, DRIVEN, PARTS, SURROUND, driven, part_faults
from devices.readings.table import CIE_1931_2, OBSERVERS, PATCH_EYES, Measurements, observer_name
from documents import Finding
from documents.tables import Cells, ColumnSpec, Form, csv_lines

_LIGHT = ("X", "Y", "Z")
_CD_M2 = "cd/m²"
_BESIDE = (ColumnSpec("time_s", needed=False, unit="s"), ColumnSpec("eye", text=True, needed=False), *PARTS)
_FORM = Form(
    (*DRIVEN, *(ColumnSpec(name, (f"XYZ_{name}",), unit=_CD_M2) for name in _LIGHT), *_BESIDE),
    "table of measurements",
    DeviceError,
    # luminance and chromaticity, as many instruments write them
    instead=(
        (*DRIVEN, ColumnSpec("x"), ColumnSpec("y"), ColumnSpec("Y", ("L", "Lv", "luminance"), unit=_CD_M2), *_BESIDE),
    ),
    misspelt=True,
)


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
    return _measurements(_FORM.read(path, _more_faults), code_range)


def parse_csv(lines: Iterable[str], file: str, code_range: str | None = None) -> Measurements:
    """Read the measurements in ``lines``; ``file`` is the name that findings carry; else as `read_csv`."""
    return _measurements(_FORM.parse("\n".join(line.rstrip("\r\n") for line in lines), file, _more_faults), code_range)


def _more_faults(table: Cells) -> Iterator[Finding]:
    """Yield what is wrong with a table beside its numbers."""
    if SURROUND[0] in table and "area" not in table:
        yield Finding("the header has no area", table.file, table.header_line, remedy="a surround is that of a part")
    yield from part_faults(table)
    for row, eye in enumerate(_eyes(table)):
        if eye not in PATCH_EYES:
            yield table.fault(row, "eye", f"'{eye}' is no eye", "left, right or both")
    if "x" in table:
        for row in np.flatnonzero((table.numbers("y") <= 0) & (table.numbers("Y") != 0)).tolist():
            yield table.fault(row, "y", f"y is '{table.texts('y')[row]}'", "a chromaticity above 0")
    said = table.comment("observer", CIE_1931_2)
    if observer_name(said) is None:
        what, remedy = f"the observer '{said}' is not known", f"one of {', '.join(OBSERVERS)}"
        yield Finding(what, table.file, table.line_of("observer"), remedy=remedy)
    try:
        _gamma_table(table)
    except DeviceError as error:
        remedy = "copy the line as it was written, or leave it out"
        yield Finding(str(error), table.file, table.line_of("gamma_table"), remedy=remedy)


def _gamma_table(table: Cells) -> GammaTable | None:
    return GammaTable.from_text(table.comment("gamma_table")) if "gamma_table" in table.said else None


def _eyes(table: Cells) -> list[str]:
    return [eye or table.comment("eye", "both") for eye in table.texts("eye")]


def _measurements(table: Cells, code_range: str | None) -> Measurements:
    drive = driven(table, code_range)
    read = [*(column.name for column in (*DRIVEN, *_BESIDE)), *_LIGHT, "x", "y"]
    ignored = [
        cell for place, cell in enumerate(table.header) if place not in {table.places.get(name) for name in read}
    ]
    left_out = f"the columns {', '.join(ignored)} were not read" if ignored else ""
    return Measurements(
        drive.codes,
        table.numbers(*_LIGHT) if "X" in table else XYZ_from_xyY(table.numbers("x", "y", "Y")),
        tuple(table.texts("name")) if "name" in table else tuple(f"patch{row + 1}" for row in range(len(table))),
        table.numbers("time_s") if "time_s" in table else None,
        tuple(cast(PatchEye, eye) for eye in _eyes(table)),
        table.comment("mode"),
        instrument=table.comment("instrument"),
        notes=table.comment("notes"),
        assumptions=tuple(text for text in (drive.assumed, left_out) if text),
        panel=table.comment("panel"),
        observer=observer_name(table.comment("observer", CIE_1931_2)) or CIE_1931_2,
        monitor_settings=table.comment("monitor_settings"),
        area=table.numbers("area") if "area" in table else None,
        surround=drive.around,
        gamma_table=_gamma_table(table),
    )


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
    head = f"# codes: 0..{full:g}\n"
    for key in ("mode", "instrument", "notes", "panel", "monitor_settings"):
        if text := " ".join(str(getattr(measurements, key)).split()):
            head += f"# {key}: {text}\n"
    if measurements.observer != CIE_1931_2:
        head += f"# observer: {measurements.observer}\n"
    if measurements.gamma_table is not None:
        head += f"# gamma_table: {measurements.gamma_table.to_text()}\n"
    timed = measurements.time_s is not None
    parts = measurements.area is not None or measurements.surround is not None
    more = ["area", *SURROUND] if parts else []
    rows = [["name", *CODES, *_LIGHT, *(["time_s"] if timed else []), "eye", *more]]
    for index in range(len(measurements)):
        codes = [_code(code, full) for code in measurements.codes[index]]
        light = [repr(float(value)) for value in measurements.XYZ[index]]
        time = [repr(float(measurements.time_s[index]))] if measurements.time_s is not None else []
        name = " ".join(measurements.name[index].split()).lstrip("#") or f"patch{index + 1}"
        filled = repr(float(measurements.filled[index]))
        around = [filled, *(_code(code, full) for code in measurements.around[index])] if parts else []
        rows.append([name, *codes, *light, *time, measurements.eye[index], *around])
    return head + csv_lines(rows)


def _code(code: float, full: float) -> str:
    return f"{round(code * full, 10):.12g}"
