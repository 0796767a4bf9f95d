"""From a plate, a lamp and a camera to photographs in absolute XYZ on the display's grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.colour import XYZ_from_xyY
from stimuli.resample import area_weights, resample
from stimuli.sparkle.cull import LEAST_LOBE_SHARE, can_matter
from stimuli.sparkle.flakes import Flakes
from stimuli.sparkle.optics import shade
from stimuli.sparkle.scene import Camera, Lamp, Plate
from stimuli.sparkle.sensor import expose, sensor_of
from stimuli.sparkle.splat import splat
from stimuli.stereo_image import XYZImage


@dataclass(frozen=True, eq=False, slots=True)
class SparkleMap:
    """What flakes add to the plate for one viewpoint: cd/m² (rows, columns), and how much work that was.

    Of ``flakes``, ``shaded`` may send light to the eye by their slopes and ``splatted`` do.
    """

    luminance_cd_m2: NDArray[np.float32]
    flakes: int
    shaded: int
    splatted: int

    @property
    def counts(self) -> dict[str, int]:
        """The work by name, for a manifest."""
        return {"flakes": self.flakes, "shaded": self.shaded, "splatted": self.splatted}


@dataclass(frozen=True, eq=False, slots=True)
class Photograph:
    """A photograph in XYZ (cd/m²) on the display's grid, and the percentage of full camera pixels per channel."""

    xyz_cd_m2: XYZImage
    saturated_percent: tuple[float, float, float]


def sparkle_map(plate: Plate, lamp: Lamp, camera: Camera, eye: str, flakes: Flakes, *, cull: bool = True) -> SparkleMap:
    """Return what ``flakes`` add for ``left``, ``right`` or ``center``; without ``cull``, by brute force."""
    position = camera.position_mm(eye)
    kept = flakes.chosen(can_matter(flakes, plate, lamp, position)) if cull else flakes
    sparkles = shade(kept, plate, lamp, position)
    if cull:
        sparkles = sparkles.chosen(sparkles.lobe_share >= LEAST_LOBE_SHARE)
    return SparkleMap(splat(sparkles, plate, camera), len(flakes), len(kept), len(sparkles.x_mm))


def photograph(
    sparkles: SparkleMap, plate: Plate, lamp: Lamp, camera: Camera, exposure_s: float, pixel_pitch_mm: float
) -> Photograph:
    """Expose the sensor to base and sparkles, take its reading back to XYZ, and resample once, in linear light."""
    sensor = sensor_of(camera)
    base_luminance = plate.base_reflectance * lamp.illuminance_lx / np.pi
    base = XYZ_from_xyY([*plate.base_chromaticity_xy, base_luminance])
    sparkle_XYZ = XYZ_from_xyY([*(plate.flake_chromaticity_xy or lamp.chromaticity_xy), 1.0])
    channels = expose(base, sparkle_XYZ, sparkles.luminance_cd_m2, exposure_s, sensor)
    columns = area_weights(channels[0].shape[1], plate.width_mm, pixel_pitch_mm)
    rows = area_weights(channels[0].shape[0], plate.height_mm, pixel_pitch_mm)
    # The way from the channels to XYZ is linear: resampling first does it for fewer pixels, with the same outcome.
    small = np.stack([resample(channel, rows, columns) for channel in channels], axis=-1)
    xyz = small @ sensor.XYZ_from_raw.T / exposure_s
    red, green, blue = (100.0 * float(np.mean(channel >= 1.0)) for channel in channels)
    return Photograph(xyz.astype(np.float32), (red, green, blue))
