"""The sensor: three channels that fill, and stay full; and the noise of their readings, if there is any."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stimuli.sparkle.light import Light
from stimuli.sparkle.scene import Camera, Noise

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
    light: Light, exposure_s: float, sensor: Sensor, noise: Noise | None = None, noise_seed: Sequence[int] = (0,)
) -> tuple[NDArray[np.float32], ...]:
    """Return the fill of the three channels, 1 where full, float32 (rows, columns) each.

    Without ``noise`` no fill is below 0. With it, electrons are Poisson, readings Gaussian about them: they may fall
    below 0, and are full where the light fills the channel.
    """
    columns, rows = light.grid_px
    constant = np.zeros(3)
    maps: list[tuple[NDArray[np.float32], Floats]] = []
    for term in light.terms:
        gain = sensor.raw_from_XYZ @ np.array(term.colour.XYZ)
        if isinstance(term.luminance_cd_m2, float):
            constant += gain * term.luminance_cd_m2 * exposure_s
        else:
            maps.append((term.luminance_cd_m2, gain * exposure_s))
    channels = []
    for channel in range(3):
        fill = np.zeros((rows, columns), np.float32) if not maps else maps[0][0] * np.float32(maps[0][1][channel])
        for luminance, gain in maps[1:]:
            fill += luminance * np.float32(gain[channel])
        fill += np.float32(constant[channel])
        np.clip(fill, np.float32(0), np.float32(1), out=fill)
        if noise is not None:
            fill = _noisy(fill, noise, np.random.default_rng([*noise_seed, channel]))
        channels.append(fill)
    return tuple(channels)


def _noisy(fill: NDArray[np.float32], noise: Noise, random: np.random.Generator) -> NDArray[np.float32]:
    """Return a reading of ``fill``: shot noise of its electrons, then the reading's own, cut where the channel ends."""
    electrons = random.poisson(fill.astype(np.float64) * noise.full_well_electrons).astype(np.float32)
    electrons += np.float32(noise.read_noise_electrons) * random.standard_normal(fill.shape, dtype=np.float32)
    read = np.minimum(electrons / np.float32(noise.full_well_electrons), np.float32(1))
    read[fill >= 1] = 1
    return np.asarray(read, dtype=np.float32)
