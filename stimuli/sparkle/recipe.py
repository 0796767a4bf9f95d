"""The part of a recipe that describes a sparkling plate, its lamps and its camera."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from devices.colour_matching import DEFAULT_OBSERVER
from documents.yaml import NotNegative, Number, Positive, Strict
from stimuli.sparkle.scene import Camera, Clusters, Lamp, Noise, Plate, Spectrum


def _chromaticity(value: tuple[float, float]) -> tuple[float, float]:
    x, y = value
    if not (x >= 0 and y > 0 and x + y <= 1):
        raise ValueError("a chromaticity x, y has x ≥ 0, y > 0 and x + y ≤ 1")
    return value


# Where the eye is most sensitive.
DIFFRACTION_NM = 555.0

Share = Annotated[float, Field(ge=0, le=1)]
_Row = tuple[Number, Number, Number]
Chromaticity = Annotated[tuple[Number, Number], AfterValidator(_chromaticity)]


class SpectrumSpec(Strict):
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
        """Return the values on the grid of 5 nm."""
        from stimuli.sparkle.light import on_grid

        return on_grid(self.nm, self.values)


def _share(value: SpectrumSpec) -> SpectrumSpec:
    if max(value.values) > 1:
        raise ValueError("no reflectance is above 1")
    return value


ShareSpectrum = Annotated[SpectrumSpec, AfterValidator(_share)]


class ClustersSpec(Strict):
    """Conglomerates: the share of flakes in them, how many each holds, how wide it is, how far it tilts as a whole."""

    share: Share
    """The share of flakes that lie in clusters."""
    flakes: Annotated[float, Field(ge=1, le=1e6)]
    """How many flakes a cluster holds."""
    radius_mm: Annotated[float, Field(gt=0, le=100)]
    """How wide a cluster is, in mm."""
    tilt_sd_deg: Annotated[float, Field(ge=0, le=60)] = 0.0
    """How far clusters tilt as a whole: a standard deviation in degrees."""

    def clusters(self) -> Clusters:
        """Return the conglomerates."""
        return Clusters(self.share, self.flakes, self.radius_mm, self.tilt_sd_deg)


class FlakesSpec(Strict):
    """The flakes: how many, how large, how deep, how they tilt and how they reflect.

    Their light has ``chromaticity_xy`` in a coat that is tinted, or the ``spectrum`` of their reflectance times the
    lamp's; else the lamp's colour. ``diffraction`` widens the lobes of small flakes; within ``rim_um`` of its edge a
    flake scatters its light, which counts with the base.
    """

    per_mm2: NotNegative
    """How many flakes there are to a mm²."""
    diameter_median_um: Positive
    """The median diameter of the flakes, in µm."""
    diameter_spread: NotNegative
    """The spread of the logarithm of the diameters."""
    diameter_range_um: tuple[Positive, Positive]
    """The smallest and the largest diameter, in µm."""
    depth_max_um: NotNegative
    """How deep flakes lie at most, in µm."""
    tilt_sd_deg: Annotated[float, Field(gt=0, le=60)]
    """How far flakes tilt: a standard deviation in degrees."""
    lobe_sd_deg: Annotated[float, Field(gt=0, le=20)]
    """How wide the reflection is: a standard deviation in degrees."""
    reflectance: Share
    """The share of light that is reflected, from 0 to 1."""
    chromaticity_xy: Chromaticity | None = None
    """The chromaticity x, y of the light."""
    spectrum: ShareSpectrum | None = None
    """A spectrum in place of a chromaticity."""
    diffraction: bool = False
    """Whether diffraction widens the reflections of small flakes."""
    rim_um: NotNegative = 0.0
    """The rim of a flake that scatters its light, in µm."""
    clusters: ClustersSpec | None = None
    """Flakes that lie in clusters."""

    @model_validator(mode="after")
    def _one_colour(self) -> FlakesSpec:
        if self.chromaticity_xy and self.spectrum:
            raise ValueError("give flakes a chromaticity_xy or a spectrum, not both")
        return self

    @model_validator(mode="after")
    def _range_holds_the_median(self) -> FlakesSpec:
        low, high = self.diameter_range_um
        if not low < self.diameter_median_um < high:
            raise ValueError(f"the median diameter must lie within the range {low} to {high}")
        return self


class FlopSpec(Strict):
    """The shine of the base, which darkens away from the lamp's mirror direction; by default in the flakes' colour."""

    reflectance: Share
    """The share of light that is reflected, from 0 to 1."""
    lobe_sd_deg: Annotated[float, Field(ge=2, le=45)] = 12.0
    """How wide the reflection is: a standard deviation in degrees."""
    chromaticity_xy: Chromaticity | None = None
    """The chromaticity x, y of the light."""


class BaseSpec(Strict):
    """The base between the flakes: matt, and with a ``flop`` if it shines; ``spectrum`` multiplies ``reflectance``."""

    reflectance: Share
    """The share of light that is reflected, from 0 to 1."""
    chromaticity_xy: Chromaticity | None = None
    """The chromaticity x, y of the light."""
    spectrum: ShareSpectrum | None = None
    """A spectrum in place of a chromaticity."""
    flop: FlopSpec | None = None
    """The shine of the base."""

    @model_validator(mode="after")
    def _one_colour(self) -> BaseSpec:
        if (self.chromaticity_xy is None) == (self.spectrum is None):
            raise ValueError("a base has a chromaticity_xy or a spectrum, one of the two")
        return self


class PlateSpec(Strict):
    """The painted plate."""

    size_mm: tuple[Positive, Positive]
    """Width and height of the plate, in mm."""
    coat_refractive_index: Annotated[float, Field(ge=1, le=4)]
    """The refractive index of the clear coat."""
    coat_extinction_per_mm: NotNegative = 0.0
    """How much light the coat takes, per mm."""
    flakes: FlakesSpec
    """The flakes."""
    base: BaseSpec
    """The base between the flakes."""

    def plate(self) -> Plate:
        """Return the plate."""
        flakes, flop = self.flakes, self.base.flop
        return Plate(
            width_mm=self.size_mm[0],
            height_mm=self.size_mm[1],
            flakes_per_mm2=flakes.per_mm2,
            flake_diameter_median_um=flakes.diameter_median_um,
            flake_diameter_spread=flakes.diameter_spread,
            flake_diameter_min_um=flakes.diameter_range_um[0],
            flake_diameter_max_um=flakes.diameter_range_um[1],
            flake_depth_max_um=flakes.depth_max_um,
            flake_reflectance=flakes.reflectance,
            tilt_sd_deg=flakes.tilt_sd_deg,
            lobe_sd_deg=flakes.lobe_sd_deg,
            coat_refractive_index=self.coat_refractive_index,
            base_reflectance=self.base.reflectance,
            base_chromaticity_xy=self.base.chromaticity_xy,
            flake_chromaticity_xy=flakes.chromaticity_xy,
            diffraction_nm=DIFFRACTION_NM if flakes.diffraction else None,
            flake_rim_um=flakes.rim_um,
            clusters=flakes.clusters.clusters() if flakes.clusters else None,
            coat_extinction_per_mm=self.coat_extinction_per_mm,
            flop_reflectance=flop.reflectance if flop else 0.0,
            flop_lobe_sd_deg=flop.lobe_sd_deg if flop else 12.0,
            flop_chromaticity_xy=flop.chromaticity_xy if flop else None,
            base_spectrum=self.base.spectrum.on_grid() if self.base.spectrum else None,
            flake_spectrum=flakes.spectrum.on_grid() if flakes.spectrum else None,
        )


class LampSpec(Strict):
    """A lamp; its zenith angle is from the plate's normal, its azimuth from the right, 90 being above.

    With ``distance_mm`` from the plate's middle it is near, and may have a beam. Its light is a chromaticity, a black
    body's at ``temperature_K``, or a ``spectrum``.
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
    def _one_light(self) -> LampSpec:
        if sum(value is not None for value in (self.chromaticity_xy, self.temperature_K, self.spectrum)) != 1:
            raise ValueError("a lamp has a chromaticity_xy, a temperature_K or a spectrum, one of the three")
        if self.beam_angle_deg is not None and self.distance_mm is None:
            raise ValueError("a beam needs the lamp's distance_mm: a far lamp lights the plate evenly")
        return self

    @property
    def is_spectral(self) -> bool:
        """Whether the lamp's spectrum is known."""
        return self.chromaticity_xy is None

    def lamp(self, observer: str = DEFAULT_OBSERVER) -> Lamp:
        """Return the lamp, whose light has XYZ of a colorimetric observer."""
        spectrum = None
        if self.chromaticity_xy is not None:
            x, y = self.chromaticity_xy
        else:
            from devices.colour import xyY_from_XYZ
            from stimuli.sparkle.light import XYZ_of, planck

            spectrum = self.spectrum.on_grid() if self.spectrum else planck(self.temperature_K or 0.0)
            x, y, _ = xyY_from_XYZ(XYZ_of(spectrum, observer)).tolist()
        return Lamp(
            illuminance_lx=self.illuminance_lx,
            chromaticity_xy=(x, y),
            zenith_deg=self.zenith_deg,
            azimuth_deg=self.azimuth_deg,
            angular_radius_deg=self.angular_radius_deg,
            distance_mm=self.distance_mm,
            beam_angle_deg=self.beam_angle_deg,
            spectrum=spectrum,
            observer=observer,
        )


