"""What the stimuli of a recipe are called and what sets them apart, known before any is built."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from stimuli.build.stimulus_set import Factors
from stimuli.recipes.photographs import PhotographSpec, PhotographsRecipe
from stimuli.recipes.recipe import AnyRecipe, PictureSpec, PicturesRecipe, SparklePlateRecipe
from stimuli.recipes.series_recipe import NamedPlateSpec, SeriesSpec, SparkleSeriesRecipe, series_name
from stimuli.recipes.values import View

__all__ = [
    "FilePicture",
    "SeriesPicture",
    "file_pictures",
    "series_pictures",
    "stimulus_factors",
    "stimulus_name",
    "stimulus_names",
]


@dataclass(frozen=True, slots=True)
class SeriesPicture:
    """One stimulus of a `SparkleSeriesRecipe`."""

    name: str
    plate: NamedPlateSpec
    series: SeriesSpec
    exposure_s: float
    view: View

    @property
    def factors(self) -> Factors:
        """What sets it apart from its recipe's other stimuli."""
        return {
            "paint": self.plate.name,
            "series": self.series.name,
            "exposure_s": self.exposure_s,
            "view": self.view,
        }


@dataclass(frozen=True, slots=True)
class FilePicture:
    """One stimulus of a `PicturesRecipe` or a `PhotographsRecipe`; ``stimulus`` counts from 0."""

    name: str
    stimulus: int
    series: SeriesSpec | None
    view: View | None
    factors: Factors


def stimulus_name(name: str, view: View | None) -> str:
    """Return the name of the stimulus that shows ``name`` in ``view``, or as it is stored."""
    return f"{name}-{view}" if view else name


def file_pictures(recipe: PicturesRecipe | PhotographsRecipe) -> tuple[FilePicture, ...]:
    """Return the stimuli of ``recipe``: stimulus by stimulus, series by series, view by view.

    Without views, photographs with a left and a right one are stereo; of a file it is not known before it is read.
    """
    series: tuple[SeriesSpec | None, ...] = recipe.series or (None,)
    views: tuple[View | None, ...] = recipe.views or (None,)
    made = []
    stimuli: tuple[PictureSpec | PhotographSpec, ...] = recipe.stimuli
    for (index, one), changed, view in product(enumerate(stimuli), series, views):
        name = f"{one.name}-{changed.name}" if changed else one.name
        factors: dict[str, str | float] = {"image": one.name}
        shown = view
        if isinstance(one, PhotographSpec):
            if shown is None and one.file is None:
                shown = "stereo" if one.left and one.right else "flat"
        elif shown is None:
            shown = one.view
        if changed:
            factors["series"] = changed.name
        if shown:
            factors["view"] = shown
        made.append(FilePicture(stimulus_name(name, view), index, changed, shown, {**factors, **one.factors}))
    return tuple(made)


def series_pictures(recipe: SparkleSeriesRecipe) -> tuple[SeriesPicture, ...]:
    """Return the stimuli of ``recipe``: plate by plate, series by series, from exposure to exposure."""
    views: tuple[View | None, ...] = recipe.views or (None,)
    return tuple(
        SeriesPicture(
            stimulus_name(series_name(plate.name, series.name, exposure_s), view),
            plate,
            series,
            exposure_s,
            view or "stereo",
        )
        for plate, series, exposure_s, view in product(recipe.plates, recipe.series, recipe.exposures_s, views)
    )


def stimulus_factors(recipe: AnyRecipe) -> dict[str, Factors]:
    """Return the factors of each stimulus that ``recipe`` makes, by name, in its order.

    A picture from a file that is shown as it is stored has no ``view`` before it is read; a built set knows it.
    """
    if isinstance(recipe, SparkleSeriesRecipe):
        return {picture.name: picture.factors for picture in series_pictures(recipe)}
    if isinstance(recipe, SparklePlateRecipe):
        return {
            stimulus_name(one.name, view): {
                "image": one.name,
                "view": view,
                "exposure_s": one.exposure_s,
                "luminance_scale": one.luminance_scale,
            }
            for one, view in product(recipe.stimuli, recipe.views)
        }
    return {picture.name: picture.factors for picture in file_pictures(recipe)}


def stimulus_names(recipe: AnyRecipe) -> tuple[str, ...]:
    """Return the names of all stimuli that ``recipe`` makes, in its order."""
    return tuple(stimulus_factors(recipe))
