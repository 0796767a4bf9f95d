"""The steps of a recipe once pictures are XYZ: align, crop, adapt, bring to a luminance, resample, fit to a display.

Every step is optional and their order is fixed. A step of the recipe is for all of its stimuli; a step of a
stimulus takes its place.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from devices.colour import WHITE_POINTS_XYZ, XYZ_from_xyY, adaptation_matrix, white_point
from devices.colour_matching import DEFAULT_OBSERVER
from devices.errors import DeviceError
from documents import did_you_mean
from documents.yaml import Count, FileModel, Natural, Number, Positive
from stimuli.align.interpolate import Interpolation
from stimuli.luminance.saturation import LIMIT_PERCENT
from stimuli.pictures.exr_read import Negative
from stimuli.pictures.resampling import Filter
from stimuli.recipes.values import Chromaticity

Place = tuple[Number, Number]
Pixels = tuple[Count, Count, Natural, Natural]


def _white(given: Any) -> Any:
    """Return a white as it is stated, or raise ValueError with the three ways to state one."""
    if isinstance(given, str):
        name = given.lower()
        if name not in WHITE_POINTS_XYZ:
            raise ValueError(did_you_mean(given, WHITE_POINTS_XYZ, f"write one of {', '.join(WHITE_POINTS_XYZ)}"))
        return name
    numbers = list(given) if isinstance(given, list | tuple) else []
    if len(numbers) not in (2, 3) or not all(isinstance(n, int | float) and math.isfinite(n) for n in numbers):
        raise ValueError("write a name such as d65, a chromaticity [x, y], or [X, Y, Z]")
    x, y, z = numbers if len(numbers) == 3 else (*numbers, 1.0 - sum(numbers))
    if y <= 0 or x < 0 or z < 0:
        raise ValueError("no light has it: X and Z are at least 0, Y is above 0, and x + y is at most 1")
    return tuple(float(n) for n in numbers)


White = Annotated[str | tuple[Number, ...], BeforeValidator(_white)]
_LUMINANCES = ("scale", "mean_cd_m2", "max_cd_m2", "white_cd_m2")


class ToeInSpec(FileModel):
    """Cameras turned inwards by ``toe_in_deg`` each; the focal length in pixels, or the field of view across."""

    toe_in_deg: Annotated[float, Field(ge=0, lt=45)]
    """How far each camera was turned inwards, in degrees."""
    focal_length_px: Positive | None = None
    """The focal length, in pixels."""
    field_of_view_deg: Annotated[float, Field(gt=0, lt=180)] | None = None
    """The field of view across, in degrees."""

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.focal_length_px is None) == (self.field_of_view_deg is None):
            raise ValueError("give focal_length_px or field_of_view_deg, one of the two")
        return self


class PointsSpec(FileModel):
    """The same places of the sample's plane, marked in both views: x and y in pixels from the top left."""

    left: Annotated[tuple[Place, ...], Field(min_length=1)]
    """Places x, y in the left view, in pixels from the top left."""
    right: Annotated[tuple[Place, ...], Field(min_length=1)]
    """Places x, y in the right view, in pixels from the top left."""

    @model_validator(mode="after")
    def _as_many(self) -> Self:
        if len(self.left) != len(self.right):
            raise ValueError(f"{len(self.left)} points are marked on the left and {len(self.right)} on the right")
        return self


class AlignSpec(FileModel):
    """How the sample's plane comes to zero parallax: see `stimuli.align.pair.align_pair`.

    With ``straighten``, roll and scale between the cameras are undone first: see `stimuli.align.straightening`.
    """

    method: Literal["correlation", "points", "offset"] = "correlation"
    """How the disparity of the sample's plane is found: correlation, points, or an offset that is given."""
    offset_px: Place | None = None
    """The disparity to undo, across and down, in pixels."""
    points: PointsSpec | None = None
    """The same places marked in both views."""
    region: tuple[Count, Count, Natural, Natural] | None = None
    """The part that is correlated: left, top, width and height in pixels."""
    most_px: tuple[Natural, Natural] | None = None
    """The largest disparity that is looked for, across and down, in pixels."""
    correct_vertical: bool = True
    """Whether vertical disparity is undone too."""
    whole_pixels: bool = False
    """Whether only whole pixels are moved, without interpolation."""
    interpolation: Interpolation = "sinc"
    """How pixels between pixels are computed."""
    straighten: bool = False
    """Whether roll and scale between the cameras are undone first."""

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


class CropSpec(FileModel):
    """The part that is shown, in pixels of the (aligned) picture."""

    left_px: Count
    """The first column."""
    top_px: Count
    """The first row."""
    width_px: Natural
    """How many columns."""
    height_px: Natural
    """How many rows."""


