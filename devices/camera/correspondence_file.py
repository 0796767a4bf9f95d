"""Tables of colours as CSV: ``R,G,B,X,Y,Z[,name]``, or ``X,Y,Z[,name]`` alone for a chart that a camera is to see.

``time_s,f_number[,iso]`` beside them are the exposure of each row, where there are several (thesis Table 4.2).
Comments begin with ``#``; ``# rgb: 0..16383`` says what the camera's values run over, ``# source: ...`` what they are,
``# observer: CIE 2015 10`` whose XYZ they are.
"""

from __future__ import annotations

import contextlib
import csv
import math
import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.camera.correspondences import FULL_SCALE, Correspondences
from devices.camera.exposure import Exposure, parse_seconds
from devices.colour_matching import colorimetric_observer
from devices.errors import DeviceError
from documents import Finding
from documents.files import is_comment, other_separator, read_regular_text
from documents.text import visible

Floats = NDArray[np.float64]

_RGB, _XYZ = ("R", "G", "B"), ("X", "Y", "Z")
_EXPOSURE = ("time_s", "f_number", "iso")
_ALSO = {"red": "R", "green": "G", "blue": "B"}
_MOST_FINDINGS = 20
_MOST_BYTES = 50_000_000


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceColours:
    """XYZ (n, 3) in cd/m² of a chart's patches, row by row from the top left, their names, the observer if known."""

    XYZ: Floats
    names: tuple[str, ...]
    file: str | None = None
    observer: str | None = None


def read_correspondences(path: str | os.PathLike[str]) -> Correspondences:
    r"""Read colours that a camera and an instrument both saw.

    Parameters
    ----------
    path
        A CSV table with the columns R, G, B, X, Y and Z, and name, time_s, f_number and iso where they are known. XYZ
        is in cd/m². R, G and B are linear, in 0..1 or in the range that a comment such as ``# rgb: 0..16383`` gives.

    Returns
    -------
    Correspondences
        RGB as shares of full scale and XYZ in cd/m², shape (n, 3) each, with the patches' names and exposures.

    Raises
    ------
    DeviceError
        With file, line, column, value and remedy of the first twenty faults.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "seen.csv"
    ...     _ = file.write_text("# rgb: 0..1000\nR,G,B,X,Y,Z,name\n500,500,250,19,20,11,straw\n")
    ...     colours = read_correspondences(file)
    >>> colours.names, colours.rgb.tolist(), colours.XYZ.tolist()
    (('straw',), [[0.5, 0.5, 0.25]], [[19.0, 20.0, 11.0]])
    """
    file = str(path)
    values, names, full, exposures, observer = _read(file, (*_RGB, *_XYZ))
    rgb = values[:, :3] / full
    return Correspondences(rgb, values[:, 3:], names, rgb >= FULL_SCALE, file, exposures, observer)


def read_reference(path: str | os.PathLike[str]) -> ReferenceColours:
    r"""Read the colours of a chart as measured; columns of camera RGB are passed over. DeviceError as above.

    Parameters
    ----------
    path
        A CSV table with the columns X, Y and Z, in cd/m², and name; a row for each patch, row by row from the top left.

    Returns
    -------
    ReferenceColours
        XYZ in cd/m², shape (n, 3), at least 0, and the patches' names.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "chart.csv"
    ...     _ = file.write_text("X,Y,Z,name\n85.5,90.0,74.3,white\n2.9,3.0,2.5,black\n")
    ...     chart = read_reference(file)
    >>> chart.names, chart.XYZ[:, 1].tolist()
    (('white', 'black'), [90.0, 3.0])
    """
    file = str(path)
    values, names, _, _, observer = _read(file, _XYZ)
    if (values < 0).any() or values[:, 1].max() <= 0:
        raise DeviceError(Finding("XYZ must not be negative, nor all luminances 0", file))
    return ReferenceColours(values, names, file, observer)


