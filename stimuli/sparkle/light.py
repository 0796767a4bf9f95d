"""The light that reaches the camera: a few maps of luminance, each with one colour, and a spectrum if it has one.

A plate's light is a sum of such terms: the base under each lamp, its flop, and the sparkles. So XYZ and any number of
spectral bands follow from few maps, and none is computed before it is asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.colour.spaces import XYZ_from_xyY
from stimuli.errors import StimulusError
from stimuli.pictures.resample import area_weights, resample
from stimuli.sparkle.scene import Lamp, Row, Spectrum
from stimuli.sparkle.spectrum import XYZ_of

Map = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Colour:
    """The XYZ of light with Y = 1; its ``spectrum`` in W/(sr m² nm) per cd/m², None where only XYZ is known."""

    XYZ: Row
    spectrum: Spectrum | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Term:
    """Luminance in cd/m², one number for all pixels or (rows, columns) of them, in one colour."""

    luminance_cd_m2: Map | float
    colour: Colour


@dataclass(frozen=True, eq=False, slots=True)
class Light:
    """The light of a plate of ``size_mm`` (width, height) in camera pixels, and the work that it took, by name."""

    terms: tuple[Term, ...]
    grid_px: tuple[int, int]
    size_mm: tuple[float, float]
    counts: Mapping[str, int] = field(default_factory=dict)

    def spectral(self, pixel_pitch_mm: float) -> NDArray[np.float64]:
        """Return spectral radiance in W/(sr m² nm), (rows, columns, 81), on a display's grid of ``pixel_pitch_mm``.

        Each map is resampled once, whatever the number of bands.

        Raises
        ------
        StimulusError
            If a lamp, the base or the flakes are given as a chromaticity.
        """
        columns_px, rows_px = self.grid_px
        columns = area_weights(columns_px, self.size_mm[0], pixel_pitch_mm)
        rows = area_weights(rows_px, self.size_mm[1], pixel_pitch_mm)
        maps, spectra = [], []
        for term in self.terms:
            if term.colour.spectrum is None:
                raise StimulusError("part of the plate's light is known as a chromaticity: it has no spectrum")
            full = np.broadcast_to(np.asarray(term.luminance_cd_m2, dtype=np.float32), (rows_px, columns_px))
            maps.append(resample(full, rows, columns))
            spectra.append(term.colour.spectrum)
        if not maps:
            return np.zeros((rows.shape[0], columns.shape[0], 81))
        return np.tensordot(np.stack(maps, axis=-1), np.array(spectra), axes=1)


def gathered(terms: Iterable[Term]) -> tuple[Term, ...]:
    """Return terms with those of one colour added up, maps and numbers apart, and those without light left out."""
    sums: dict[tuple[Colour, bool], Map | float] = {}
    for term in terms:
        key = (term.colour, isinstance(term.luminance_cd_m2, float))
        if isinstance(term.luminance_cd_m2, float) and term.luminance_cd_m2 == 0:
            continue
        sums[key] = sums[key] + term.luminance_cd_m2 if key in sums else term.luminance_cd_m2
    return tuple(Term(luminance, colour) for (colour, _), luminance in sums.items())


def colour_under(
    lamp: Lamp, chromaticity_xy: tuple[float, float] | None, spectrum: Spectrum | None
) -> tuple[float, Colour]:
    """Return what share of the lamp's luminance a material sends back, and in which colour.

    ``spectrum`` is the material's reflectance on the grid. Without one its light has ``chromaticity_xy``, else the
    lamp's, and all of its luminance.

    Raises
    ------
    StimulusError
        If the material has a spectrum and the lamp has none.
    """
    if spectrum is not None:
        if lamp.spectrum is None:
            raise StimulusError("a reflectance spectrum needs lamps with a spectrum or a temperature")
        emitted = np.array(lamp.spectrum)
        sent = XYZ_of(tuple((emitted * spectrum).tolist()))
        share = float(sent[1] / XYZ_of(lamp.spectrum)[1])
        if share == 0:
            return 0.0, Colour((0.0, 1.0, 0.0))
        per_cd = tuple((emitted * spectrum / sent[1]).tolist())
        return share, Colour((float(sent[0] / sent[1]), 1.0, float(sent[2] / sent[1])), per_cd)
    x, y, z = XYZ_from_xyY([*(chromaticity_xy or lamp.chromaticity_xy), 1.0]).tolist()
    own = None
    if chromaticity_xy is None and lamp.spectrum is not None:
        own = tuple((np.array(lamp.spectrum) / XYZ_of(lamp.spectrum)[1]).tolist())
    return 1.0, Colour((x, y, z), own)
