"""Values in recipes of every kind: names, files, seconds, views, series, the threshold of a sparkle."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import PurePosixPath, PureWindowsPath
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from documents.files import no_file_name, with_slashes
from documents.yaml import FileModel, NotNegative, Number, Positive
from stimuli.develop.options import DEFAULT_DEMOSAIC, Demosaic
from stimuli.luminance.scale import greyscale, scaled
from stimuli.pictures.stereo_image import XYZImage
from stimuli.sparkles.find import SparkleThreshold

Step = Mapping[str, Any]
View = Literal["stereo", "flat"]
MAX_STIMULI = 1000
MAX_NAME = 60


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
    if not re.fullmatch(rf"[A-Za-z0-9][A-Za-z0-9._-]{{0,{MAX_NAME - 1}}}", value):
        raise ValueError(
            f"a name has 1 to {MAX_NAME} letters, digits, dots, hyphens or underscores, first a letter or digit"
        )
    if why := no_file_name(value):
        raise ValueError(f"pictures become files of this name, and {why}: choose another")
    return value


def _chromaticity(value: tuple[float, float]) -> tuple[float, float]:
    x, y = value
    if not (x >= 0 and y > 0 and x + y <= 1):
        raise ValueError("a chromaticity x, y has x ≥ 0, y > 0 and x + y ≤ 1")
    return value


def relative_path(value: str) -> str:
    """Return the path of a file, relative to the recipe's folder; backslashes separate folders on Windows only."""
    if sys.platform == "win32":
        value = value.replace("\\", "/")
    if with_slashes(value) != value:
        raise ValueError(f"write the path with forward slashes, which every system reads: {with_slashes(value)}")
    if not value or PurePosixPath(value).is_absolute() or PureWindowsPath(value).drive:
        raise ValueError("name the file relative to the recipe, with forward slashes")
    return value


def _inside(value: str) -> str:
    if (
        not value
        or PurePosixPath(value).is_absolute()
        or PureWindowsPath(value).drive
        or ".." in re.split(r"[/\\]", value)
    ):
        raise ValueError("name a file in the recipe's own folder or below it, without '..'; copy the picture there")
    return relative_path(value)


# A file in the recipe's folder or below, so that the folder can be copied as a whole.
InsideFile = Annotated[str, AfterValidator(_inside)]
Name = Annotated[str, BeforeValidator(_name)]
Chromaticity = Annotated[tuple[Number, Number], AfterValidator(_chromaticity)]
Seconds = Annotated[
    Annotated[float, Field(gt=0, le=1e6)],
    BeforeValidator(_seconds, json_schema_input_type=Annotated[float, Field(gt=0, le=1e6)] | str),
]
Views = Annotated[tuple[View, ...], Field(min_length=1, max_length=2)]


class SeriesSpec(FileModel):
    """The step of a series for every picture: multiply its XYZ, and make it grey, with the chromaticity given."""

    name: Name
    """A name of your own, by which records and reports call it."""
    luminance_scale: Positive = 1.0
    """A factor for all XYZ."""
    greyscale_white_xy: Chromaticity | None = None
    """The chromaticity x, y of a picture that is made grey."""

    def apply(self, xyz_cd_m2: XYZImage, luminance_scale: float) -> XYZImage:
        """Return the picture (rows, columns, 3) times ``luminance_scale``, and grey if the series is.

        Grey keeps each pixel's luminance Y and gives it the chromaticity of the series's white.
        """
        bright = scaled(xyz_cd_m2, luminance_scale)
        return bright if self.greyscale_white_xy is None else greyscale(bright, self.greyscale_white_xy)

    def steps(self) -> list[Step]:
        """Return the step for the manifest."""
        steps: list[Step] = [{"step": "scale", "luminance_scale": self.luminance_scale}]
        if self.greyscale_white_xy is not None:
            steps.append({"step": "greyscale", "white_xy": list(self.greyscale_white_xy)})
        return steps

    def key(self) -> dict[str, object]:
        """Return the values that pictures depend on: all but the name."""
        return self.model_dump(mode="json", exclude={"name"})


SeriesSpecs = Annotated[tuple[SeriesSpec, ...], Field(min_length=1, max_length=32)]


class SparklesSpec(FileModel):
    """The threshold of a sparkle where a manifest reports number, size and contrast of sparkles.

    ``times`` the local background, and above ``above_cd_m2``.
    """

    times: NotNegative = 2.0
    """How many times brighter than its surround a sparkle is."""
    above_cd_m2: NotNegative = 0.0
    """How much brighter than its surround a sparkle is at least, in cd/m²."""

    @model_validator(mode="after")
    def _asks(self) -> Self:
        if self.times == 0 and self.above_cd_m2 == 0:
            raise ValueError("give 'times' the background, 'above_cd_m2', or both")
        return self

    def threshold(self) -> SparkleThreshold:
        """Return the threshold."""
        return SparkleThreshold(self.times, self.above_cd_m2)


class DevelopSpec(FileModel):
    """How files become linear camera RGB: see `stimuli.develop.read.read_camera_image`."""

    demosaic: Demosaic = DEFAULT_DEMOSAIC
    """How a raw file's colours are interpolated."""
    black: NotNegative | None = None
    """The raw level of no light."""
    white: Positive | None = None
    """The raw level of full scale."""
    saturated: Positive | None = None
    """The raw level from which a pixel counts as saturated."""
    rotate: bool = True
    """Whether the picture is turned as the camera says."""
    assume_linear: bool = False
    """Whether a file that does not say so is taken for linear light."""
    negative: Literal["clip", "refuse"] = "clip"
    """What becomes of negative light: clipped, or refused."""


class SpectralSpec(FileModel):
    """Quantity and light of spectral pictures: see `stimuli.spectral.light.Illumination`."""

    quantity: Literal["radiance", "reflectance"] | None = None
    """Whether the file holds radiance or reflectance."""
    illuminant: str | None = None
    """The illuminant that reflectances are seen in, such as D65."""
    white_luminance_cd_m2: Positive | None = None
    """The luminance of white, in cd/m²."""
    scale: Positive = 1.0
    """A factor for all XYZ."""
    negative: Literal["clip", "refuse"] = "refuse"
    """What becomes of negative light: clipped, or refused."""