def _read(
    file: str, needed: tuple[str, ...]
) -> tuple[Floats, tuple[str, ...], float, tuple[Exposure, ...] | None, str | None]:
    """Return values, names, the camera's full scale, exposures and observer; the last two None where not stated."""
    full = 1.0
    observer: str | None = None
    rows: list[tuple[int, list[str]]] = []
    for number, line in enumerate(_text(file).splitlines(), start=1):
        bare = line.strip()
        if is_comment(bare):
            key, _, value = bare.lstrip("# ").partition(":")
            if key.strip().lower() == "rgb":
                full = _full(value.strip(), file, number)
            elif key.strip().lower() == "observer":
                observer = _observer(value.strip(), file, number)
        elif bare:
            try:
                rows.append((number, next(csv.reader([bare], strict=True))))
            except csv.Error as error:
                raise DeviceError(Finding(f"the table is not CSV: {error}", file, number)) from error
    if len(rows) < 2:
        raise DeviceError(Finding("the table holds no colours", file, remedy=f"columns: {','.join(needed)}[,name]"))
    columns = _columns(rows[0][1], needed, file, rows[0][0])
    findings: list[Finding] = []
    values = np.full((len(rows) - 1, len(needed)), np.nan)
    names: list[str] = []
    exposures: list[Exposure] = []
    for index, (number, cells) in enumerate(rows[1:]):
        if len(cells) != len(rows[0][1]):
            findings.append(Finding(f"the line has {len(cells)} fields, the header {len(rows[0][1])}", file, number))
            continue
        for place, column in enumerate(needed):
            cell = cells[columns[column]].strip()
            with contextlib.suppress(ValueError):
                values[index, place] = float(cell)
            if not math.isfinite(values[index, place]):
                findings.append(
                    Finding(f"{column} is '{cell}'", file, number, columns[column] + 1, "a finite number is needed")
                )
        name = visible(cells[columns["name"]]).strip() if "name" in columns else ""
        names.append(name or f"patch {index + 1}")
        if "time_s" in columns:
            try:
                exposures.append(_exposure(cells, columns))
            except (ValueError, DeviceError):
                given = ", ".join(
                    cells[columns[column_name]].strip() for column_name in _EXPOSURE if column_name in columns
                )
                findings.append(
                    Finding(
                        f"the exposure is '{given}'", file, number, _wrong(cells, columns) + 1, "such as 1/15, 8, 800"
                    )
                )
    if findings:
        raise DeviceError(findings[:_MOST_FINDINGS])
    return values, tuple(names), full, tuple(exposures) or None, observer


def _observer(text: str, file: str, line: int) -> str:
    try:
        return colorimetric_observer(text).name
    except DeviceError as error:
        finding = error.findings[0]
        raise DeviceError(Finding(finding.message, file, line, remedy=finding.remedy)) from None


def _exposure(cells: list[str], columns: dict[str, int]) -> Exposure:
    iso = float(cells[columns["iso"]]) if "iso" in columns else 100.0
    return Exposure(parse_seconds(cells[columns["time_s"]]), float(cells[columns["f_number"]]), iso)


def _wrong(cells: list[str], columns: dict[str, int]) -> int:
    """Return the place of what is no f-number or ISO in an exposure that is wrong; else that of the time."""
    for name in ("f_number", "iso"):
        try:
            number = float(cells[columns[name]]) if name in columns else 1.0
        except ValueError:
            number = math.nan
        if not (math.isfinite(number) and number > 0):
            return columns[name]
    return columns["time_s"]


def _text(file: str) -> str:
    return read_regular_text(file, _MOST_BYTES, "table", error=DeviceError)


def _full(text: str, file: str, line: int) -> float:
    low, _, high = text.partition("..")
    try:
        full = float(high)
        if float(low) != 0 or not (math.isfinite(full) and full > 0):
            raise ValueError(text)
    except ValueError:
        raise DeviceError(
            Finding(f"the range of the camera's values is '{text}'", file, line, remedy="write '# rgb: 0..16383'")
        ) from None
    return full


def _columns(header: list[str], needed: tuple[str, ...], file: str, line: int) -> dict[str, int]:
    if separated := other_separator(header, file, line):
        raise DeviceError(separated)
    known = {name.lower(): name for name in (*_RGB, *_XYZ, *_EXPOSURE, "name")} | _ALSO
    columns: dict[str, int] = {}
    for place, cell in enumerate(header):
        column = known.get(cell.strip().lower())
        if column is None:
            continue
        if column in columns:
            raise DeviceError(Finding(f"the column '{column}' stands twice", file, line, place + 1))
        columns[column] = place
    missing = [name for name in needed if name not in columns]
    if ("time_s" in columns) != ("f_number" in columns):
        raise DeviceError(Finding("an exposure needs both time_s and f_number", file, line))
    if missing:
        remedy = f"columns: {','.join(needed)}[,name]"
        raise DeviceError(Finding(f"the header has no {', '.join(missing)}", file, line, remedy=remedy))
    return columns
