"""Spectral pictures on disk: OpenEXR with one channel per wavelength, and ENVI files.

In OpenEXR two ways of naming are read: the layout of Fichet, Pacanowski and Wilkie, ``S0.550,0nm`` for radiance and
``T.550,0nm`` for reflectance with a comma for the decimal point [Fichet2021], and plain ``550nm``. An ENVI picture is a
header that lists the wavelengths, and the data beside it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from documents.files import looked_for
from documents.text import counted, visible
from stimuli.errors import StimulusError
from stimuli.pictures.exr_header import refuse_other_than_a_view
from stimuli.pictures.picture_input import (
    MAX_SPECTRAL_BYTES,
    opened,
    reason,
    refuse_no_picture,
    refuse_undecoded,
    text_of,
)
from stimuli.spectral.options import Quantity
from stimuli.spectral.picture import SpectralPicture

if TYPE_CHECKING:
    import OpenImageIO

_CHANNEL = re.compile(
    r"(?:(?P<kind>S[0-3]|T)\.)?(?P<value>\d+(?:[.,]\d+)?(?:[eE][+-]?\d{1,3})?)(?P<unit>nm|um|µm|m)", re.ASCII
)
_BISPECTRAL = re.compile(r"T\.[^.]+m\.[^.]+m")
_NM = {"nm": 1.0, "um": 1e3, "µm": 1e3, "m": 1e9}


def exr_bands(path: Path, quantity: Quantity | None) -> SpectralPicture:
    """Return the spectral picture in the OpenEXR file at ``path``; StimulusError if it holds none."""
    with _opened_exr(path) as picture:
        spec = picture.spec()
        if spec.deep or (spec.x, spec.y, spec.width, spec.height) != (
            spec.full_x,
            spec.full_y,
            spec.full_width,
            spec.full_height,
        ):
            raise StimulusError.at(
                path, "the picture is deep, or its data window is not its display window", "flatten, crop it"
            )
        refuse_other_than_a_view(spec, path)
        kinds: dict[str, dict[int, float]] = {}
        for index, name in enumerate(spec.channelnames):
            if _BISPECTRAL.fullmatch(name):
                raise StimulusError.at(
                    path, f"the channel {name} is bispectral", "fluorescence is not read; render radiance"
                )
            if match := _CHANNEL.fullmatch(name):
                nm = round(float(match["value"].replace(",", ".")) * _NM[match["unit"]], 6)
                kinds.setdefault(match["kind"] or "", {})[index] = nm
        kind, channels = _chosen(kinds, quantity, path, spec.channelnames)
        order = sorted(channels, key=lambda index: channels[index])
        notes = [f"the Stokes components {name} were left out" for name in ("S1", "S2", "S3") if name in kinds]
        units = spec.getattribute("emissiveUnits")
        if _quantity(kind, quantity) == "radiance" and isinstance(units, str):
            notes.append(f"the file declares its radiance in {visible(units)[:60]}")
        return SpectralPicture(
            path=path,
            wavelengths_nm=np.array([channels[index] for index in order]),
            height_px=spec.height,
            width_px=spec.width,
            quantity=_quantity(kind, quantity) or "radiance",
            read_rows=_Rows(path, order, spec.y),
            chunk_rows=spec.tile_height or 32,
            notes=tuple(notes),
        )


def _quantity(kind: str, given: Quantity | None) -> Quantity | None:
    """Return what channels of that kind hold."""
    quantities: dict[str, Quantity] = {"S0": "radiance", "T": "reflectance"}
    return quantities.get(kind, given)


def _chosen(
    kinds: dict[str, dict[int, float]], quantity: Quantity | None, path: Path, channels: tuple[str, ...]
) -> tuple[str, dict[int, float]]:
    wanted = {"radiance": ("S0", ""), "reflectance": ("T", ""), None: ("S0", "T", "")}[quantity]
    there = [kind for kind in wanted if kind in kinds]
    if not there:
        listed = ", ".join(channels[:5]) + (", …" if len(channels) > 5 else "")
        sought = {
            "radiance": "S0.550nm or 550nm",
            "reflectance": "T.550nm or 550nm",
            None: "S0.550nm, T.550nm or 550nm",
        }
        raise StimulusError.at(path, f"no channel is named like {sought[quantity]}; there are {listed}", "name them so")
    if len(there) > 1 and quantity is None:
        raise StimulusError.at(
            path, f"it holds {' and '.join(kind or 'plain' for kind in there)} channels", "give the quantity to take"
        )
    if not there[0] and quantity is None:
        raise StimulusError.at(path, "its channels do not declare radiance or reflectance", "give the quantity")
    return there[0], kinds[there[0]]


class _Rows:
    """Reads rows of the named channels; the file is open only meanwhile."""

    def __init__(self, path: Path, order: list[int], first_row: int) -> None:
        self._path, self._order, self._first = path, order, first_row

    def __call__(self, first: int, last: int) -> NDArray[np.float32]:
        with _opened_exr(self._path) as picture:
            spec = picture.spec()
            low, high = min(self._order), max(self._order) + 1
            top, bottom = self._first + first, self._first + last
            read: NDArray[Any] | None
            if spec.tile_width:
                bottom = min(bottom, spec.y + spec.height)
                columns = spec.x, spec.x + spec.width
                read = picture.read_tiles(0, 0, *columns, top, bottom, 0, 1, low, high, "float")
            else:
                read = picture.read_scanlines(0, 0, top, bottom, 0, low, high, "float")
            if read is None:
                problem = reason(text_of(picture.geterror))
                refuse_undecoded(self._path, f"it is cut short or damaged: {problem}", "copy it again")
            taken: NDArray[np.float32] = read[..., [index - low for index in self._order]]
            return taken


@contextmanager
def _opened_exr(path: Path) -> Iterator[OpenImageIO.ImageInput]:
    """Yield the open OpenEXR file at ``path``; StimulusError if it is another kind of picture, or none."""
    with opened(path) as picture:
        if picture.format_name() != "openexr":
            what = f"the picture is {picture.format_name()}, not OpenEXR"
            raise StimulusError.at(path, what, "give OpenEXR or ENVI")
        yield picture


# A header of 4096 bands has some 150 kB.
_MOST_BYTES = 1_000_000
_ENVI_NM = {
    "nanometers": 1.0,
    "nanometer": 1.0,
    "nm": 1.0,
    "micrometers": 1e3,
    "micrometer": 1e3,
    "microns": 1e3,
    "um": 1e3,
}


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
        read_rows=_EnviRows(data, np.flatnonzero(good), _ignored(facts, path), path),
        notes=notes,
    )


class _EnviRows:
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
            refuse_undecoded(self._path, f"its data cannot be read: {error}", "copy it again", error)
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
    raise StimulusError.at(path, "there is no such file", looked_for(path))


def _wavelengths(header: Any, bands: int, path: Path) -> NDArray[np.float64]:
    if "wavelength" not in header:
        raise StimulusError.at(path, "its header lists no wavelengths", "add 'wavelength = { … }'")
    unit = str(header.get("wavelength units", "")).strip().lower()
    if unit not in _ENVI_NM:
        raise StimulusError.at(
            path, f"the unit of its wavelengths is '{unit}'", "write 'wavelength units = Nanometers'"
        )
    try:
        waves = np.array([float(value) for value in header["wavelength"]]) * _ENVI_NM[unit]
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


def read_spectral(path: Path, quantity: Quantity | None = None) -> SpectralPicture:
    """Return the spectral picture at ``path``; only its header is read.

    Parameters
    ----------
    path
        OpenEXR (.exr) with a channel for each wavelength, or ENVI (.hdr, or the data beside it).
    quantity
        ``radiance`` in W/(sr m² nm) or ``reflectance``, where the file does not declare it.

    Returns
    -------
    SpectralPicture
        Size and wavelengths in nm; the values come with `SpectralPicture.blocks`.

    Raises
    ------
    StimulusError
        If the file is missing or neither; if its bands do not rise, leave out a part of 400..700 nm, or are more than
        20 nm apart; if the quantity is not known. The finding names file and reason.
    """
    from stimuli.spectral.bands import envi_bands, exr_bands

    path = Path(path)
    if path.suffix.lower() != ".hdr" or path.exists():
        refuse_no_picture(path, "file", MAX_SPECTRAL_BYTES)
    return (exr_bands if path.suffix.lower() == ".exr" else envi_bands)(path, quantity)
