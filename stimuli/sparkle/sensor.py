"""The sensor: three channels that fill, and stay full."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stimuli.sparkle.scene import Camera

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False, slots=True)
class Sensor:
    """A sensor whose channels hold 1 when full.

    ``raw_from_XYZ`` (3, 3) takes XYZ times exposure, in cd·s/m², to the channels' fill. It is the camera's matrix
    scaled so that a pixel with every channel full has the luminance ``full_well_cd_s_m2`` per second of exposure:
    where that pixel's colour is not the lamp's, full highlights change their colour, as they do in a camera.
    """

    raw_from_XYZ: Floats
    XYZ_from_raw: Floats


def sensor_of(camera: Camera) -> Sensor:
    """Return the camera's sensor."""
    matrix = np.array(camera.raw_from_XYZ)
    full_luminance = np.linalg.inv(matrix)[1].sum()
    scaled = matrix * full_luminance / camera.full_well_cd_s_m2
    return Sensor(scaled, np.asarray(np.linalg.inv(scaled), dtype=np.float64))


def expose(
    base_XYZ_cd_m2: Floats,
    sparkle_XYZ: Floats,
    sparkle_cd_m2: NDArray[np.float32],
    exposure_s: float,
    sensor: Sensor,
) -> tuple[NDArray[np.float32], ...]:
    """Return the fill, 0 to 1, of the three channels, float32 (rows, columns) each.

    The light is ``base_XYZ_cd_m2`` (3,) everywhere plus the map ``sparkle_cd_m2`` (rows, columns) times
    ``sparkle_XYZ`` (3,), the XYZ of the flakes' light at Y = 1.
    """
    base = sensor.raw_from_XYZ @ base_XYZ_cd_m2 * exposure_s
    gain = sensor.raw_from_XYZ @ sparkle_XYZ * exposure_s
    channels = []
    for channel in range(3):
        fill = sparkle_cd_m2 * np.float32(gain[channel])
        fill += np.float32(base[channel])
        channels.append(np.clip(fill, np.float32(0), np.float32(1), out=fill))
    return tuple(channels)
