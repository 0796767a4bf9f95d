"""Tables of colours converted by a display model: three columns of numbers, and other columns that stay."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO, Literal, TextIO

import numpy as np
from numpy.typing import NDArray

from devices.colour_matching import DEFAULT_OBSERVER
from devices.display import DisplayModel
from devices.errors import DeviceError
from documents import Finding
from documents.tables import ColumnSpec, Form, csv_lines, decoded

_MOST_BYTES = 100_000_000
_STREAM = "standard input"

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
        stream.write(csv_lines([[*self.others, *COLUMNS[self.kind]]]))
        rows = zip(self.rows, self.values, strict=True)
        stream.write(csv_lines([*cells, *(f"{value:.10g}" for value in values)] for cells, values in rows))


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
    >>> import io
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
        from devices.readings import for_observer, read_measurements

        readings = read_measurements(file)
        if kind == "xyz":
            readings = for_observer(readings, observer, str(file))
        values = full * readings.codes if kind == "code" else readings.XYZ
        return ColourTable(kind, values, ("name",), tuple((name,) for name in readings.name))
    form = _form(kind, full)
    table = form.read(file) if isinstance(file, str | Path) else form.parse(_streamed(file), _STREAM)
    known = {table.header[place] for place in table.places.values()} | {*COLUMNS["code"], *COLUMNS["xyz"]}
    kept = [place for place, name in enumerate(table.header) if name not in known]
    rows = tuple(tuple(cells[place] for place in kept) for cells in table.rows)
    return ColourTable(kind, table.numbers(*COLUMNS[kind]), tuple(table.header[place] for place in kept), rows)


def _form(kind: Kind, full: float) -> Form:
    """Return the form of a table of codes in 0..``full``, or of XYZ in cd/m²."""
    columns = {
        "code": tuple(ColumnSpec(name, (name[0].upper(),), least=0.0, most=full) for name in COLUMNS["code"]),
        "xyz": tuple(ColumnSpec(name, unit="cd/m²") for name in COLUMNS["xyz"]),
    }
    return Form(columns[kind], "table", DeviceError, _MOST_BYTES)


def _streamed(stream: BinaryIO) -> str:
    data = stream.read(_MOST_BYTES + 1)
    if len(data) > _MOST_BYTES:
        raise DeviceError(Finding(f"the table is larger than {_MOST_BYTES / 1e6:g} MB", _STREAM))
    return decoded(data, _STREAM, error=DeviceError)
