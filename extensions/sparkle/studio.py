"""From a plate, lamps and a camera to photographs in absolute XYZ on the display's grid.

A `Studio` renders every viewpoint once, and develops every exposure of it once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from devices.colour_matching import DEFAULT_OBSERVER
from extensions.sparkle.camera import expose, sensor_of, splat, through_the_eye
from extensions.sparkle.cull import LEAST_LOBE_SHARE, TILE_PX, lit, that_matter, tiles_of
from extensions.sparkle.flakes import Flakes, scatter_flakes
from extensions.sparkle.light import LightTerm, PlateLight, colour_under, flop_luminance, gathered, matt_luminance
from extensions.sparkle.optics import shade
from extensions.sparkle.painted_plate import PaintedPlateSpec
from extensions.sparkle.scene import Camera, Lamp, Plate
from stimuli.pictures import XYZImage, display_resolution, resample_maps
from stimuli.recipes import View


def viewpoints(view: View) -> tuple[str, ...]:
    """Return where the camera stands for ``view``: a flat picture needs one place only."""
    return ("left", "right") if view == "stereo" else ("center",)


Place = tuple[float, ...]


class Studio:
    """A plate, lamps and a camera, photographed by a renderer; equal seeds scatter equal flakes.

    Every viewpoint is rendered once and every exposure of it developed once. With no distance between the eyes, left,
    right and centre are one viewpoint.

    Parameters
    ----------
    plate, lamp, camera, further_lamps
        As a recipe of the kind ``sparkle_plate`` has them.
    seed
        Of the flakes and the noise.
    pixel_pitch_mm
        The pixel pitch of the display for which photographs are resampled.
    observer
        The colorimetric observer of the photographs' XYZ, and of chromaticities in ``plate`` and lamps.

    Examples
    --------
    >>> from pathlib import Path
    >>> from stimuli.recipes import read_recipe
    >>> recipe, _ = read_recipe(Path("configs/stimuli/manitoba_gray.yaml"))
    >>> plate = recipe.plate.model_copy(update={"size_mm": (10.0, 5.0)})
    >>> studio = Studio(plate, recipe.lamp, recipe.camera, recipe.seed, pixel_pitch_mm=0.25)
    >>> left, right = studio.photographs("stereo", exposure_s=1.0)
    >>> left.xyz_cd_m2.shape                              # XYZ in cd/m² on the display's pixels
    (20, 40, 3)
    """

    def __init__(
        self,
        plate: PaintedPlateSpec,
        lamp: Lamp,
        camera: Camera,
        seed: int,
        pixel_pitch_mm: float,
        further_lamps: Sequence[Lamp] = (),
        *,
        observer: str = DEFAULT_OBSERVER,
    ) -> None:
        self._plate, self._camera = plate.plate(), camera
        self._lamps = lamp, *further_lamps
        self._observer = observer
        self._pixel_pitch_mm = pixel_pitch_mm
        self._seed = seed
        self._flakes = scatter_flakes(self._plate, seed)
        self._lights: dict[Place, PlateLight] = {}
        self._photographs: dict[tuple[Place, float], Photograph] = {}

    def photographs(self, view: View, exposure_s: float) -> tuple[Photograph, ...]:
        """Return the photographs of each of the view's viewpoints, in absolute XYZ on the display's pixels."""
        return tuple(self._photograph(eye, exposure_s) for eye in viewpoints(view))

    def steps(self, view: View, exposure_s: float) -> tuple[Mapping[str, Any], ...]:
        """Return the steps of those photographs, for the manifest."""
        eyes = viewpoints(view)
        taken = {eye: self._photograph(eye, exposure_s) for eye in eyes}
        expose: dict[str, Any] = {
            "step": "expose",
            "exposure_s": exposure_s,
            "saturated_percent": {
                eye: dict(zip(("red", "green", "blue"), photograph.saturated_percent, strict=True))
                for eye, photograph in taken.items()
            },
        }
        if self._camera.noise is not None:
            expose["below_black_percent"] = {eye: photograph.below_black_percent for eye, photograph in taken.items()}
        return (
            {
                "step": "render",
                "seed": self._seed,
                "places": len({self._place(eye) for eye in eyes}),
                "views": {eye: dict(self._light(eye).counts) for eye in eyes},
                **({} if self._observer == DEFAULT_OBSERVER else {"observer": self._observer}),
            },
            expose,
            self._resampled(),
        )

    def _resampled(self) -> Mapping[str, Any]:
        """Return the step to the display's pixels, and what they lose, seen from where the camera stood."""
        size_mm = (self._plate.width_mm, self._plate.height_mm)
        grid_px, distance_mm = self._camera.grid_px(self._plate), self._camera.distance_mm
        kept = display_resolution(grid_px, size_mm, self._pixel_pitch_mm, distance_mm)
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

    def _light(self, eye: str) -> PlateLight:
        place = self._place(eye)
        if place not in self._lights:
            scene = self._plate, self._lamps, self._camera
            self._lights[place] = plate_light(*scene, eye, self._flakes, self._observer)
        return self._lights[place]


