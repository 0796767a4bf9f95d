"""Recipes: `configs/stimuli/*.yaml`: which pictures an experiment shows, and how they come about.

Four kinds: `sparkle_plate` photographs a plate that the generator makes up, `sparkle_series` several plates in series
of exposures, `photographs` develops a camera's files, and `pictures` takes OpenEXR files. A recipe and the pictures
that it names form one folder that can be copied as a whole: a picture's path is relative to the recipe, and neither
absolute nor upwards (`..`). A symbolic link inside the folder may lead anywhere, and so may the path of a camera file.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, PositiveFloat, RootModel

from documents import Finding, load_document
from documents.yaml.source import YamlSource
from stimuli.build.inside import InsideFile
from stimuli.errors import StimulusError
from stimuli.pictures.exr.to_xyz import ColourSpace, Negative
from stimuli.pictures.stereo_image import Eye
from stimuli.recipes.faults import (
    Fault,
    series_faults,
    series_of_pictures_faults,
    too_large,
    twin_names,
    twin_views,
    without_spectra,
)
from stimuli.recipes.photograph_steps import StepsSpec
from stimuli.recipes.photographs import Factors_, PhotographsRecipe, SeriesSpecs, photograph_faults
from stimuli.recipes.series_recipe import SparkleSeriesRecipe
from stimuli.recipes.values import MAX_STIMULI, Name, Seconds, SparklesSpec, View, Views
from stimuli.sparkle.recipe import CameraSpec, FurtherLamps, LampSpec, PlateSpec, Strict


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
    further_lamps: FurtherLamps = ()
    camera: CameraSpec
    views: Views = ("stereo", "flat")
    sparkles: SparklesSpec | None = None
    stimuli: Annotated[tuple[ExposureSpec, ...], Field(min_length=1, max_length=MAX_STIMULI)]


class PictureSpec(StepsSpec):
    """One picture from an OpenEXR file.

    ``view`` flat takes the centre view, or ``flat_eye`` where there is none; without ``view`` the picture is shown as
    it is stored. ``factors`` are what sets the picture apart, for grouping and analysis.
    """

    name: Name
    file: InsideFile
    view: View | None = None
    flat_eye: Eye | None = None
    colour_space: ColourSpace = "declared"
    white_luminance_cd_m2: PositiveFloat | None = None
    negative: Negative = "refuse"
    factors: Factors_


class PicturesRecipe(StepsSpec):
    """Pictures from OpenEXR files; with ``views``, each in each of them, and with ``series``, each in each."""

    schema_version: Literal[1]
    kind: Literal["pictures"]
    views: Views | None = None
    series: SeriesSpecs | None = None
    sparkles: SparklesSpec | None = None
    stimuli: Annotated[tuple[PictureSpec, ...], Field(min_length=1, max_length=MAX_STIMULI)]


AnyRecipe = SparklePlateRecipe | SparkleSeriesRecipe | PicturesRecipe | PhotographsRecipe


class Recipe(RootModel[Annotated[AnyRecipe, Field(discriminator="kind")]]):
    """A recipe of any kind."""


def read_recipe(path: Path) -> tuple[AnyRecipe, YamlSource]:
    """Read the recipe at ``path`` and return it with its source, so that later findings can name lines.

    Raises
    ------
    InputError
        If the file cannot be read or says what a recipe cannot say; one finding per fault.
    """
    document, source = load_document(path, Recipe, "recipe")
    findings = []
    for fault in _faults(document.root):
        place = source.place(fault.location)
        line, column = (place.line, place.column) if place else (None, None)
        findings.append(Finding(fault.message, source.file, line, column, fault.remedy))
    if findings:
        raise StimulusError(findings)
    return document.root, source


def _faults(recipe: AnyRecipe) -> Iterator[Fault]:
    if isinstance(recipe, SparkleSeriesRecipe):
        yield from series_faults(recipe)
        return
    if isinstance(recipe, PhotographsRecipe):
        yield from photograph_faults(recipe)
        return
    yield from twin_names((stimulus.name for stimulus in recipe.stimuli), "stimuli")
    yield from twin_views(recipe.views)
    if isinstance(recipe, SparklePlateRecipe):
        yield from too_large(recipe.plate, recipe.camera)
        yield from without_spectra([recipe.plate], recipe.lamp, recipe.further_lamps)
        return
    series = [one.name for one in recipe.series or ()]
    yield from series_of_pictures_faults([one.name for one in recipe.stimuli], series, recipe.views or ())
    for index, picture in enumerate(recipe.stimuli):
        if recipe.views and picture.view:
            message = "'views' already says how each picture is shown"
            yield Fault(("stimuli", index, "view"), message, "keep one of the two")
