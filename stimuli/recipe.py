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
    BeforeValidator,
    Field,
    PositiveFloat,
    RootModel,
)

from documents import Finding, load_document
from documents.yaml_source import YamlSource
from stimuli.errors import StimulusError
from stimuli.exr.to_xyz import ColourSpace, Negative
from stimuli.sparkle.recipe import CameraSpec, LampSpec, PlateSpec, Strict
from stimuli.stereo_image import Eye

View = Literal["stereo", "flat"]
MAX_STIMULI = 1000
# What a plate may ask for: either takes a few GB of memory.
MAX_FLAKES = 50_000_000
MAX_CAMERA_PIXELS = 100_000_000


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


Name = Annotated[str, BeforeValidator(_name)]
Seconds = Annotated[
    Annotated[float, Field(gt=0, le=1e6)],
    BeforeValidator(_seconds, json_schema_input_type=Annotated[float, Field(gt=0, le=1e6)] | str),
]


class ExposureSpec(Strict):
    """One photograph: exposed for so long, then all its XYZ multiplied."""

    name: Name
    exposure_s: Seconds
    luminance_scale: PositiveFloat = 1.0


class SparklePlateRecipe(Strict):
    """Photographs of one made-up plate at several exposures; equal seeds make equal plates."""

    schema_version: Literal[1]
    kind: Literal["sparkle_plate"]
    seed: Annotated[int, Field(ge=0, lt=2**63)]
    plate: PlateSpec
    lamp: LampSpec
    camera: CameraSpec
    views: Annotated[tuple[View, ...], Field(min_length=1, max_length=2)] = ("stereo", "flat")
    stimuli: Annotated[tuple[ExposureSpec, ...], Field(min_length=1, max_length=MAX_STIMULI)]


class PictureSpec(Strict):
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


class PicturesRecipe(Strict):
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
    if isinstance(recipe, SparklePlateRecipe):
        area_mm2 = recipe.plate.size_mm[0] * recipe.plate.size_mm[1]
        if area_mm2 * recipe.plate.flakes.per_mm2 > MAX_FLAKES:
            fault(
                ("plate", "flakes", "per_mm2"),
                f"the plate has more than {MAX_FLAKES // 10**6} million flakes",
                "make it smaller or its flakes fewer",
            )
        if area_mm2 * recipe.camera.resolution_px_per_mm**2 > MAX_CAMERA_PIXELS:
            fault(
                ("camera", "resolution_px_per_mm"),
                f"the plate covers more than {MAX_CAMERA_PIXELS // 10**6} million camera pixels",
                "make it smaller or the resolution lower",
            )
    if findings:
        raise StimulusError(findings)
    return recipe, source