@dataclass(frozen=True, eq=False, slots=True)
class SparkleMap:
    """The light of flakes for one viewpoint and lamp: cd/m² (rows, columns), and how much work that was.

    Of ``flakes``, ``shaded`` may send light to the eye by their slopes and ``splatted`` do; of ``tiles``, light reaches
    ``tiles_lit``, and ``tiles_visited`` have any of these flakes.
    """

    COUNTED: ClassVar[tuple[str, ...]] = ("flakes", "shaded", "splatted", "tiles", "tiles_lit", "tiles_visited")

    luminance_cd_m2: NDArray[np.float32]
    flakes: int
    shaded: int
    splatted: int
    tiles: int
    tiles_lit: int
    tiles_visited: int

    @property
    def counts(self) -> dict[str, int]:
        """The work by name, for a manifest."""
        return {name: getattr(self, name) for name in self.COUNTED}


@dataclass(frozen=True, eq=False, slots=True)
class Photograph:
    """A photograph in XYZ (cd/m²) on the display's grid, and the percentage of full camera pixels per channel.

    ``below_black_percent`` of the display's pixels had XYZ below 0 by noise, which was set to 0.
    """

    xyz_cd_m2: XYZImage
    saturated_percent: tuple[float, float, float]
    below_black_percent: float = 0.0


def sparkle_map(
    plate: Plate,
    lamp: Lamp,
    camera: Camera,
    eye: str,
    flakes: Flakes,
    *,
    cull: bool = True,
    least_share: float = LEAST_LOBE_SHARE,
    tile_px: int = TILE_PX,
) -> SparkleMap:
    """Return the light of ``flakes`` for ``left``, ``right`` or ``center``; without ``cull``, by brute force.

    Flakes that send less than ``least_share`` of their lobe's peak, or get less than that of the light in the plate's
    middle, are left out.
    """
    position, tiles = camera.position_mm(eye), tiles_of(plate, camera, tile_px)
    kept = flakes.chosen(that_matter(flakes, plate, lamp, position, tiles, least_share)) if cull else flakes
    sparkles = shade(kept, plate, lamp, position)
    if cull:
        sparkles = sparkles.chosen(sparkles.lobe_share >= least_share)
    luminance, visited = splat(sparkles, plate, camera, tile_px)
    seen = through_the_eye(luminance, camera)
    tiles_lit = int(lit(tiles, lamp, least_share).sum()) if cull else len(tiles)
    return SparkleMap(seen, len(flakes), len(kept), len(sparkles.x_mm), len(tiles), tiles_lit, visited)


