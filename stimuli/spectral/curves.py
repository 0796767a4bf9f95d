"""Curves over wavelength: the spectrum of a light, and the sensitivities of a sensor."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from documents import Finding
from documents.arrays import Floats
from documents.tables import ENDINGS, Cells, ColumnSpec, Form
from stimuli.errors import StimulusError
from stimuli.spectral.picture import MUST_COVER_NM

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
    waves, curves, _ = _read(path, SENSITIVITY)
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
    if Path(name).suffix.lower() in ENDINGS:
        waves, values, _ = _read(Path(name), ("value",))
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
    waves, values, names = _read(path)
    return waves, {name: values[:, index] for index, name in enumerate(names)}


def _read(path: Path, names: tuple[str, ...] = ()) -> tuple[Floats, Floats, tuple[str, ...]]:
    """Return the rising wavelengths, the values (n, names), nowhere negative, and the names; all others without any."""
    columns = tuple(ColumnSpec(name, least=0.0, most=_MOST) for name in names)
    others = None if names else ColumnSpec("", least=0.0, most=_MOST)
    wavelength = ColumnSpec(WAVELENGTH, least=0.0, most=_MOST)
    table = Form((wavelength, *columns), "table", StimulusError, _MOST_BYTES, others=others).read(path, _falling)
    names = names or tuple(name for name in table.places if name != WAVELENGTH)
    if not names:
        raise StimulusError.at(path, "the header has no reflectance", f"columns: {WAVELENGTH},reflectance")
    waves = table.numbers(WAVELENGTH)
    if len(table) < 2 or waves[0] > MUST_COVER_NM[0] or waves[-1] < MUST_COVER_NM[1]:
        over = f"{waves[0]:g}..{waves[-1]:g} nm"
        raise StimulusError.at(path, f"its wavelengths run over {over}", "400..700 nm is the least")
    return waves, np.stack([table.numbers(name) for name in names], axis=1), names


def _falling(table: Cells) -> Iterator[Finding]:
    """Yield the first row whose wavelength is not above that before it."""
    for row in (np.flatnonzero(np.diff(table.numbers(WAVELENGTH)) <= 0) + 1)[:1].tolist():
        yield table.fault(row, None, "wavelengths do not rise", "order the rows by them")
