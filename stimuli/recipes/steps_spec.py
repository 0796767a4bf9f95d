"""The steps of a recipe once pictures are XYZ: align, crop, bring to a luminance, resample, fit to a display.

Every step is optional and their order is fixed. A step of the recipe is for all of its stimuli; a step of a
stimulus takes its place.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, NonNegativeInt, PositiveFloat, PositiveInt, model_validator

from documents.yaml import Strict
from stimuli.align.interpolate import Interpolation
from stimuli.luminance.saturation import LIMIT_PERCENT
from stimuli.pictures.resampling import Filter
from stimuli.sparkle.recipe import Chromaticity

Place = tuple[float, float]
Pixels = tuple[NonNegativeInt, NonNegativeInt, PositiveInt, PositiveInt]
_LUMINANCES = ("scale", "mean_cd_m2", "max_cd_m2", "white_cd_m2")


class ToeInSpec(Strict):
    """Cameras turned inwards by ``toe_in_deg`` each; the focal length in pixels, or the field of view across."""

    toe_in_deg: Annotated[float, Field(ge=0, lt=45)]
    focal_length_px: PositiveFloat | None = None
    field_of_view_deg: Annotated[float, Field(gt=0, lt=180)] | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.focal_length_px is None) == (self.field_of_view_deg is None):
            raise ValueError("give focal_length_px or field_of_view_deg, one of the two")
        return self


class PointsSpec(Strict):
    """The same places of the sample's plane, marked in both views: x and y in pixels from the top left."""

    left: Annotated[tuple[Place, ...], Field(min_length=1)]
    right: Annotated[tuple[Place, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _as_many(self) -> Self:
        if len(self.left) != len(self.right):
            raise ValueError(f"{len(self.left)} points are marked on the left and {len(self.right)} on the right")
        return self


class AlignSpec(Strict):
    """How the sample's plane comes to zero parallax: see `stimuli.align.pair.align_pair`.

    With ``straighten``, roll and scale between the cameras are undone first: see `stimuli.align.straightening`.
    """

    method: Literal["correlation", "points", "offset"] = "correlation"
    offset_px: Place | None = None
    points: PointsSpec | None = None
    region: tuple[NonNegativeInt, NonNegativeInt, PositiveInt, PositiveInt] | None = None
    most_px: tuple[PositiveInt, PositiveInt] | None = None
    correct_vertical: bool = True
    whole_pixels: bool = False
    interpolation: Interpolation = "sinc"
    straighten: bool = False

    @model_validator(mode="after")
    def _goes_with_method(self) -> Self:
        needs = {"correlation": (), "points": ("points",), "offset": ("offset_px",)}[self.method]
        takes = (*needs, "region", "most_px") if self.method == "correlation" else needs
        for key in ("offset_px", "points", "region", "most_px"):
            given = getattr(self, key) is not None
            if key in needs and not given:
                raise ValueError(f"method {self.method} needs {key}")
            if given and key not in takes:
                raise ValueError(f"method {self.method} has no use for {key}")
        if self.straighten and self.method == "points":
            raise ValueError("straighten moves the places that are marked; use method correlation, or offset")
        return self


class CropSpec(Strict):
    """The part that is shown, in pixels of the (aligned) picture."""

    left_px: NonNegativeInt
    top_px: NonNegativeInt
    width_px: PositiveInt
    height_px: PositiveInt


class LuminanceSpec(Strict):
    """One factor for all XYZ of both eyes, and whether the picture becomes grey.

    ``scale`` is the factor itself; else it brings the mean, the maximum, or the white in ``white_box`` (first column,
    first row, width, height) to so many cd/m².
    """

    scale: PositiveFloat | None = None
    mean_cd_m2: PositiveFloat | None = None
    max_cd_m2: PositiveFloat | None = None
    white_cd_m2: PositiveFloat | None = None
    white_box: Pixels | None = None
    greyscale_white_xy: Chromaticity | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        given = [key for key in _LUMINANCES if getattr(self, key) is not None]
        if len(given) > 1:
            raise ValueError(f"{' and '.join(given)} are given; one decides the factor")
        if (self.white_cd_m2 is None) != (self.white_box is None):
            raise ValueError("white_cd_m2 and white_box go together")
        if not given and self.greyscale_white_xy is None:
            raise ValueError("give one of " + ", ".join(_LUMINANCES) + ", or greyscale_white_xy")
        return self


class ResampleSpec(Strict):
    """How large the picture is in truth, so that the display shows it at that size: pixels per mm, or its width."""

    px_per_mm: PositiveFloat | None = None
    width_mm: PositiveFloat | None = None
    filter: Filter = "area"

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.px_per_mm is None) == (self.width_mm is None):
            raise ValueError("give px_per_mm or width_mm, one of the two")
        return self

    def size_mm(self, width_px: int, height_px: int) -> tuple[float, float]:
        """Return the true width and height of a picture of so many pixels; its pixels are square."""
        if self.px_per_mm is not None:
            return width_px / self.px_per_mm, height_px / self.px_per_mm
        assert self.width_mm is not None
        return self.width_mm, self.width_mm * height_px / width_px


class ToneMapSpec(Strict):
    """The brightest pixel becomes ``reference_cd_m2``, unless more than ``limit_percent`` of pixels would saturate."""

    reference_cd_m2: PositiveFloat
    limit_percent: Annotated[float, Field(ge=0, le=100)] = LIMIT_PERCENT


class StepsSpec(Strict):
    """The steps in their order."""

    toe_in: ToeInSpec | None = None
    align: AlignSpec | None = None
    crop: CropSpec | None = None
    luminance: LuminanceSpec | None = None
    resample: ResampleSpec | None = None
    tone_map: ToneMapSpec | None = None

    def steps_over(self, shared: StepsSpec) -> StepsSpec:
        """Return the steps with this one's in place of ``shared``'s."""
        both = {key: getattr(self, key) or getattr(shared, key) for key in StepsSpec.model_fields}
        return StepsSpec(**both)

    def steps_json(self) -> dict[str, Any]:
        """Return the steps alone, as JSON."""
        return self.model_dump(mode="json", include=set(StepsSpec.model_fields))
