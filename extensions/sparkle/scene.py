"""The scene: plate, lamps and camera.

Millimetres; x to the right, y up, z from the plate's surface towards the camera; the origin is the plate's middle.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from documents.arrays import Floats
from documents.yaml import FileModel, NotNegative, Number, Positive
from stimuli.recipes import Chromaticity

Row = tuple[float, float, float]
Spectrum = tuple[float, ...]
FIRST_NM, LAST_NM, STEP_NM = 380, 780, 5
# Planck's second constant, in nm · K (CODATA 2018; exact since 2019).
_SECOND_CONSTANT_NM_K = 1.438776877e7


Share = Annotated[float, Field(ge=0, le=1)]
_Triple = tuple[Number, Number, Number]


class SpectrumSpec(FileModel):
    """Values at rising wavelengths: straight lines between, the first and the last value beyond."""

    nm: Annotated[tuple[Positive, ...], Field(min_length=2, max_length=1000)]
    """Wavelengths in nm, rising."""
    values: tuple[NotNegative, ...]
    """The value at each wavelength."""

    @model_validator(mode="after")
    def _pairs(self) -> SpectrumSpec:
        if len(self.nm) != len(self.values):
            raise ValueError(f"there are {len(self.nm)} wavelengths and {len(self.values)} values")
        if any(later <= earlier for earlier, later in pairwise(self.nm)):
            raise ValueError("wavelengths must rise")
        if max(self.values) == 0:
            raise ValueError("a spectrum needs a value above 0")
        return self

    def on_grid(self) -> Spectrum:
        """Return the values on the grid of 5 nm: straight lines between, the first and last value beyond."""
        return tuple(np.interp(wavelengths_nm(), self.nm, self.values).tolist())


class Clusters(FileModel):
    """Conglomerates: the share of flakes in them, how many each holds, how wide it is, how far it tilts as a whole.

    Coarse droplets of paint leave them. Each holds ``flakes`` on average, spread about its middle as a Gaussian of
    ``radius_mm``. Its flakes' slopes stray from the plate's normal together, and from there each by its own.
    """

    share: Share
    """The share of flakes that lie in clusters."""
    flakes: Annotated[float, Field(ge=1, le=1e6)]
    """How many flakes a cluster holds."""
    radius_mm: Annotated[float, Field(gt=0, le=100)]
    """How wide a cluster is, in mm."""
    tilt_sd_deg: Annotated[float, Field(ge=0, le=60)] = 0.0
    """How far clusters tilt as a whole: a standard deviation in degrees."""


@dataclass(frozen=True, slots=True)
class Plate:
    """A painted plate. Flake diameters are lognormal between two bounds, flake slopes Gaussian about the normal.

    ``flake_diameter_spread`` is the standard deviation of ln(diameter); ``tilt_sd_deg`` that of each slope's angle;
    ``lobe_sd_deg`` is how far a flake's own surface strays from its mean normal. ``diffraction_nm`` is the
    wavelength at which flakes widen their lobe, the smaller the more; None where they do not. Within
    ``flake_rim_um`` of its edge a flake is no mirror. ``coat_extinction_per_mm`` dims deep flakes. With ``clusters``
    some flakes lie together; else each lies anywhere.

    ``base_reflectance`` is that of what lies between the flakes, taken as matt. ``flop_reflectance`` is that of what
    shines in it, such as flakes too fine to be seen: a lobe of ``flop_lobe_sd_deg`` about the plate's normal.

    ``flake_chromaticity_xy`` is that of the lamp's light once it has gone through the coat to a flake and back; None
    if the coat is colourless, so that it is the lamp's own. ``base_chromaticity_xy`` is that of the base's light, and
    None where ``base_spectrum`` gives it. Spectra multiply the reflectance, on the grid of `extensions.sparkle.light`.
    """

    width_mm: float
    height_mm: float
    flakes_per_mm2: float
    flake_diameter_median_um: float
    flake_diameter_spread: float
    flake_diameter_min_um: float
    flake_diameter_max_um: float
    flake_depth_max_um: float
    flake_reflectance: float
    tilt_sd_deg: float
    lobe_sd_deg: float
    coat_refractive_index: float
    base_reflectance: float
    base_chromaticity_xy: tuple[float, float] | None
    flake_chromaticity_xy: tuple[float, float] | None = None
    diffraction_nm: float | None = None
    flake_rim_um: float = 0.0
    coat_extinction_per_mm: float = 0.0
    flop_reflectance: float = 0.0
    flop_lobe_sd_deg: float = 12.0
    flop_chromaticity_xy: tuple[float, float] | None = None
    base_spectrum: Spectrum | None = None
    flake_spectrum: Spectrum | None = None
    clusters: Clusters | None = None


class Lamp(FileModel):
    """A lamp; its zenith angle is from the plate's normal, its azimuth from the right, 90 being above.

    With ``distance_mm`` from the plate's middle it is near, and may have a beam. Its light is a chromaticity, a black
    body's at ``temperature_K``, or a ``spectrum``. The illuminance is what a meter reads in the plate's middle, where
    a beam is aimed; it is half as strong at half of ``beam_angle_deg`` from its axis. The light of a near lamp, its
    direction and its size change over the plate.
    """

    illuminance_lx: NotNegative
    """The illuminance on the plate, in lx."""
    chromaticity_xy: Chromaticity | None = None
    """The chromaticity x, y of the light."""
    temperature_K: Annotated[float, Field(ge=1000, le=25000)] | None = None
    """The temperature of a black body of the lamp's colour, in K."""
    spectrum: SpectrumSpec | None = None
    """The lamp's spectrum."""
    zenith_deg: Annotated[float, Field(ge=0, lt=90)]
    """The lamp's angle from the plate's normal, in degrees."""
    azimuth_deg: Number = 90.0
    """The lamp's direction about the normal, in degrees from the right; 90 is above."""
    angular_radius_deg: Annotated[float, Field(ge=0, le=20)]
    """The lamp's radius as seen from the plate, in degrees."""
    distance_mm: Annotated[Positive, Field(ge=10)] | None = None
    """The lamp's distance from the plate's middle, in mm; left out, it is far."""
    beam_angle_deg: Annotated[float, Field(ge=5, le=170)] | None = None
    """The angle of the lamp's beam, in degrees."""

    @model_validator(mode="after")
    def _one_light(self) -> Lamp:
        if sum(value is not None for value in (self.chromaticity_xy, self.temperature_K, self.spectrum)) != 1:
            raise ValueError("a lamp has a chromaticity_xy, a temperature_K or a spectrum, one of the three")
        if self.beam_angle_deg is not None and self.distance_mm is None:
            raise ValueError("a beam needs the lamp's distance_mm: a far lamp lights the plate evenly")
        return self

    @property
    def is_spectral(self) -> bool:
        """Whether the lamp's spectrum is known."""
        return self.chromaticity_xy is None

    @property
    def emitted(self) -> Spectrum | None:
        """Its relative spectrum on the grid of `wavelengths_nm`; None where only its chromaticity is known."""
        if self.chromaticity_xy is not None:
            return None
        return self.spectrum.on_grid() if self.spectrum else planck(self.temperature_K or 0.0)

    @property
    def direction(self) -> Floats:
        """Unit vector (3,) from the plate's middle to the lamp."""
        zenith, azimuth = np.radians(self.zenith_deg), np.radians(self.azimuth_deg)
        return np.array([np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)])

    @property
    def position_mm(self) -> Floats | None:
        """Where the lamp stands, (3,); None if it is far."""
        return None if self.distance_mm is None else self.distance_mm * self.direction