FurtherLamps = Annotated[tuple[LampSpec, ...], Field(max_length=16)]


class NoiseSpec(Strict):
    """The sensor's noise: electrons in a full channel, at the sensitivity used, and electrons of read noise."""

    full_well_electrons: Annotated[float, Field(ge=10, le=1e7)]
    """Electrons in a full channel."""
    read_noise_electrons: NotNegative
    """Electrons of read noise."""

    def noise(self) -> Noise:
        """Return the noise."""
        return Noise(self.full_well_electrons, self.read_noise_electrons)


class CameraSpec(Strict):
    """The camera, moved sideways between the views. ``pupil_mm`` adds the spread of an eye's optics, 2 to 6 mm."""

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
    raw_from_XYZ: tuple[_Row, _Row, _Row]
    """The matrix from XYZ to the sensor's channels, three rows of three."""
    pupil_mm: Annotated[float, Field(ge=2, le=6)] | None = None
    """The diameter of an eye's pupil whose optics are added, in mm."""
    noise: NoiseSpec | None = None
    """The sensor's noise; left out, there is none."""

    @model_validator(mode="after")
    def _full_is_light(self) -> CameraSpec:
        import numpy as np

        matrix = np.array(self.raw_from_XYZ)
        if np.linalg.cond(matrix) > 1e6 or np.linalg.inv(matrix)[1].sum() <= 0:
            raise ValueError("raw_from_XYZ must be invertible, and its inverse give full channels luminance")
        return self

    def camera(self) -> Camera:
        """Return the camera."""
        noise = self.noise.noise() if self.noise else None
        return Camera(**self.model_dump(exclude={"noise"}), noise=noise)
