"""Recipes: `configs/stimuli/*.yaml`: which pictures an experiment shows, and how they come about.

Two kinds: `sparkle_plate` photographs a plate that the generator makes up, `pictures` takes OpenEXR files. A recipe
and what it names form one folder that can be copied as a whole: a picture's path is relative to the recipe, and
neither absolute nor upwards (`..`). A symbolic link inside the folder may lead anywhere.
"""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Annotated, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    RootModel,
    model_validator,
)

from documents import Finding, load_document
from documents.yaml_source import YamlSource
from stimuli.errors import StimulusError
from stimuli.exr.to_xyz import ColourSpace, Negative
from stimuli.sparkle.scene import Camera, Lamp, Plate
from stimuli.stereo_image import Eye

View = Literal["stereo", "flat"]
MAX_STIMULI = 1000


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def _seconds(value: object) -> object:
    if not isinstance(value, str):
        return value
    parts = re.fullmatch(r"(\d{1,9}(?:\.\d{1,9})?) */ *(\d{1,9}(?:\.\d{1,9})?)", value)
    if parts is None or float(parts[2]) == 0:
        raise ValueError("expected seconds, such as 0.5 or 1/15")
    return float(parts[1]) / float(parts[2])


def _name(value: object) -> str:
    if not isinstance(value, str):
        raise ValueError(f"a name is text: put quotes around it, '{value}'")
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,59}", value):
        raise ValueError("a name has 1 to 60 letters, digits, dots, hyphens or underscores, first a letter or digit")
    return value


def _inside(value: str) -> str:
    path = PurePosixPath(value)
    if not value or path.is_absolute() or PureWindowsPath(value).drive or "\\" in value or ".." in path.parts:
        raise ValueError("name a file in the recipe's own folder or below it, without '..'; copy the picture there")
    return value


def _chromaticity(value: tuple[float, float]) -> tuple[float, float]:
    x, y = value
    if not (x >= 0 and y > 0 and x + y <= 1):
        raise ValueError("a chromaticity x, y has x ≥ 0, y > 0 and x + y ≤ 1")
    return value


Name = Annotated[str, BeforeValidator(_name)]
Seconds = Annotated[float, BeforeValidator(_seconds), Field(gt=0, le=1e6)]
Share = Annotated[float, Field(ge=0, le=1)]
Chromaticity = Annotated[tuple[float, float], AfterValidator(_chromaticity)]


class FlakesSpec(_Strict):
    """The flakes: how many, how large, how deep, how they tilt and how they reflect."""

    per_mm2: NonNegativeFloat
    diameter_median_um: PositiveFloat
    diameter_spread: NonNegativeFloat
    diameter_range_um: tuple[PositiveFloat, PositiveFloat]
    depth_max_um: NonNegativeFloat
    tilt_sd_deg: Annotated[float, Field(gt=0, le=60)]
    lobe_sd_deg: Annotated[float, Field(gt=0, le=20)]
    reflectance: Share

    @model_validator(mode="after")
    def _range_holds_the_median(self) -> FlakesSpec:
        low, high = self.diameter_range_um
        if not low < self.diameter_median_um < high:
            raise ValueError(f"the median diameter must lie within the range {low} to {high}")
        return self


class BaseSpec(_Strict):
    """What lies between the flakes, taken as matt."""

    reflectance: Share
    chromaticity_xy: Chromaticity


class PlateSpec(_Strict):
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
        )


class LampSpec(_Strict):
    """The directional lamp; its zenith angle is from the plate's normal, its azimuth from the right, 90 being above."""

    illuminance_lx: NonNegativeFloat
    chromaticity_xy: Chromaticity
    zenith_deg: Annotated[float, Field(ge=0, lt=90)]
    azimuth_deg: float = 90.0
    angular_radius_deg: Annotated[float, Field(ge=0, le=20)]

    def lamp(self) -> Lamp:
        """Return the lamp."""
        return Lamp(**self.model_dump())