class AdaptSpec(FileModel):
    """Chromatic adaptation: the picture as it looks under another white, see `devices.colour.adaptation`.

    A white is a name (``d65``), a chromaticity x, y, or XYZ. Of XYZ the chromaticity counts: a white keeps its
    luminance.
    """

    from_white: White
    """The white of the picture's own light: a name such as d65, x and y, or XYZ."""
    to_white: White
    """The white to which its observers are adapted, likewise."""
    method: Literal["cat16", "von-kries", "bradford"] = "cat16"
    """Which responses of the eye are scaled: cat16, von-kries or bradford."""
    degree: Annotated[float, Field(ge=0, le=1)] = 1.0
    """How complete the adaptation is: 0 leaves the picture as it is."""
    negative: Negative = "refuse"
    """What becomes of pixels whose light falls below 0: clipped, or refused."""

    @model_validator(mode="after")
    def _are_whites(self) -> Self:
        self.matrix(DEFAULT_OBSERVER)
        return self

    def white_XYZ(self, which: Literal["from_white", "to_white"], observer: str) -> NDArray[np.float64]:
        """Return the XYZ of a white with Y = 1, shape (3,); names are of the whites of the ``observer``."""
        white = getattr(self, which)
        if isinstance(white, str):
            return white_point(white, 1.0, observer)
        XYZ = XYZ_from_xyY([*white, 1.0]) if len(white) == 2 else np.array(white) / white[1]
        return np.asarray(XYZ, dtype=np.float64)

    def matrix(self, observer: str) -> NDArray[np.float64]:
        """Return the matrix (3, 3) from the picture's XYZ to the adapted one's. Raises ValueError."""
        whites = self.white_XYZ("from_white", observer), self.white_XYZ("to_white", observer)
        try:
            return adaptation_matrix(*whites, self.method, self.degree)
        except DeviceError as error:
            raise ValueError(str(error)) from error


class LuminanceSpec(FileModel):
    """One factor for all XYZ of both eyes, and whether the picture becomes grey.

    ``scale`` is the factor itself; else it brings the mean, the maximum, or the white in ``white_box`` (first column,
    first row, width, height) to so many cd/m².
    """

    scale: Positive | None = None
    """A factor for all XYZ."""
    mean_cd_m2: Positive | None = None
    """What the mean luminance becomes, in cd/m²."""
    max_cd_m2: Positive | None = None
    """What the largest luminance becomes, in cd/m²."""
    white_cd_m2: Positive | None = None
    """What the white in white_box becomes, in cd/m²."""
    white_box: Pixels | None = None
    """Where the white lies: left, top, width and height in pixels."""
    greyscale_white_xy: Chromaticity | None = None
    """The chromaticity x, y of a picture that is made grey."""

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


class ResampleSpec(FileModel):
    """How large the picture is in truth, so that the display shows it at that size: pixels per mm, or its width."""

    px_per_mm: Positive | None = None
    """How many pixels of the file there are to a mm of the thing."""
    width_mm: Positive | None = None
    """The width of what the picture shows, in mm."""
    filter: Filter = "area"
    """How pixels are averaged."""

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


class ToneMapSpec(FileModel):
    """The brightest pixel becomes ``reference_cd_m2``, unless more than ``limit_percent`` of pixels would saturate."""

    reference_cd_m2: Positive
    """The luminance that the brightest pixel becomes, in cd/m²."""
    limit_percent: Annotated[float, Field(ge=0, le=100)] = LIMIT_PERCENT
    """The share of pixels that may saturate, in percent."""


class StepsSpec(FileModel):
    """The steps in their order."""

    toe_in: ToeInSpec | None = None
    """How far the cameras were turned inwards, to be undone."""
    align: AlignSpec | None = None
    """How the sample's plane comes to zero parallax."""
    crop: CropSpec | None = None
    """The part that is shown."""
    adapt: AdaptSpec | None = None
    """Chromatic adaptation from one white to another."""
    luminance: LuminanceSpec | None = None
    """One factor for all XYZ of both eyes."""
    resample: ResampleSpec | None = None
    """How large the picture is in truth."""
    tone_map: ToneMapSpec | None = None
    """How bright pictures are brought into the display's range."""

    def steps_over(self, shared: StepsSpec) -> StepsSpec:
        """Return the steps with this one's in place of ``shared``'s."""
        both = {key: getattr(self, key) or getattr(shared, key) for key in StepsSpec.model_fields}
        return StepsSpec(**both)

    def steps_json(self) -> dict[str, Any]:
        """Return the steps alone, as JSON."""
        return self.model_dump(mode="json", include=set(StepsSpec.model_fields))