class Noise(FileModel):
    """The sensor's noise: electrons in a full channel, at the sensitivity used, and electrons of read noise."""

    full_well_electrons: Annotated[float, Field(ge=10, le=1e7)]
    """Electrons in a full channel."""
    read_noise_electrons: NotNegative
    """Electrons of read noise."""


class Camera(FileModel):
    """The camera, moved sideways between the views. ``pupil_mm`` adds the spread of an eye's optics, 2 to 6 mm.

    Its frustum is off axis: there is no parallax at the plate's surface. ``point_spread_sd_px`` is that of a Gaussian;
    ``full_well_cd_s_m2`` is the luminance times exposure of a pixel whose channels are all full.
    """

    distance_mm: Positive
    """The camera's distance from the plate, in mm."""
    interpupillary_distance_mm: NotNegative
    """How far the camera moves sideways between the views, in mm."""
    resolution_px_per_mm: Positive
    """How many pixels there are to a mm of the plate."""
    point_spread_sd_px: Annotated[float, Field(gt=0, le=20)]
    """The standard deviation of the lens's blur, in pixels."""
    full_well_cd_s_m2: Positive
    """The light that fills the sensor, in cd·s/m²."""
    raw_from_XYZ: tuple[_Triple, _Triple, _Triple]
    """The matrix from XYZ to the sensor's channels, three rows of three."""
    pupil_mm: Annotated[float, Field(ge=2, le=6)] | None = None
    """The diameter of an eye's pupil whose optics are added, in mm."""
    noise: Noise | None = None
    """The sensor's noise; left out, there is none."""

    @model_validator(mode="after")
    def _full_is_light(self) -> Camera:
        matrix = np.array(self.raw_from_XYZ)
        if np.linalg.cond(matrix) > 1e6 or np.linalg.inv(matrix)[1].sum() <= 0:
            raise ValueError("raw_from_XYZ must be invertible, and its inverse give full channels luminance")
        return self

    def position_mm(self, eye: str) -> Floats:
        """Where the lens stands, (3,), for ``left``, ``right`` or ``center``."""
        side = {"left": -0.5, "center": 0.0, "right": 0.5}[eye]
        return np.array([side * self.interpupillary_distance_mm, 0.0, self.distance_mm])

    def grid_px(self, plate: Plate) -> tuple[int, int]:
        """Columns and rows of camera pixels that the plate covers."""
        return (
            max(1, round(plate.width_mm * self.resolution_px_per_mm)),
            max(1, round(plate.height_mm * self.resolution_px_per_mm)),
        )


def wavelengths_nm() -> Floats:
    """Return the grid, shape (81,): 380 to 780 nm.

    Returns
    -------
    numpy.ndarray
        Wavelengths in nm, 5 nm apart.

    Examples
    --------
    >>> waves = wavelengths_nm()
    >>> waves.shape, waves[:3].tolist(), float(waves[-1])
    ((81,), [380.0, 385.0, 390.0], 780.0)
    """
    return np.arange(FIRST_NM, LAST_NM + 1, STEP_NM, dtype=np.float64)


def planck(temperature_K: float) -> Spectrum:
    """Return the spectrum of a black body, relative to its value at 560 nm; halogen lamps are close to one."""
    waves = wavelengths_nm()
    exponent = _SECOND_CONSTANT_NM_K / temperature_K
    light = (560.0 / waves) ** 5 * np.expm1(exponent / 560.0) / np.expm1(exponent / waves)
    return tuple(light.tolist())
