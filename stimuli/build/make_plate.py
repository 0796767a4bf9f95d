"""Stimuli from the sparkle-plate generator: photographs of one plate."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np

from stimuli.build.made import Made
from stimuli.build.progress import Progress
from stimuli.build.studio import Studio
from stimuli.pictures.stereo_image import StereoImage, XYZImage
from stimuli.recipes.names import stimulus_factors, stimulus_name
from stimuli.recipes.recipe import SparklePlateRecipe


def make_plate(
    recipe: SparklePlateRecipe,
    pixel_pitch_mm: float,
    report: Progress,
    names: Collection[str] | None = None,
) -> Iterator[Made]:
    """Yield the recipe's stimuli, or those of ``names``, each sampled for a display of ``pixel_pitch_mm``.

    Each viewpoint's sparkles are rendered once, and each exposure of them is developed once, however many stimuli
    show them.
    """
    studio = Studio(recipe.plate, recipe.lamp, recipe.camera, recipe.seed, pixel_pitch_mm, recipe.further_lamps)
    factors = stimulus_factors(recipe)
    wanted = [
        (stimulus, view)
        for stimulus in recipe.stimuli
        for view in recipe.views
        if names is None or stimulus_name(stimulus.name, view) in names
    ]
    for done, (stimulus, view) in enumerate(wanted):
        name = stimulus_name(stimulus.name, view)
        report(f"rendering {name}", done, len(wanted))
        scale = np.float32(stimulus.luminance_scale)
        scaled: list[XYZImage] = [one.xyz_cd_m2 * scale for one in studio.photographs(view, stimulus.exposure_s)]
        steps = (
            *studio.steps(view, stimulus.exposure_s),
            {"step": "scale", "luminance_scale": stimulus.luminance_scale},
        )
        yield Made(name, StereoImage(scaled[0], scaled[-1]), factors[name], steps)
    report("done", len(wanted), len(wanted))
