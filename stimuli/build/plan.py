"""What a recipe makes, picture by picture: what each depends on, and which of them are best made together.

A picture's key is the hash of everything that its pixels and its steps depend on, and of nothing else, so that changing
one stimulus leaves the others' keys as they were. Its name and its factors are no part of it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

from stimuli.build.display_setup import DisplaySetup
from stimuli.build.made import Made
from stimuli.build.make_pictures import make_pictures
from stimuli.build.make_plate import make_plate
from stimuli.build.make_series import make_series, plate_seed
from stimuli.build.progress import Progress
from stimuli.build.stimulus_set import sha256_of_json
from stimuli.recipes.names import file_pictures, series_pictures, stimulus_name
from stimuli.recipes.needs import input_files, needed_setup
from stimuli.recipes.photographs import PhotographSpec, PhotographsRecipe
from stimuli.recipes.recipe import AnyRecipe, PictureSpec, PicturesRecipe, SparklePlateRecipe
from stimuli.recipes.series_recipe import SparkleSeriesRecipe
from stimuli.recipes.values import SparklesSpec

Make = Callable[[Progress, Collection[str]], Iterator[Made]]


@dataclass(frozen=True, slots=True)
class Task:
    """Pictures that share work: their keys by name, in the recipe's order, and what makes those that are asked for."""

    keys: Mapping[str, str]
    make: Make


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What pictures depend on beside the recipe: where it lies, its files' SHA-256, and the display."""

    folder: Path
    inputs: Mapping[str, str]
    pixel_pitch_mm: float
    setup: DisplaySetup | None
    version: int
    sparkles: SparklesSpec | None

    def key(self, **parts: Any) -> str:
        """Return the key of a picture."""
        sparkles = None if self.sparkles is None else self.sparkles.model_dump(mode="json")
        everywhere = {"version": self.version, "pixel_pitch_mm": self.pixel_pitch_mm, "sparkles": sparkles}
        return sha256_of_json({**everywhere, **parts})


def plan(recipe: AnyRecipe, around: Surroundings) -> tuple[Task, ...]:
    """Return the tasks that make ``recipe``'s stimuli, in its order."""
    if isinstance(recipe, SparklePlateRecipe):
        return (_plate(recipe, around),)
    if isinstance(recipe, SparkleSeriesRecipe):
        return tuple(_series(recipe, around))
    return tuple(_files(recipe, around))


def _plate(recipe: SparklePlateRecipe, around: Surroundings) -> Task:
    shared = recipe.model_dump(mode="json", exclude={"stimuli", "views", "sparkles"})
    keys = {
        stimulus_name(one.name, view): around.key(
            shared=shared, view=view, exposure_s=one.exposure_s, luminance_scale=one.luminance_scale
        )
        for one in recipe.stimuli
        for view in recipe.views
    }

    def make(report: Progress, names: Collection[str]) -> Iterator[Made]:
        return make_plate(recipe, around.pixel_pitch_mm, report, names)

    return Task(keys, make)


def _series(recipe: SparkleSeriesRecipe, around: Surroundings) -> Iterator[Task]:
    """Yield a task for each plate: its flakes are scattered once, and its photographs are kept until it is done."""
    shared = recipe.model_dump(
        mode="json", include={"kind", "lamp", "further_lamps", "camera", "target_mean_luminance_cd_m2"}
    )
    for named, pictures in groupby(series_pictures(recipe), key=lambda picture: picture.plate):
        plate, seed = named.over(recipe.plate).model_dump(mode="json"), plate_seed(recipe.seed, named.name)
        keys = {
            one.name: around.key(
                shared=shared,
                plate=plate,
                seed=seed,
                view=one.view,
                exposure_s=one.exposure_s,
                series=one.series.model_dump(mode="json", exclude={"name"}),
            )
            for one in pictures
        }

        def make(report: Progress, names: Collection[str]) -> Iterator[Made]:
            return make_series(recipe, around.pixel_pitch_mm, report, names)

        yield Task(keys, make)


def _files(recipe: PicturesRecipe | PhotographsRecipe, around: Surroundings) -> Iterator[Task]:
    """Yield a task for each stimulus: its files are read, and its pair is aligned, once."""
    make: Make = partial(_made, recipe, around)
    specs: tuple[PictureSpec | PhotographSpec, ...] = recipe.stimuli
    shared: dict[str, Any] = {"needed": needed_setup(recipe, around.setup)}
    if isinstance(recipe, PhotographsRecipe):
        shared |= recipe.model_dump(mode="json", include={"kind", "develop", "spectral"})
        shared["files"] = [around.inputs[file] for file, place in input_files(recipe).items() if place[0] != "stimuli"]
    for index, pictures in groupby(file_pictures(recipe), key=lambda one: one.stimulus):
        spec = specs[index]
        files = [spec.file] if isinstance(spec, PictureSpec) else spec.files.values()
        own = spec.model_dump(mode="json", exclude={"name", "factors", "view"}) | spec.steps_over(recipe).steps_json()
        keys = {
            one.name: around.key(
                shared=shared,
                own=own,
                view=one.view,
                series=None if one.series is None else one.series.model_dump(mode="json", exclude={"name"}),
                contents=[around.inputs[str(file)] for file in files],
            )
            for one in pictures
        }
        yield Task(keys, make)


def _made(
    recipe: PicturesRecipe | PhotographsRecipe, around: Surroundings, report: Progress, names: Collection[str]
) -> Iterator[Made]:
    return make_pictures(recipe, around.folder, around.pixel_pitch_mm, report, around.setup, names)
