"""Spectral pictures in OpenEXR: one channel per wavelength.

Two ways of naming are read: the layout of Fichet, Pacanowski and Wilkie, ``S0.550,0nm`` for radiance and ``T.550,0nm``
for reflectance with a comma for the decimal point [Fichet2021], and plain ``550nm``.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from documents.text import visible
from stimuli.errors import StimulusError
from stimuli.pictures.picture_input import opened
from stimuli.spectral.picture import Quantity, SpectralPicture

if TYPE_CHECKING:
    import OpenImageIO

_CHANNEL = re.compile(
    r"(?:(?P<kind>S[0-3]|T)\.)?(?P<value>\d+(?:[.,]\d+)?(?:[eE][+-]?\d{1,3})?)(?P<unit>nm|um|µm|m)", re.ASCII
)
_BISPECTRAL = re.compile(r"T\.[^.]+m\.[^.]+m")
_NM = {"nm": 1.0, "um": 1e3, "µm": 1e3, "m": 1e9}


def exr_bands(path: Path, quantity: Quantity | None) -> SpectralPicture:
    """Return the spectral picture in the OpenEXR file at ``path``; StimulusError if it holds none."""
    picture = _open(path)
    try:
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
    finally:
        picture.close()


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
        picture = _open(self._path)
        try:
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
                reason = picture.geterror().strip().splitlines()
                raise StimulusError.at(
                    self._path, f"it is cut short or damaged: {reason[-1] if reason else ''}", "copy it again"
                )
            taken: NDArray[np.float32] = read[..., [index - low for index in self._order]]
            return taken
        finally:
            picture.close()


def _open(path: Path) -> OpenImageIO.ImageInput:

    picture = opened(path)
    if picture.format_name() != "openexr":
        picture.close()
        raise StimulusError.at(path, f"the picture is {picture.format_name()}, not OpenEXR", "give OpenEXR or ENVI")
    return picture
