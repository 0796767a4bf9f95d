"""Tables of colours converted by a display model: three columns of numbers, and other columns that stay."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO, Literal, TextIO

import numpy as np
from numpy.typing import NDArray

from devices.colour_matching import DEFAULT_OBSERVER
from devices.display.model import DisplayModel
from devices.errors import DeviceError
from documents import Finding
from documents.files import is_comment, other_separator, read_regular, unreadable

_MOST_BYTES = 100_000_000

Kind = Literal["code", "xyz"]
COLUMNS: dict[Kind, tuple[str, str, str]] = {"code": ("red", "green", "blue"), "xyz": ("X", "Y", "Z")}


@dataclass(frozen=True, slots=True, eq=False)
class ColourTable:
    """``values``: shape (n, 3), device codes in 0..``full`` or XYZ in cd/m²; ``kind`` says which.

    ``others`` are the names of the other columns, ``rows`` their cells. ``outside`` counts the colours outside the
    gamut, which became the nearest codes, channel by channel.
    """

    kind: Kind
    values: NDArray[np.float64]
    others: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    outside: int = 0

    def write(self, stream: TextIO) -> None:
        """Write the table as CSV: the other columns first."""
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([*self.others, *COLUMNS[self.kind]])
        for cells, values in zip(self.rows, self.values, strict=True):
            writer.writerow([*cells, *(f"{value:.10g}" for value in values)])


def convert_colours(
    file: str | Path | BinaryIO,
    model: DisplayModel,
    target: Kind,
    full: float = 255.0,
    observer: str = DEFAULT_OBSERVER,
) -> ColourTable:
    """Convert a table of device codes to XYZ, or back.

    Parameters
    ----------
    file
        A CSV file, open for bytes or by its path, or an ArgyllCMS ``.ti3``. It has the columns ``red,green,blue`` or
        ``X,Y,Z``.
    model
        The display model of an eye.
    target
        ``xyz`` or ``code``: what the table is converted to.
    full
        The code of full drive.
    observer
        The colorimetric observer of the display model's XYZ.

    Returns
    -------
    ColourTable
        XYZ in cd/m², or codes in 0..``full``, not rounded.

    Raises
    ------
    DeviceError
        With file, line, column and value of what is wrong.

    Examples
    --------
    >>> from devices.display import read_display
    >>> model = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("quad-buffered").left
    >>> file = io.BytesIO(b"red,green,blue" + bytes([10]) + b"255,255,255")
    >>> convert_colours(file, model, "xyz").values.round(2).tolist()
    [[26.74, 27.88, 31.2]]
    """
    table = read_colours(file, "code" if target == "xyz" else "xyz", full, observer)
    if target == "xyz":
        return replace(table, kind=target, values=model.xyz(table.values / full))
    outside = model.clipping(table.values).any_channel
    return replace(table, kind=target, values=model.code(table.values) * full, outside=outside)


def read_colours(file: str | Path | BinaryIO, kind: Kind, full: float, observer: str = DEFAULT_OBSERVER) -> ColourTable:
    """Read codes in 0..``full``, or XYZ; errors as `convert_colours`."""
    if isinstance(file, str | Path) and str(file).lower().endswith(".ti3"):
        from devices.measurements.read import read_measurements
        from devices.measurements.spectra import for_observer

        readings = read_measurements(file)
        if kind == "xyz":
            readings = for_observer(readings, observer, str(file))
        values = full * readings.codes if kind == "code" else readings.XYZ
        return ColourTable(kind, values, ("name",), tuple((name,) for name in readings.name))
    name = str(file) if isinstance(file, str | Path) else "standard input"
    try:
        text = io.StringIO(_content(file).decode("utf-8-sig"), newline="")
        lines = [(n, row) for n, row in enumerate(csv.reader(text, strict=True), 1) if row and not is_comment(row[0])]
    except OSError as error:
        raise DeviceError(unreadable(error, Path(name), "table")) from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise DeviceError(Finding(f"the table is not CSV in UTF-8: {error}", name)) from error
    return _parse(lines, name, kind, full)


def _content(file: str | Path | BinaryIO) -> bytes:
    if isinstance(file, str | Path):
        return read_regular(file, _MOST_BYTES, "table", error=DeviceError)
    data = file.read(_MOST_BYTES + 1)
    if len(data) > _MOST_BYTES:
        raise DeviceError(Finding(f"the table is larger than {_MOST_BYTES / 1e6:g} MB", "standard input"))
    return data


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
    needed = f"a number in 0..{full:g}" if kind == "code" else "a finite number"
    findings: list[Finding] = []
    for index, (line, cells) in enumerate(lines[1:]):
        for place, name in enumerate(given):
            cell = cells[head.index(name)] if len(cells) == len(head) else ""
            try:
                value = float(cell)
            except ValueError:
                value = np.nan
            if not np.isfinite(value) or (kind == "code" and not 0 <= value <= full):
                findings.append(Finding(f"{name} is '{cell}'", file, line, head.index(name) + 1, f"{needed} is needed"))
            values[index, place] = value
    if findings:
        raise DeviceError(findings[:20])
    others = tuple(name for name in head if name not in (*COLUMNS["code"], *COLUMNS["xyz"]))
    kept = [head.index(name) for name in others]
    rows = tuple(tuple(cells[at] for at in kept) for _, cells in lines[1:])
    return ColourTable(kind, values, others, rows)
