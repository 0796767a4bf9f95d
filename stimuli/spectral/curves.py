"""Curves over wavelength: the spectrum of a light, and the sensitivities of a sensor."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from documents import Finding
from documents.files import is_comment, other_separator, read_regular_text
from stimuli.errors import StimulusError
from stimuli.spectral.picture import MUST_COVER_NM

Floats = NDArray[np.float64]

WAVELENGTH = "wavelength_nm"
SENSITIVITY = ("red", "green", "blue")
_MOST_BYTES = 2_000_000
# Beyond it sums overflow; no unit makes light of it.
_MOST = 1e30


def read_sensitivities(path: Path, wavelengths_nm: Floats) -> Floats:
    """Return the sensitivities of a sensor's red, green and blue photosites at ``wavelengths_nm``, (n, 3), in any unit.

    The CSV file at ``path`` has the columns wavelength_nm, red, green, blue: signal per radiance and nm. Between its
    rows it is interpolated, beyond them it is 0. StimulusError if it does not cover 400..700 nm or a channel sees
    nothing.
    """
    waves, curves = _read(path, SENSITIVITY)
    dead = [name for name, curve in zip(SENSITIVITY, curves.T, strict=True) if not curve.any()]
    if dead:
        raise StimulusError.at(path, f"{dead[0]} sees nothing at any wavelength", "give its sensitivity")
    return np.stack([np.interp(wavelengths_nm, waves, curve, left=0.0, right=0.0) for curve in curves.T], axis=1)


def read_illuminant(name: str, wavelengths_nm: Floats) -> Floats:
    """Return the spectrum of a light at ``wavelengths_nm``, shape (n,), by file or by the name of a CIE illuminant.

    The CSV file has the columns wavelength_nm, value. Names are those of colour-science: A, D50, D65, E, FL2 and so
    on, relative to 100 at 560 nm. Between tabulated wavelengths it is interpolated, beyond them it is 0.
    StimulusError if it does not cover 400..700 nm.
    """
    if Path(name).suffix.lower() == ".csv":
        waves, values = _read(Path(name), ("value",))
        return np.interp(wavelengths_nm, waves, values[:, 0], left=0.0, right=0.0)
    from colour.colorimetry.datasets import SDS_ILLUMINANTS

    if name not in SDS_ILLUMINANTS:
        raise StimulusError.of(f"there is no illuminant '{name}'", "A, D50, D65, E, …, or a .csv file")
    table = SDS_ILLUMINANTS[name]
    known = np.asarray(table.wavelengths, dtype=np.float64)
    return np.interp(wavelengths_nm, known, np.asarray(table.values, dtype=np.float64), left=0.0, right=0.0)


def read_reflectances(path: Path) -> tuple[Floats, dict[str, Floats]]:
    """Return the wavelengths (n,) of a CSV file of reflectances, and each object's by the name of its column.

    The columns are wavelength_nm and one or more others. StimulusError if it does not cover 400..700 nm.
    """
    waves, values, names = _read_named(path, None)
    return waves, {name: values[:, index] for index, name in enumerate(names)}


def _read(path: Path, names: tuple[str, ...]) -> tuple[Floats, Floats]:
    """Return the rising wavelengths and the values (n, names) of a CSV file of curves that are nowhere negative."""
    waves, values, _ = _read_named(path, names)
    return waves, values


def _read_named(path: Path, names: tuple[str, ...] | None) -> tuple[Floats, Floats, tuple[str, ...]]:
    """Return what `_read` returns, and the names; None takes every column beside the wavelengths."""
    try:
        text = read_regular_text(path, _MOST_BYTES, "table", error=StimulusError)
        file = io.StringIO(text, newline="")
        rows = [(n, row) for n, row in enumerate(csv.reader(file, strict=True), 1) if row and not is_comment(row[0])]
    except csv.Error as error:
        raise StimulusError.at(path, f"it is no CSV: {error}", "write it again") from error
    if rows and (separated := other_separator(rows[0][1], str(path), rows[0][0])):
        raise StimulusError(separated)
    head = [cell.strip() for cell in rows[0][1]] if rows else []
    if names is None:
        names = tuple(name for name in head if name and name != WAVELENGTH) or ("reflectance",)
    columns = (WAVELENGTH, *names)
    missing = [name for name in columns if name not in head]
    if missing:
        raise StimulusError.at(path, f"the header has no {', '.join(missing)}", f"columns: {','.join(columns)}")
    twice = [name for name in columns if head.count(name) > 1]
    if twice:
        raise StimulusError.at(path, f"the column '{twice[0]}' stands twice", "keep one")
    table = np.empty((len(rows) - 1, len(columns)))
    for index, (line, cells) in enumerate(rows[1:]):
        for column, name in enumerate(columns):
            cell = cells[head.index(name)] if len(cells) == len(head) else ""
            try:
                table[index, column] = float(cell)
            except ValueError:
                table[index, column] = np.nan
            if not (np.isfinite(table[index, column]) and table[index, column] >= 0):
                place = Finding(f"{name} is '{cell}'", str(path), line, head.index(name) + 1, "give a number from 0 up")
                raise StimulusError(place)
            if table[index, column] > _MOST:
                place = Finding(f"{name} is {cell}", str(path), line, head.index(name) + 1, f"{_MOST:g} is the most")
                raise StimulusError(place)
            if name == WAVELENGTH and index and table[index, 0] <= table[index - 1, 0]:
                raise StimulusError(
                    Finding("wavelengths do not rise", str(path), line, remedy="order the rows by them")
                )
    if len(table) < 2 or table[0, 0] > MUST_COVER_NM[0] or table[-1, 0] < MUST_COVER_NM[1]:
        over = f"{table[0, 0]:g}..{table[-1, 0]:g} nm" if len(table) else "nothing"
        raise StimulusError.at(path, f"its wavelengths run over {over}", "400..700 nm is the least")
    return table[:, 0], table[:, 1:], names
