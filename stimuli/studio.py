"""One made-up plate before the camera: every viewpoint rendered once, every exposure of it developed once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stimuli.recipe_values import View
from stimuli.sparkle.flakes import scatter_flakes
from stimuli.sparkle.photograph import Photograph, SparkleMap, photograph, sparkle_map
from stimuli.sparkle.recipe import CameraSpec, LampSpec, PlateSpec


def viewpoints(view: View) -> tuple[str, ...]:
    """Return where the camera stands for ``view``: a flat picture needs one place only."""
    return ("left", "right") if view == "stereo" else ("center",)


class Studio:
    """A plate, a lamp and a camera; equal seeds scatter equal flakes. Its photographs are kept as long as it is."""

    def __init__(self, plate: PlateSpec, lamp: LampSpec, camera: CameraSpec, seed: int, pixel_pitch_mm: float) -> None:
        self._plate, self._lamp, self._camera = plate.plate(), lamp.lamp(), camera.camera()
        self._pixel_pitch_mm = pixel_pitch_mm
        self._seed = seed
        self._flakes = scatter_flakes(self._plate, seed)
        self._sparkles: dict[str, SparkleMap] = {}
        self._photographs: dict[tuple[str, float], Photograph] = {}

    def photographs(self, view: View, exposure_s: float) -> tuple[Photograph, ...]:
        """Return the photographs of each of the view's viewpoints, in absolute XYZ on the display's pixels."""
        return tuple(self._photograph(eye, exposure_s) for eye in viewpoints(view))

    def steps(self, view: View, exposure_s: float) -> tuple[Mapping[str, Any], ...]:
        """Return what led to those photographs, for the manifest."""
        eyes = viewpoints(view)
        saturated = [self._photograph(eye, exposure_s).saturated_percent for eye in eyes]
        return (
            {"step": "render", "seed": self._seed, "views": {eye: self._sparkle_map(eye).counts for eye in eyes}},
            {
                "step": "expose",
                "exposure_s": exposure_s,
                "saturated_percent": {
                    eye: dict(zip(("red", "green", "blue"), shares, strict=True))
                    for eye, shares in zip(eyes, saturated, strict=True)
                },
            },
            {"step": "resample", "pixel_pitch_mm": self._pixel_pitch_mm},
        )

    def _photograph(self, eye: str, exposure_s: float) -> Photograph:
        key = (eye, exposure_s)
        if key not in self._photographs:
            plate, lamp, camera = self._plate, self._lamp, self._camera
            sparkles = self._sparkle_map(eye)
            self._photographs[key] = photograph(sparkles, plate, lamp, camera, exposure_s, self._pixel_pitch_mm)
        return self._photographs[key]

    def _sparkle_map(self, eye: str) -> SparkleMap:
        if eye not in self._sparkles:
            self._sparkles[eye] = sparkle_map(self._plate, self._lamp, self._camera, eye, self._flakes)
        return self._sparkles[eye]
