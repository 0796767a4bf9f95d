"""Stimuli from series of exposures of made-up plates."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterator
from itertools import groupby

from documents import Finding
from stimuli.build.in_series import in_series, series_steps
from stimuli.build.made import Made
from stimuli.build.progress import Progress
from stimuli.build.studio import Studio
from stimuli.errors import StimulusError
from stimuli.luminance.scale import factor_to, mean_luminance_cd_m2
from stimuli.pictures.stereo_image import StereoImage
from stimuli.recipes.names import SeriesPicture, series_pictures
from stimuli.recipes.series_recipe import SparkleSeriesRecipe


def make_series(
    recipe: SparkleSeriesRecipe,
    pixel_pitch_mm: float,
    report: Progress,
    names: Collection[str] | None = None,
) -> Iterator[Made]:
    """Yield the recipe's stimuli, or those of ``names``, each sampled for a display of ``pixel_pitch_mm``.

    The sparkles of each plate and viewpoint are rendered once, and each exposure of them is developed once, whatever
    series show them. No more than one plate's photographs are held at a time.

    Raises
    ------
    StimulusError
        If a plate sends no light, so that nothing can bring it to the target luminance.
    """
    pictures = [one for one in series_pictures(recipe) if names is None or one.name in names]
    done = 0
    for named, of_plate in groupby(pictures, key=lambda picture: picture.plate):
        seed = plate_seed(recipe.seed, named.name)
        plate = named.over(recipe.plate)
        studio = Studio(plate, recipe.lamp, recipe.camera, seed, pixel_pitch_mm, recipe.further_lamps)
        for picture in of_plate:
            report(f"rendering {picture.name}", done, len(pictures))
            yield _made(picture, studio, recipe.target_mean_luminance_cd_m2)
            done += 1
    report("done", done, done)


def plate_seed(seed: int, plate: str) -> int:
    """Return the seed of a plate by its name: other plates, or another order of them, leave its flakes alone."""
    return int.from_bytes(hashlib.sha256(f"{seed}/{plate}".encode()).digest()[:8]) >> 1


def _made(picture: SeriesPicture, studio: Studio, target_cd_m2: float) -> Made:
    views = [one.xyz_cd_m2 for one in studio.photographs(picture.view, picture.exposure_s)]
    # One factor for both eyes: what one sees brighter than the other stays so.
    mean_cd_m2 = mean_luminance_cd_m2(StereoImage(views[0], views[-1]))
    if mean_cd_m2 <= 0:
        remedy = "give it a base or flakes that reflect, and a lamp that shines"
        raise StimulusError(Finding(f"the plate '{picture.plate.name}' sends no light", remedy=remedy))
    adapted = factor_to(mean_cd_m2, target_cd_m2)
    series = picture.series
    shown = [in_series(view, adapted * series.luminance_scale, series) for view in views]
    steps = (
        *studio.steps(picture.view, picture.exposure_s),
        {"step": "adapt", "target_mean_luminance_cd_m2": target_cd_m2, "luminance_scale": adapted},
        *series_steps(series),
    )
    return Made(picture.name, StereoImage(shown[0], shown[-1]), picture.factors, steps)