def plate_light(
    plate: Plate,
    lamps: Sequence[Lamp],
    camera: Camera,
    eye: str,
    flakes: Flakes,
    observer: str = DEFAULT_OBSERVER,
) -> PlateLight:
    """Return the light of base and flakes under all lamps as it reaches one viewpoint.

    Parameters
    ----------
    plate, lamps, camera
        The scene. A lamp without light is left out, and a plate without flakes has no map of them.
    eye
        ``left``, ``right`` or ``center``.
    flakes
        The flakes of the plate: see `scatter_flakes`.
    observer
        The colorimetric observer of the light's XYZ, and of chromaticities in ``plate`` and lamps.

    Returns
    -------
    PlateLight
        Luminance in cd/m² and colour at each camera pixel, from which XYZ and spectral bands follow.

    Raises
    ------
    StimulusError
        If the plate has spectra and a lamp has none.

    Examples
    --------
    >>> from pathlib import Path
    >>> from stimuli.recipes import read_recipe
    >>> recipe, _ = read_recipe(Path("configs/stimuli/manitoba_gray.yaml"))
    >>> plate = recipe.plate.model_copy(update={"size_mm": (10.0, 5.0)}).plate()
    >>> flakes = scatter_flakes(plate, seed=1)
    >>> light = plate_light(plate, [recipe.lamp], recipe.camera, "left", flakes)
    >>> light.size_mm, light.counts["lamps"], light.counts["flakes"] == len(flakes)
    ((10.0, 5.0), 1, True)
    """
    terms: list[LightTerm] = []
    counts = Counter(dict.fromkeys(("lamps", *SparkleMap.COUNTED), 0))
    for lamp in lamps:
        if lamp.illuminance_lx == 0:
            continue
        counts["lamps"] += 1
        share, colour = colour_under(lamp, plate.base_chromaticity_xy, plate.base_spectrum, observer)
        terms.append(LightTerm(_times(matt_luminance(plate, lamp, camera), share), colour))
        flakes_share, flakes_colour = colour_under(lamp, plate.flake_chromaticity_xy, plate.flake_spectrum, observer)
        flop_colour = flakes_colour
        flop_share = flakes_share
        if plate.flop_chromaticity_xy is not None:
            flop_share, flop_colour = colour_under(lamp, plate.flop_chromaticity_xy, None, observer)
        flop = flop_luminance(plate, lamp, camera, camera.position_mm(eye))
        terms.append(LightTerm(_times(flop, flop_share), flop_colour))
        if len(flakes) and plate.flake_reflectance > 0:
            sparkles = sparkle_map(plate, lamp, camera, eye, flakes)
            counts.update(sparkles.counts)
            terms.append(LightTerm(_times(sparkles.luminance_cd_m2, flakes_share), flakes_colour))
    return PlateLight(gathered(terms), camera.grid_px(plate), (plate.width_mm, plate.height_mm), dict(counts))


def photograph(
    light: PlateLight, camera: Camera, exposure_s: float, pixel_pitch_mm: float, noise_seed: Sequence[int] = (0,)
) -> Photograph:
    """Expose the sensor to the light, take its reading back to XYZ, and resample once, in linear light.

    Noise, where the camera has any, is drawn for each ``noise_seed``.
    """
    sensor = sensor_of(camera)
    channels = expose(light, exposure_s, sensor, camera.noise, noise_seed)
    # The way from the channels to XYZ is linear: resampling first does it for fewer pixels, with the same outcome.
    small = resample_maps(channels, light.size_mm, pixel_pitch_mm)
    xyz = small @ sensor.XYZ_from_raw.T / exposure_s
    red, green, blue = (100.0 * float(np.mean(channel >= 1.0)) for channel in channels)
    below = 0.0
    if camera.noise is not None:
        below = 100.0 * float(np.mean((xyz < 0).any(axis=-1)))
        xyz = np.maximum(xyz, 0.0)
    return Photograph(xyz.astype(np.float32), (red, green, blue), below)


def _times(luminance: NDArray[np.float32] | float, share: float) -> NDArray[np.float32] | float:
    if share == 1.0:
        return luminance
    return luminance * share if isinstance(luminance, float) else luminance * np.float32(share)
