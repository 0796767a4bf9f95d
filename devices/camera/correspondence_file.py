"""Tables of colours as CSV: ``R,G,B,X,Y,Z[,name]``, or ``X,Y,Z[,name]`` alone for a chart that a camera is to see.

``time_s,f_number[,iso]`` beside them are the exposure of each row, where there are several (thesis Table 4.2).
Comments begin with ``#``; ``# rgb: 0..16383`` says what the camera's values run over, ``# source: ...`` what they are,
``# observer: CIE 2015 10`` whose XYZ they are.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from devices.camera.correspondences import FULL_SCALE, Correspondences
from devices.camera.exposure import Exposure, parse_seconds
from devices.colour_matching import colorimetric_observer
from devices.errors import DeviceError
from documents import Finding
from documents.arrays import Floats
from documents.tables import Cells, ColumnSpec, Form, number_in
from documents.text import visible

_RGB, _XYZ = ("R", "G", "B"), ("X", "Y", "Z")
_EXPOSURE = ("time_s", "f_number", "iso")
_LIGHT = tuple(ColumnSpec(name, (f"XYZ_{name}",), unit="cd/m²") for name in _XYZ)
_NAME = ColumnSpec("name", ("SAMPLE_NAME",), text=True, needed=False)
_SEEN = Form(
    (
        *(ColumnSpec(name, (long, f"RGB_{name}")) for name, long in zip(_RGB, ("red", "green", "blue"), strict=True)),
        *_LIGHT,
        _NAME,
        ColumnSpec("time_s", text=True, needed=False, unit="s"),  # such as 1/15
        ColumnSpec("f_number", needed=False),
        ColumnSpec("iso", needed=False, empty=100.0),
    ),
    "table of colours",
    DeviceError,
    50_000_000,
)
_CHART = Form((*_LIGHT, _NAME), "table of colours", DeviceError, 50_000_000)


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
    table = _SEEN.read(path, _more_faults)
    rgb = table.numbers(*_RGB) / (_full(table) if "rgb" in table.said else 1.0)
    exposures = tuple(_exposure(*given) for given in _given(table))
    light, names = table.numbers(*_XYZ), _names(table)
    return Correspondences(rgb, light, names, rgb >= FULL_SCALE, table.file, exposures or None, _observer(table))


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
    table = _CHART.read(path)
    light = table.numbers(*_XYZ)
    if (light < 0).any() or light[:, 1].max() <= 0:
        raise DeviceError(Finding("XYZ must not be negative, nor all luminances 0", table.file))
    return ReferenceColours(light, _names(table), table.file, _observer(table))


def _names(table: Cells) -> tuple[str, ...]:
    return tuple(visible(name).strip() or f"patch {row + 1}" for row, name in enumerate(table.texts("name")))


def _more_faults(table: Cells) -> Iterator[Finding]:
    """Yield what is wrong with exposures."""
    if ("time_s" in table) != ("f_number" in table):
        yield Finding("an exposure needs both time_s and f_number", table.file, table.header_line)
        return
    for row, given in enumerate(_given(table)):
        try:
            _exposure(*given)
        except (ValueError, DeviceError):
            wrong = next(
                (name for name, value in zip(_EXPOSURE[1:], given[1:], strict=True) if not value > 0), "time_s"
            )
            said = ", ".join(table.rows[row][table.places[name]] for name in _EXPOSURE if name in table)
            yield table.fault(row, wrong, f"the exposure is '{said}'", "such as 1/15, 8, 800")


def _given(table: Cells) -> Iterable[tuple[str, float, float]]:
    """Return time, f-number and ISO of each row; no rows where the table does not say."""
    if "time_s" not in table:
        return []
    iso = table.numbers("iso").tolist() if "iso" in table else [100.0] * len(table)
    return zip(table.texts("time_s"), table.numbers("f_number").tolist(), iso, strict=True)


def _exposure(time: str, f_number: float, iso: float) -> Exposure:
    return Exposure(parse_seconds(time.replace(",", ".")), f_number, iso)


def _observer(table: Cells) -> str | None:
    if "observer" not in table.said:
        return None
    try:
        return colorimetric_observer(table.comment("observer")).name
    except DeviceError as error:
        finding = error.findings[0]
        line = table.line_of("observer")
        raise DeviceError(Finding(finding.message, table.file, line, remedy=finding.remedy)) from None


def _full(table: Cells) -> float:
    """Return the camera's largest value, of a comment such as ``# rgb: 0..16383``."""
    low, _, high = table.comment("rgb").partition("..")
    if number_in(low) != 0 or not number_in(high) > 0:
        what = f"the range of the camera's values is '{table.comment('rgb')}'"
        raise DeviceError(Finding(what, table.file, table.line_of("rgb"), remedy="write '# rgb: 0..16383'"))
    return number_in(high)
