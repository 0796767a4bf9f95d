"""The light that reaches the camera: a few maps of luminance, each with one colour, and a spectrum if it has one.

A plate's light is a sum of such terms: the base under each lamp, matt or shining and darker with the angle (flop), and
the sparkles. So XYZ and any number of spectral bands follow from few maps, and none is computed before it is asked for.
Spectra of lamps and reflectances lie on the CIE's grid of 5 nm. Maps are in cd/m² as a meter reads them, and so is the
illuminance of lamps in lx: by the luminous efficiency of CIE 1931 2°. So the light of a scene with spectra is the same
whoever looks, and its XYZ are those of the photographs' observer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.colour import XYZ_from_xyY, xyY_from_XYZ
from devices.colour_matching import DEFAULT_OBSERVER
from documents.arrays import Floats
from extensions.sparkle.lamplight import illuminance_lx
from extensions.sparkle.optics import mirror
from extensions.sparkle.scene import Camera, Lamp, Plate, Row, Spectrum, wavelengths_nm
from stimuli.errors import StimulusError
from stimuli.pictures import resample_maps

Map = NDArray[np.float32]


# Places along an axis at which a field is computed at least, and how many per stretch over which it changes.
_LEAST_NODES = 17
_NODES_PER_STRETCH = 6


@dataclass(frozen=True, slots=True)
class Colour:
    """The XYZ of light of 1 cd/m², and its ``spectrum`` in W/(sr m² nm) per cd/m², None where only XYZ is known.

    XYZ are those of an observer. Y is 1 for CIE 1931 2° and where no spectrum is known.
    """

    XYZ: Row
    spectrum: Spectrum | None = None


@dataclass(frozen=True, eq=False, slots=True)
class LightTerm:
    """Luminance in cd/m², one number for all pixels or (rows, columns) of them, in one colour."""

    luminance_cd_m2: Map | float
    colour: Colour


@dataclass(frozen=True, eq=False, slots=True)
class PlateLight:
    """The light of a plate of ``size_mm`` (width, height) in camera pixels, and the work that it took, by name."""

    terms: tuple[LightTerm, ...]
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
        dark = LightTerm(0.0, Colour((0.0, 0.0, 0.0), (0.0,) * 81))
        maps, spectra = [], []
        for term in self.terms or (dark,):
            if term.colour.spectrum is None:
                raise StimulusError("part of the plate's light is known as a chromaticity: it has no spectrum")
            maps.append(np.broadcast_to(np.asarray(term.luminance_cd_m2, dtype=np.float32), (rows_px, columns_px)))
            spectra.append(term.colour.spectrum)
        return np.tensordot(resample_maps(maps, self.size_mm, pixel_pitch_mm), np.array(spectra), axes=1)


def gathered(terms: Iterable[LightTerm]) -> tuple[LightTerm, ...]:
    """Return terms with those of one colour added up, maps and numbers apart, and those without light left out."""
    sums: dict[tuple[Colour, bool], Map | float] = {}
    for term in terms:
        key = (term.colour, isinstance(term.luminance_cd_m2, float))
        if isinstance(term.luminance_cd_m2, float) and term.luminance_cd_m2 == 0:
            continue
        sums[key] = sums[key] + term.luminance_cd_m2 if key in sums else term.luminance_cd_m2
    return tuple(LightTerm(luminance, colour) for (colour, _), luminance in sums.items())


def colour_under(
    lamp: Lamp,
    chromaticity_xy: tuple[float, float] | None,
    spectrum: Spectrum | None,
    observer: str = DEFAULT_OBSERVER,
) -> tuple[float, Colour]:
    """Return the share of the lamp's luminance that a material reflects, and its colour.

    ``spectrum`` is the material's reflectance on the grid. Without one its light has ``chromaticity_xy``, else the
    lamp's, and all of its luminance. XYZ are those of the ``observer``.

    Raises
    ------
    StimulusError
        If the material has a spectrum and the lamp has none.
    """
    own = lamp.emitted
    if spectrum is not None:
        if own is None:
            raise StimulusError("a reflectance spectrum needs lamps with a spectrum or a temperature")
        emitted = np.array(own)
        sent = XYZ_of(tuple((emitted * spectrum).tolist()))
        share = float(sent[1] / XYZ_of(own)[1])
        if share == 0:
            return 0.0, Colour((0.0, 1.0, 0.0))
        per_cd = tuple((emitted * spectrum / sent[1]).tolist())
        x, y, z = (XYZ_of(tuple((emitted * spectrum).tolist()), observer) / sent[1]).tolist()
        return share, Colour((x, y, z), per_cd)
    # What a meter reads as 1 cd/m² of the lamp's light, as bright as the observer sees it.
    bright = 1.0 if own is None else XYZ_of(own, observer)[1] / XYZ_of(own)[1]
    x, y, z = XYZ_from_xyY([*(chromaticity_xy or _chromaticity_of(lamp, observer)), bright]).tolist()
    if chromaticity_xy is not None or own is None:
        return 1.0, Colour((x, y, z))
    return 1.0, Colour((x, y, z), tuple((np.array(own) / XYZ_of(own)[1]).tolist()))


def _chromaticity_of(lamp: Lamp, observer: str) -> tuple[float, float]:
    if lamp.emitted is None:
        return lamp.chromaticity_xy or (0.0, 0.0)
    x, y, _ = xyY_from_XYZ(XYZ_of(lamp.emitted, observer)).tolist()
    return x, y


def XYZ_of(spectrum: Spectrum, observer: str = DEFAULT_OBSERVER) -> Floats:
    """Return XYZ (3,) in cd/m², for an observer, of a spectral radiance in W/(sr m² nm) on the grid."""
    from devices.readings import xyz_from_spectra

    return np.asarray(xyz_from_spectra(np.array(spectrum), wavelengths_nm(), observer)[0])


def matt_luminance(plate: Plate, lamp: Lamp, camera: Camera) -> NDArray[np.float32] | float:
    """Return the matt base's luminance, reflectance · E/π: one number if the lamp is far, else (rows, columns)."""
    if lamp.distance_mm is None or plate.base_reflectance == 0:
        return plate.base_reflectance * lamp.illuminance_lx / np.pi

    def luminance(x_mm: Floats, y_mm: Floats) -> Floats:
        return np.asarray(plate.base_reflectance / np.pi * illuminance_lx(lamp, x_mm, y_mm))

    return over_pixels(luminance, plate, lamp, camera, 1.0)


