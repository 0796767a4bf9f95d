"""The recipe of photographs: files of each view, the camera that took them, and the steps until they are shown."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePosixPath, PureWindowsPath
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, PositiveFloat, StringConstraints, model_validator

from devices.camera.camera_file import ExposureSpec
from stimuli.build.inside import InsideFile
from stimuli.develop.read_raw import DEFAULT_DEMOSAIC, Demosaic
from stimuli.pictures.stereo_image import Eye
from stimuli.recipes.faults import Fault, series_of_pictures_faults, twin_names, twin_views
from stimuli.recipes.photograph_steps import StepsSpec
from stimuli.recipes.series_recipe import SeriesSpec
from stimuli.recipes.values import MAX_STIMULI, Name, SparklesSpec, View, Views
from stimuli.sparkle.recipe import Strict

VIEW_KEYS = ("left", "right", "center")


def _factor(key: str) -> str:
    if key in ("image", "view", "series"):
        raise ValueError(f"'{key}' is set by the recipe; give the factor another name")
    return key


def _relative(value: str) -> str:
    if not value or PurePosixPath(value).is_absolute() or PureWindowsPath(value).drive or "\\" in value:
        raise ValueError("name the file relative to the recipe, with forward slashes")
    return value


FactorName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]{0,59}$"), AfterValidator(_factor)]
FactorValue = Annotated[str, StringConstraints(min_length=1, max_length=200)] | Annotated[float, Field(strict=True)]
Factors_ = Annotated[dict[FactorName, FactorValue], Field(default_factory=dict)]
SeriesSpecs = Annotated[tuple[SeriesSpec, ...], Field(min_length=1, max_length=32)]


class CameraExposureSpec(ExposureSpec):
    """The exposure of a photograph, in place of what its file says."""


class DevelopSpec(Strict):
    """How files become linear camera RGB: see `stimuli.develop.read.read_camera_image`."""

    demosaic: Demosaic = DEFAULT_DEMOSAIC
    black: Annotated[float, Field(ge=0)] | None = None
    white: PositiveFloat | None = None
    saturated: PositiveFloat | None = None
    rotate: bool = True
    assume_linear: bool = False
    negative: Literal["clip", "refuse"] = "clip"


class SpectralSpec(Strict):
    """What the values of spectral pictures are: see `stimuli.spectral.light.Light`."""

    quantity: Literal["radiance", "reflectance"] | None = None
    illuminant: str | None = None
    white_luminance_cd_m2: PositiveFloat | None = None
    scale: PositiveFloat = 1.0
    negative: Literal["clip", "refuse"] = "refuse"


class PhotographSpec(StepsSpec):
    """One stimulus: a file for each view, or ``file``, an OpenEXR file of several views in XYZ.

    ``exposure`` takes the place of the files' metadata. ``flat_eye`` makes the flat version where no centre view is.
    """

    name: Name
    left: InsideFile | None = None
    right: InsideFile | None = None
    center: InsideFile | None = None
    file: InsideFile | None = None
    exposure: CameraExposureSpec | None = None
    flat_eye: Eye | None = None
    factors: Factors_

    @model_validator(mode="after")
    def _has_files(self) -> Self:
        views = [key for key in VIEW_KEYS if getattr(self, key) is not None]
        if bool(views) == (self.file is not None):
            raise ValueError("give a file for each view (left, right, center), or 'file', one of several views")
        if self.file is not None and self.exposure is not None:
            raise ValueError("'file' holds XYZ, which has no exposure")
        return self

    @property
    def files(self) -> dict[str, str]:
        """The files by the key that names them."""
        named = {key: getattr(self, key) for key in (*VIEW_KEYS, "file")}
        return {key: file for key, file in named.items() if file is not None}

    def lacks(self, view: View | None) -> str | None:
        """Return the key of a file that ``view`` needs and that is not named; 'flat_eye' where an eye must be."""
        if self.file is not None:
            return None
        if view == "flat":
            if self.center is not None:
                return None
            return "flat_eye" if self.flat_eye is None else (None if getattr(self, self.flat_eye) else self.flat_eye)
        if view is None and self.center is not None and not (self.left or self.right):
            return None
        return next((eye for eye in ("left", "right") if getattr(self, eye) is None), None)


class PhotographsRecipe(StepsSpec):
    """Photographs developed to XYZ.

    With ``camera`` the files are raw, or linear camera RGB; with ``spectral`` they are spectral pictures; without
    either, OpenEXR pictures of one view that declare their colours. With ``series`` each stimulus is made in each.
    """

    schema_version: Literal[1]
    kind: Literal["photographs"]
    camera: Annotated[str, AfterValidator(_relative)] | None = None
    develop: DevelopSpec | None = None
    spectral: SpectralSpec | None = None
    views: Views | None = None
    series: SeriesSpecs | None = None
    sparkles: SparklesSpec | None = None
    stimuli: Annotated[tuple[PhotographSpec, ...], Field(min_length=1, max_length=MAX_STIMULI)]

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if self.camera is not None and self.spectral is not None:
            raise ValueError("'camera' and 'spectral' do not go together: spectra need no camera")
        if self.develop is not None and self.camera is None:
            raise ValueError("'develop' needs a 'camera' file, which makes XYZ of what is developed")
        if self.camera is None and any(one.exposure is not None for one in self.stimuli):
            raise ValueError("an 'exposure' needs a 'camera' file, whose XYZ it scales")
        return self


def photograph_faults(recipe: PhotographsRecipe) -> Iterator[Fault]:
    """Yield what the schema cannot see: twins, and stimuli without a view that they are shown in."""
    yield from twin_names((one.name for one in recipe.stimuli), "stimuli")
    yield from twin_views(recipe.views)
    series = [one.name for one in recipe.series or ()]
    yield from series_of_pictures_faults([one.name for one in recipe.stimuli], series, recipe.views or ())
    for index, one in enumerate(recipe.stimuli):
        told = False
        for view in recipe.views or (None,):
            lacking = one.lacks(view)
            told |= lacking is not None
            if lacking == "flat_eye":
                yield Fault(
                    ("stimuli", index, "name"),
                    f"there is no centre view for the flat version of '{one.name}'",
                    "name an eye as flat_eye, or the file of the view center",
                )
            elif lacking:
                remedy = f"name its file, or show the stimulus flat: views: [flat], flat_eye: {_other(lacking)}"
                message = f"'{one.name}' has no view '{lacking}'"
                yield Fault(("stimuli", index, "name"), message, remedy)
        steps = one.steps_over(recipe)
        eye = one.lacks("stereo")
        if (steps.align or steps.toe_in) and eye and not told:
            message = f"'{one.name}' is to be aligned, and has no view '{eye}'"
            yield Fault(("stimuli", index, "name"), message, "name left and right: one view alone is not aligned")


def _other(eye: str) -> str:
    return "right" if eye == "left" else "left"