class CameraSpec(_Strict):
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


class ExposureSpec(_Strict):
    """One photograph: exposed for so long, then all its XYZ multiplied."""

    name: Name
    exposure_s: Seconds
    luminance_scale: PositiveFloat = 1.0


class SparklePlateRecipe(_Strict):
    """Photographs of one made-up plate at several exposures; equal seeds make equal plates."""

    schema_version: Literal[1]
    kind: Literal["sparkle_plate"]
    seed: Annotated[int, Field(ge=0, lt=2**63)]
    plate: PlateSpec
    lamp: LampSpec
    camera: CameraSpec
    views: Annotated[tuple[View, ...], Field(min_length=1, max_length=2)] = ("stereo", "flat")
    stimuli: Annotated[tuple[ExposureSpec, ...], Field(min_length=1, max_length=MAX_STIMULI)]

    @model_validator(mode="after")
    def _fits_memory(self) -> SparklePlateRecipe:
        width, height = self.plate.size_mm
        if self.plate.flakes.per_mm2 * width * height > 5e7:
            raise ValueError("the plate has more than 50 million flakes; make it smaller or its flakes fewer")
        if width * height * self.camera.resolution_px_per_mm**2 > 1e8:
            raise ValueError("the plate covers more than 100 million camera pixels; lower resolution_px_per_mm")
        return self


class PictureSpec(_Strict):
    """One picture from an OpenEXR file.

    ``view`` flat takes the centre view, or ``flat_eye`` where there is none; without ``view`` the picture is shown as
    it is stored.
    """

    name: Name
    file: Annotated[str, AfterValidator(_inside)]
    view: View | None = None
    flat_eye: Eye | None = None
    colour_space: ColourSpace = "declared"
    white_luminance_cd_m2: PositiveFloat | None = None
    negative: Negative = "refuse"


class PicturesRecipe(_Strict):
    """Pictures from OpenEXR files; with ``views``, each in each of them."""

    schema_version: Literal[1]
    kind: Literal["pictures"]
    views: Annotated[tuple[View, ...], Field(min_length=1, max_length=2)] | None = None
    stimuli: Annotated[tuple[PictureSpec, ...], Field(min_length=1, max_length=MAX_STIMULI)]


class Recipe(RootModel[Annotated[SparklePlateRecipe | PicturesRecipe, Field(discriminator="kind")]]):
    """A recipe of either kind."""


def read_recipe(path: Path) -> tuple[SparklePlateRecipe | PicturesRecipe, YamlSource]:
    """Read the recipe at ``path`` and return it with its source, so that later findings can name lines.

    Raises
    ------
    InputError
        If the file cannot be read or says what a recipe cannot say; one finding per fault.
    """
    document, source = load_document(path, Recipe)
    recipe = document.root
    findings = []

    def fault(location: tuple[str | int, ...], message: str, remedy: str) -> None:
        place = source.place(location)
        line, column = (place.line, place.column) if place else (None, None)
        findings.append(Finding(message, source.file, line, column, remedy))

    seen: set[str] = set()
    stimuli: tuple[ExposureSpec | PictureSpec, ...] = recipe.stimuli
    for index, stimulus in enumerate(stimuli):
        # Names become file names, and some file systems do not tell A from a.
        twin = stimulus.name.casefold() in seen
        seen.add(stimulus.name.casefold())
        if twin:
            fault(("stimuli", index, "name"), f"the name '{stimulus.name}' stands twice", "give it another")
        if isinstance(stimulus, PictureSpec) and recipe.views and stimulus.view:
            fault(("stimuli", index, "view"), "'views' already says how each picture is shown", "keep one of the two")
    if recipe.views and len(set(recipe.views)) != len(recipe.views):
        fault(("views",), "a view stands twice", "keep one")
    if findings:
        raise StimulusError(findings)
    return recipe, source