def flop_luminance(plate: Plate, lamp: Lamp, camera: Camera, eye_mm: Floats) -> NDArray[np.float32] | float:
    """Return the luminance (rows, columns) of what shines in the base, as the eye at ``eye_mm`` sees it.

    Flakes too fine to be seen one by one are one mirror that lies flat: their tilts widen its lobe.
    """
    if plate.flop_reflectance == 0:
        return 0.0
    sd = float(np.radians(plate.flop_lobe_sd_deg))

    def luminance(x_mm: Floats, y_mm: Floats) -> Floats:
        flat = np.array([0.0, 0.0, 1.0])
        return mirror((x_mm, y_mm), flat, plate.flop_reflectance, sd, plate, lamp, eye_mm).luminance_cd_m2

    return over_pixels(luminance, plate, lamp, camera, sd)


def over_pixels(
    luminance: Callable[[Floats, Floats], Floats], plate: Plate, lamp: Lamp, camera: Camera, turn_rad: float
) -> NDArray[np.float32]:
    """Return a smooth ``luminance(x_mm, y_mm)`` at each camera pixel's middle, float32 (rows, columns).

    It is computed at a few places and interpolated by cubic splines, unless these places are more than the pixels. It
    changes over stretches that turn the direction to eye or lamp by ``turn_rad``, or leave the lamp's beam.
    """
    from scipy.interpolate import RectBivariateSpline

    turn = min(turn_rad, 0.5)
    per_mm = 1.0 / camera.distance_mm
    position = lamp.position_mm
    if position is not None:
        per_mm += 1.0 / position[2]
        if lamp.beam_angle_deg is not None:
            turn = min(turn, np.radians(lamp.beam_angle_deg / 2))
    columns, rows = camera.grid_px(plate)
    across = ((np.arange(columns) + 0.5) / columns - 0.5) * plate.width_mm
    up = (0.5 - (np.arange(rows) + 0.5) / rows) * plate.height_mm
    nodes_x, nodes_y = (
        max(_LEAST_NODES, int(np.ceil(_NODES_PER_STRETCH * size * per_mm / turn)))
        for size in (plate.width_mm, plate.height_mm)
    )
    if nodes_x * nodes_y >= columns * rows:
        sampled = np.stack([luminance(across, np.full_like(across, height)) for height in up])
    else:
        x = np.linspace(-0.5, 0.5, nodes_x) * plate.width_mm
        y = np.linspace(-0.5, 0.5, nodes_y) * plate.height_mm
        grid = np.meshgrid(x, y)
        known = luminance(grid[0].ravel(), grid[1].ravel()).reshape(grid[0].shape)
        sampled = np.asarray(RectBivariateSpline(y, x, known)(up[::-1], across))[::-1]
    return np.maximum(sampled, 0.0).astype(np.float32)
