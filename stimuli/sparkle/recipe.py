"""The part of a recipe that describes a sparkling plate, its lamp and its camera."""

from __future__ import annotations

from typing import Annotated

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    model_validator,
)

from stimuli.sparkle.scene import Camera, Lamp, Plate


class Strict(BaseModel):
    """A part of a recipe: no unknown keys, no NaN or infinity."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def _chromaticity(value: tuple[float, float]) -> tuple[float, float]:
    x, y = value
    if not (x >= 0 and y > 0 and x + y <= 1):
        raise ValueError("a chromaticity x, y has x ≥ 0, y > 0 and x + y ≤ 1")
    return value


Share = Annotated[float, Field(ge=0, le=1)]
Chromaticity = Annotated[tuple[float, float], AfterValidator(_chromaticity)]


class FlakesSpec(Strict):
    """The flakes: how many, how large, how deep, how they tilt and how they reflect.

    Their light has ``chromaticity_xy`` in a coat that is tinted, else the lamp's.
    """

    per_mm2: NonNegativeFloat
    diameter_median_um: PositiveFloat
    diameter_spread: NonNegativeFloat
    diameter_range_um: tuple[PositiveFloat, PositiveFloat]
    depth_max_um: NonNegativeFloat
    tilt_sd_deg: Annotated[float, Field(gt=0, le=60)]
    lobe_sd_deg: Annotated[float, Field(gt=0, le=20)]
    reflectance: Share
    chromaticity_xy: Chromaticity | None = None

    @model_validator(mode="after")
    def _range_holds_the_median(self) -> FlakesSpec:
        low, high = self.diameter_range_um
        if not low < self.diameter_median_um < high:
            raise ValueError(f"the median diameter must lie within the range {low} to {high}")
        return self


class BaseSpec(Strict):
    """What lies between the flakes, taken as matt."""

    reflectance: Share
    chromaticity_xy: Chromaticity


class PlateSpec(Strict):
    """The painted plate."""

    size_mm: tuple[PositiveFloat, PositiveFloat]
    coat_refractive_index: Annotated[float, Field(ge=1, le=4)]
    flakes: FlakesSpec
    base: BaseSpec

    def plate(self) -> Plate:
        """Return the plate."""
        flakes = self.flakes
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
        )


class LampSpec(Strict):
    """The directional lamp; its zenith angle is from the plate's normal, its azimuth from the right, 90 being above."""

    illuminance_lx: NonNegativeFloat
    chromaticity_xy: Chromaticity
    zenith_deg: Annotated[float, Field(ge=0, lt=90)]
    azimuth_deg: float = 90.0
    angular_radius_deg: Annotated[float, Field(ge=0, le=20)]

    def lamp(self) -> Lamp:
        """Return the lamp."""
        return Lamp(**self.model_dump())


class CameraSpec(Strict):
    """The camera, moved sideways between the views."""

    distance_mm: PositiveFloat
    interpupillary_distance_mm: NonNegativeFloat
    resolution_px_per_mm: PositiveFloat
    point_spread_sd_px: Annotated[float, Field(gt=0, le=20)]
    full_well_cd_s_m2: PositiveFloat
    raw_from_XYZ: tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]

    @model_validator(mode="after")
    def _full_is_light(self) -> CameraSpec:
        import numpy as np

        matrix = np.array(self.raw_from_XYZ)
        if np.linalg.cond(matrix) > 1e6 or np.linalg.inv(matrix)[1].sum() <= 0:
            raise ValueError("raw_from_XYZ must be invertible, and its inverse give full channels luminance")
        return self

    def camera(self) -> Camera:
        """Return the camera."""
        return Camera(**self.model_dump())
