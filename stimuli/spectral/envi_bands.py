"""Spectral pictures in ENVI files: a header that lists the wavelengths, and the data beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from documents.text import counted
from stimuli.errors import StimulusError
from stimuli.spectral.picture import Quantity, SpectralPicture

# A header of 4096 bands has some 150 kB.
_MOST_BYTES = 1_000_000
_NM = {"nanometers": 1.0, "nanometer": 1.0, "nm": 1.0, "micrometers": 1e3, "micrometer": 1e3, "microns": 1e3, "um": 1e3}


def envi_bands(path: Path, quantity: Quantity | None) -> SpectralPicture:
    """Return the spectral picture whose header is ``path``, or whose data ``path`` is; StimulusError if it is none.

    Bands that the header's bad-band list marks are left out. Its reflectance scale factor is applied.
    """
    from spectral.io import envi
    from spectral.io.spyfile import SpyFile

    header = _header(path)
    if header.stat().st_size > _MOST_BYTES:
        raise StimulusError.at(
            path, f"its header is larger than {_MOST_BYTES // 1000} kB", "leave out what is no header"
        )
    try:
        with np.errstate(all="ignore"):  # of sizes that are refused below
            data = envi.open(str(header.resolve()))
    except Exception as error:  # the library lets through what its parsing meets, of any kind
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise StimulusError.at(
            path, f"the ENVI file cannot be read: {reason}", "check its header and its data file"
        ) from error
    if not isinstance(data, SpyFile):
        raise StimulusError.at(path, "it is a library of spectra, not a picture", "give a picture")
    facts = data.metadata
    layout = str(facts["interleave"]).lower()
    if layout not in ("bsq", "bil", "bip"):
        raise StimulusError.at(path, f"its interleave is '{layout}'", "write bsq, bil or bip")
    if min(data.nrows, data.ncols, data.nbands) < 1 or data.offset < 0:
        raise StimulusError.at(
            path, f"it has {data.nrows} lines of {data.ncols} samples in {data.nbands} bands", "correct its header"
        )
    if not (np.isfinite(data.scale_factor) and data.scale_factor > 0):
        raise StimulusError.at(path, f"its reflectance scale factor is {data.scale_factor:g}", "correct its header")
    needed = data.nrows * data.ncols * data.nbands * data.sample_size + data.offset
    size = Path(data.filename).stat().st_size
    if size < needed:
        raise StimulusError.at(path, f"its data are cut short: {size} bytes, not {needed}", "copy it again")
    if np.issubdtype(data.dtype, np.complexfloating):
        raise StimulusError.at(path, "its values are complex", "give radiance or reflectance")
    waves = _wavelengths(facts, data.nbands, path)
    good = _good(facts, data.nbands, path)
    scaled = "reflectance scale factor" in facts
    if quantity is None and not scaled:
        raise StimulusError.at(path, "its header does not declare radiance or reflectance", "give the quantity")
    notes = () if good.all() else (f"{int((~good).sum())} bands marked bad in the header were left out",)
    return SpectralPicture(
        path=path,
        wavelengths_nm=waves[good],
        height_px=data.nrows,
        width_px=data.ncols,
        quantity=quantity or "reflectance",
        read_rows=_Rows(data, np.flatnonzero(good), _ignored(facts, path), path),
        notes=notes,
    )


class _Rows:
    """Reads rows of the good bands; the file is mapped only meanwhile, so that what was read leaves memory again."""

    def __init__(self, data: Any, bands: NDArray[np.intp], ignored: float | None, path: Path) -> None:
        rows, columns, every = data.shape
        # How the file is laid out, and how its axes become rows, columns, bands.
        self._shape, self._axes, self._rows_axis = {
            "bsq": ((every, rows, columns), (1, 2, 0), 1),
            "bil": ((rows, every, columns), (0, 2, 1), 0),
            "bip": ((rows, columns, every), (0, 1, 2), 0),
        }[str(data.metadata["interleave"]).lower()]
        self._file, self._dtype, self._offset = Path(data.filename), data.dtype, data.offset
        self._scale = data.scale_factor
        self._bands, self._ignored, self._path = bands, ignored, path

    def __call__(self, first: int, last: int) -> NDArray[np.float32]:
        try:
            mapped = np.memmap(self._file, dtype=self._dtype, mode="r", offset=self._offset, shape=self._shape)
        except (OSError, ValueError) as error:
            raise StimulusError.at(self._path, f"its data cannot be read: {error}", "copy it again") from error
        part = mapped[:, first:last] if self._rows_axis else mapped[first:last]
        read = np.array(part.transpose(self._axes)[..., self._bands])
        if self._ignored is not None:
            missing = int((read == self._ignored).any(axis=-1).sum())
            if missing:
                raise StimulusError.at(
                    self._path,
                    f"in rows {first}..{last - 1}, {counted(missing, 'pixel holds', 'pixels hold')} no data",
                    "crop it",
                )
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # the rows report what is not finite
            return (read / self._scale).astype(np.float32) if self._scale != 1 else read.astype(np.float32)


def _header(path: Path) -> Path:
    """Return the header of ``path``, which is one or has one beside it."""
    for header in (path, path.with_suffix(".hdr"), path.with_name(path.name + ".hdr")):
        if header.suffix.lower() == ".hdr" and header.is_file():
            return header
    if path.is_file():
        raise StimulusError.at(
            path, "this is neither OpenEXR nor ENVI data with a header beside it", "give one of them"
        )
    raise StimulusError.at(path, "there is no such file", "check the path")


def _wavelengths(header: Any, bands: int, path: Path) -> NDArray[np.float64]:
    if "wavelength" not in header:
        raise StimulusError.at(path, "its header lists no wavelengths", "add 'wavelength = { … }'")
    unit = str(header.get("wavelength units", "")).strip().lower()
    if unit not in _NM:
        raise StimulusError.at(
            path, f"the unit of its wavelengths is '{unit}'", "write 'wavelength units = Nanometers'"
        )
    try:
        waves = np.array([float(value) for value in header["wavelength"]]) * _NM[unit]
    except (TypeError, ValueError) as error:
        raise StimulusError.at(path, f"its wavelengths are no numbers: {error}", "correct its header") from error
    if len(waves) != bands:
        raise StimulusError.at(
            path, f"its header lists {len(waves)} wavelengths for {bands} bands", "correct its header"
        )
    return waves


def _good(header: Any, bands: int, path: Path) -> NDArray[np.bool_]:
    marks = header.get("bbl")
    if marks is None:
        return np.ones(bands, dtype=bool)
    try:
        good = np.array([float(mark) > 0 for mark in marks])
    except (TypeError, ValueError) as error:
        raise StimulusError.at(path, f"its bad-band list holds no numbers: {error}", "correct its header") from error
    if len(good) != bands:
        raise StimulusError.at(path, f"its bad-band list marks {len(good)} of {bands} bands", "correct its header")
    return good


def _ignored(header: Any, path: Path) -> float | None:
    value = header.get("data ignore value")
    try:
        return None if value is None else float(value)
    except (TypeError, ValueError) as error:
        raise StimulusError.at(path, f"its data ignore value is '{value}'", "correct its header") from error
