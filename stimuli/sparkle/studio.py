"""One made-up plate before the camera: every viewpoint rendered once, every exposure of it developed once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from stimuli.pictures.resolution import resolution
from stimuli.pictures.stereo_image import View
from stimuli.sparkle.flakes import scatter_flakes
from stimuli.sparkle.light import Light
from stimuli.sparkle.photograph import Photograph, photograph, plate_light
from stimuli.sparkle.recipe import CameraSpec, LampSpec, PlateSpec


def viewpoints(view: View) -> tuple[str, ...]:
    """Return where the camera stands for ``view``: a flat picture needs one place only."""
    return ("left", "right") if view == "stereo" else ("center",)


Place = tuple[float, ...]


class Studio:
    """A plate, lamps and a camera; equal seeds scatter equal flakes. Its photographs are kept as long as it is.

    Views from one place are rendered once: with no distance between the eyes, left, right and centre are one.
    """

    def __init__(
        self,
        plate: PlateSpec,
        lamp: LampSpec,
        camera: CameraSpec,
        seed: int,
        pixel_pitch_mm: float,
        further_lamps: Sequence[LampSpec] = (),
    ) -> None:
        self._plate, self._camera = plate.plate(), camera.camera()
        self._lamps = [one.lamp() for one in (lamp, *further_lamps)]
        self._pixel_pitch_mm = pixel_pitch_mm
        self._seed = seed
        self._flakes = scatter_flakes(self._plate, seed)
        self._lights: dict[Place, Light] = {}
        self._photographs: dict[tuple[Place, float], Photograph] = {}

    def photographs(self, view: View, exposure_s: float) -> tuple[Photograph, ...]:
        """Return the photographs of each of the view's viewpoints, in absolute XYZ on the display's pixels."""
        return tuple(self._photograph(eye, exposure_s) for eye in viewpoints(view))

    def steps(self, view: View, exposure_s: float) -> tuple[Mapping[str, Any], ...]:
        """Return what led to those photographs, for the manifest."""
        eyes = viewpoints(view)
        taken = {eye: self._photograph(eye, exposure_s) for eye in eyes}
        expose: dict[str, Any] = {
            "step": "expose",
            "exposure_s": exposure_s,
            "saturated_percent": {
                eye: dict(zip(("red", "green", "blue"), one.saturated_percent, strict=True))
                for eye, one in taken.items()
            },
        }
        if self._camera.noise is not None:
            expose["below_black_percent"] = {eye: one.below_black_percent for eye, one in taken.items()}
        return (
            {
                "step": "render",
                "seed": self._seed,
                "places": len({self._place(eye) for eye in eyes}),
                "views": {eye: dict(self._light(eye).counts) for eye in eyes},
            },
            expose,
            self._resampled(),
        )

    def _resampled(self) -> Mapping[str, Any]:
        """Return the step to the display's pixels, and what they lose, seen from where the camera stood."""
        size_mm = (self._plate.width_mm, self._plate.height_mm)
        kept = resolution(self._camera.grid_px(self._plate), size_mm, self._pixel_pitch_mm, self._camera.distance_mm)
        step = {"step": "resample", "pixel_pitch_mm": self._pixel_pitch_mm, "size_mm": list(size_mm), "filter": "area"}
        return {**step, "resolution": kept.to_json(), "said": list(kept.sentences())}

    def _place(self, eye: str) -> Place:
        return tuple(self._camera.position_mm(eye).tolist())

    def _photograph(self, eye: str, exposure_s: float) -> Photograph:
        key = (self._place(eye), exposure_s)
        if key not in self._photographs:
            light, noise_seed = self._light(eye), (self._seed, *f"{eye}/{exposure_s!r}".encode())
            self._photographs[key] = photograph(light, self._camera, exposure_s, self._pixel_pitch_mm, noise_seed)
        return self._photographs[key]

    def _light(self, eye: str) -> Light:
        place = self._place(eye)
        if place not in self._lights:
            self._lights[place] = plate_light(self._plate, self._lamps, self._camera, eye, self._flakes)
        return self._lights[place]
