"""The part of a recipe that describes a sparkling plate, its lamps and its camera."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from documents.yaml import FileModel, NotNegative, Positive
from extensions.sparkle.scene import Clusters, Lamp, Plate, Share, SpectrumSpec
from stimuli.recipes import Chromaticity

# Where the eye is most sensitive.
DIFFRACTION_NM = 555.0


def _share(value: SpectrumSpec) -> SpectrumSpec:
    if max(value.values) > 1:
        raise ValueError("no reflectance is above 1")
    return value


ShareSpectrum = Annotated[SpectrumSpec, AfterValidator(_share)]


class FlakesSpec(FileModel):
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
    clusters: Clusters | None = None
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


class FlopSpec(FileModel):
    """The shine of the base, which darkens away from the lamp's mirror direction; by default in the flakes' colour."""

    reflectance: Share
    """The share of light that is reflected, from 0 to 1."""
    lobe_sd_deg: Annotated[float, Field(ge=2, le=45)] = 12.0
    """How wide the reflection is: a standard deviation in degrees."""
    chromaticity_xy: Chromaticity | None = None
    """The chromaticity x, y of the light."""


class BaseSpec(FileModel):
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


class PaintedPlateSpec(FileModel):
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
            clusters=flakes.clusters,
            coat_extinction_per_mm=self.coat_extinction_per_mm,
            flop_reflectance=flop.reflectance if flop else 0.0,
            flop_lobe_sd_deg=flop.lobe_sd_deg if flop else 12.0,
            flop_chromaticity_xy=flop.chromaticity_xy if flop else None,
            base_spectrum=self.base.spectrum.on_grid() if self.base.spectrum else None,
            flake_spectrum=flakes.spectrum.on_grid() if flakes.spectrum else None,
        )


FurtherLamps = Annotated[tuple[Lamp, ...], Field(max_length=16)]
