"""The recipe of exposure series: plates × series × exposures, as in the thesis's first experiment (Section 4.5.1).

Every plate is photographed at every exposure, each photograph is brought to one mean luminance, and each series
changes all of them alike: brighter, or without colour.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat

from stimuli.recipes.values import MAX_STIMULI, Name, Seconds, SparklesSpec, Views
from stimuli.sparkle.recipe import (
    BaseSpec,
    CameraSpec,
    Chromaticity,
    ClustersSpec,
    FlakesSpec,
    FurtherLamps,
    LampSpec,
    PlateSpec,
    Share,
    ShareSpectrum,
    Strict,
)


class FlakesChangeSpec(Strict):
    """What one plate's flakes have other than the plates share; the keys are those of the shared flakes."""

    per_mm2: NonNegativeFloat | None = None
    diameter_median_um: PositiveFloat | None = None
    diameter_spread: NonNegativeFloat | None = None
    diameter_range_um: tuple[PositiveFloat, PositiveFloat] | None = None
    depth_max_um: NonNegativeFloat | None = None
    tilt_sd_deg: Annotated[float, Field(gt=0, le=60)] | None = None
    lobe_sd_deg: Annotated[float, Field(gt=0, le=20)] | None = None
    reflectance: Share | None = None
    chromaticity_xy: Chromaticity | None = None
    spectrum: ShareSpectrum | None = None
    diffraction: bool | None = None
    rim_um: NonNegativeFloat | None = None
    clusters: ClustersSpec | None = None


class NamedPlateSpec(Strict):
    """A plate by its name, and what it has other than the plates share."""

    name: Name
    base: BaseSpec | None = None
    flakes: FlakesChangeSpec = FlakesChangeSpec()
    coat_refractive_index: Annotated[float, Field(ge=1, le=4)] | None = None

    def flakes_over(self, shared: FlakesSpec) -> FlakesSpec:
        """Return ``shared`` with this plate's changes.

        Raises
        ------
        pydantic.ValidationError
            If the two together say what flakes cannot be.
        """
        return FlakesSpec.model_validate({**shared.model_dump(), **self.flakes.model_dump(exclude_none=True)})

    def over(self, shared: PlateSpec) -> PlateSpec:
        """Return the plate ``shared`` with this plate's changes; raises as `flakes_over` does."""
        return PlateSpec(
            size_mm=shared.size_mm,
            coat_refractive_index=self.coat_refractive_index or shared.coat_refractive_index,
            coat_extinction_per_mm=shared.coat_extinction_per_mm,
            flakes=self.flakes_over(shared.flakes),
            base=self.base or shared.base,
        )


class SeriesSpec(Strict):
    """What a series does to every photograph: multiply its XYZ, and show it grey, with the chromaticity given."""

    name: Name
    luminance_scale: PositiveFloat = 1.0
    greyscale_white_xy: Chromaticity | None = None


class SparkleSeriesRecipe(Strict):
    """Series of exposures of several made-up plates.

    ``plate`` is what the ``plates`` share. Without ``views`` all pictures are stereo, and their names do not say so.
    """

    schema_version: Literal[1]
    kind: Literal["sparkle_series"]
    seed: Annotated[int, Field(ge=0, lt=2**63)]
    plate: PlateSpec
    lamp: LampSpec
    further_lamps: FurtherLamps = ()
    camera: CameraSpec
    target_mean_luminance_cd_m2: PositiveFloat
    plates: Annotated[tuple[NamedPlateSpec, ...], Field(min_length=1, max_length=MAX_STIMULI)]
    exposures_s: Annotated[tuple[Seconds, ...], Field(min_length=1, max_length=32)]
    series: Annotated[tuple[SeriesSpec, ...], Field(min_length=1, max_length=32)]
    views: Views | None = None
    sparkles: SparklesSpec | None = None


def series_name(plate: str, series: str, exposure_s: float) -> str:
    """Return the name of one exposure of one plate in one series, such as GM1-base-1.3."""
    return f"{plate}-{series}-{exposure_s:g}"
