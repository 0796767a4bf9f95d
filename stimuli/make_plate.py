"""Stimuli from the sparkle-plate generator."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache

import numpy as np

from stimuli.make_pictures import Made
from stimuli.names import stimulus_name
from stimuli.recipe import SparklePlateRecipe
from stimuli.sparkle.flakes import scatter_flakes
from stimuli.sparkle.photograph import Photograph, SparkleMap, photograph, sparkle_map
from stimuli.stereo_image import StereoImage, XYZImage


def make_plate(
    recipe: SparklePlateRecipe, pixel_pitch_mm: float, report: Callable[[str, int, int], None]
) -> Iterator[Made]:
    """Yield the recipe's stimuli, each sampled for a display of ``pixel_pitch_mm``.

    Each viewpoint's sparkles are rendered once, and each exposure of them is developed once, however many stimuli
    show them.
    """
    plate, lamp, camera = recipe.plate.plate(), recipe.lamp.lamp(), recipe.camera.camera()
    flakes = scatter_flakes(plate, recipe.seed)

    @cache
    def sparkles(eye: str) -> SparkleMap:
        return sparkle_map(plate, lamp, camera, eye, flakes)

    @cache
    def exposed(eye: str, exposure_s: float) -> Photograph:
        return photograph(sparkles(eye), plate, lamp, camera, exposure_s, pixel_pitch_mm)

    wanted = [(stimulus, view) for stimulus in recipe.stimuli for view in recipe.views]
    for done, (stimulus, view) in enumerate(wanted):
        name = stimulus_name(stimulus.name, view)
        report(f"rendering {name}", done, len(wanted))
        eyes = ("left", "right") if view == "stereo" else ("center",)
        photographs = [exposed(eye, stimulus.exposure_s) for eye in eyes]
        scale = np.float32(stimulus.luminance_scale)
        scaled: list[XYZImage] = [one.xyz_cd_m2 * scale for one in photographs]
        steps = (
            {
                "step": "render",
                "views": {eye: _counts(sparkles(eye)) for eye in eyes},
            },
            {
                "step": "expose",
                "exposure_s": stimulus.exposure_s,
                "saturated_percent": {
                    eye: dict(zip(("red", "green", "blue"), one.saturated_percent, strict=True))
                    for eye, one in zip(eyes, photographs, strict=True)
                },
            },
            {"step": "resample", "pixel_pitch_mm": pixel_pitch_mm},
            {"step": "scale", "luminance_scale": stimulus.luminance_scale},
        )
        factors: dict[str, str | float] = {
            "image": stimulus.name,
            "view": view,
            "exposure_s": stimulus.exposure_s,
            "luminance_scale": stimulus.luminance_scale,
        }
        yield Made(name, StereoImage(scaled[0], scaled[-1]), factors, steps)
    report("done", len(wanted), len(wanted))


def _counts(sparkles: SparkleMap) -> dict[str, int]:
    return {"flakes": sparkles.flakes, "shaded": sparkles.shaded, "splatted": sparkles.splatted}
