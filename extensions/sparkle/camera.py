"""From sparkles to a camera's readings: the lens spreads them over pixels, the sensor's channels fill, and stay full.

A flake is far smaller than what the lens resolves: it is a point whose light falls on pixels as a Gaussian integrated
over each pixel's area, cut at four standard deviations beyond its pixel and scaled back to keep all its light. The
plate is drawn tile by tile, and tiles without sparkles are not visited.

In place of a lens, the optics of a mean human eye may spread the light by its pupil [Watson2013]. A camera's picture is
seen by an observer's own eye, which spreads its light again: this is for looking at a plate as an eye does, not for
pictures that are shown to one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from documents import in_threads
from documents.arrays import Floats
from extensions.sparkle.cull import TILE_PX, tiles_of
from extensions.sparkle.light import PlateLight
from extensions.sparkle.optics import Sparkles
from extensions.sparkle.scene import Camera, Noise, Plate

# Flakes splatted at a time: the weights of a block stay in memory that the processor's cache can hold.
_BLOCK = 8192
# Tiles drawn before their light is added to the plate's.
_TILES = 64

WAVELENGTH_NM = 555.0


def splat(sparkles: Sparkles, plate: Plate, camera: Camera, tile_px: int = TILE_PX) -> tuple[NDArray[np.float32], int]:
    """Return the luminance that sparkles add to each camera pixel, in cd/m², and how many tiles had any.

    The luminance is float32 (rows, columns). Where tiles begin makes no difference but in its last digit.
    """
    tiles = tiles_of(plate, camera, tile_px)
    columns, rows = tiles.columns_px, tiles.rows_px
    column_mm, row_mm = plate.width_mm / columns, plate.height_mm / rows
    across = (sparkles.x_mm + 0.5 * plate.width_mm) / column_mm
    down = (0.5 * plate.height_mm - sparkles.y_mm) / row_mm
    # A sparkle's luminance times its area is shared out over pixels, whose luminance is the sum per pixel's area.
    light = sparkles.luminance_cd_m2 * sparkles.area_mm2 / (column_mm * row_mm)
    reach = int(np.ceil(4.0 * camera.point_spread_sd_px))
    offsets = np.arange(-reach, reach + 1)
    # A sparkle beyond the border belongs to the pixel next to it outside, and spreads from there.
    margin = reach + 1
    padded = np.zeros((rows + 2 * margin, columns + 2 * margin))
    tile = tiles.of_pixels(across, down)
    order = np.argsort(tile, kind="stable")
    ends = np.cumsum(np.bincount(tile, minlength=len(tiles)))
    starts = np.append(0, ends[:-1])
    lit = np.flatnonzero(starts < ends)

    def drawn(index: int) -> tuple[slice, slice, Floats]:
        """Return where in the padded plate a tile's light falls, and that light."""
        start, end = starts[index], ends[index]
        top, left = index // tiles.columns * tile_px, index % tiles.columns * tile_px
        height = min(tile_px, rows - top) + 2 * margin
        width = min(tile_px, columns - left) + 2 * margin
        added = np.zeros(height * width)
        for first in range(start, end, _BLOCK):
            part = order[first : min(first + _BLOCK, end)]
            column, horizontal = _weights(across[part], columns, offsets, camera.point_spread_sd_px)
            row, vertical = _weights(down[part], rows, offsets, camera.point_spread_sd_px)
            vertical *= light[part, None]
            places = (row[:, None] - top + offsets + margin)[:, :, None] * width
            places = places + (column[:, None] - left + offsets + margin)[:, None, :]
            added += np.bincount(places.ravel(), (vertical[:, :, None] * horizontal[:, None, :]).ravel(), len(added))
        return slice(top, top + height), slice(left, left + width), added.reshape(height, width)

    # Tiles overlap by what the lens spreads: their light is added in their order, whichever thread drew them.
    for first in range(0, len(lit), _TILES):
        for down_px, across_px, added in in_threads(drawn, lit[first : first + _TILES].tolist()):
            padded[down_px, across_px] += added
    return padded[margin : margin + rows, margin : margin + columns].astype(np.float32), len(lit)


def _weights(
    place_px: NDArray[np.float64], pixels: int, offsets: NDArray[np.int64], sd_px: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the pixel (n,) that holds each place, and the shares (n, k) of its light in the pixels around it."""
    from scipy.special import ndtr

    pixel = np.clip(np.floor(place_px), -1, pixels).astype(np.int64)
    edges = np.append(offsets, offsets[-1] + 1)
    # The Gaussian's share between a pixel's edges is the difference of its integral; the cut tails are shared out.
    below = ndtr((pixel[:, None] + edges - place_px[:, None]) / sd_px)
    shares = np.diff(below, axis=1)
    shares /= shares.sum(axis=1, keepdims=True)
    return pixel, shares


def eye_mtf(cycles_per_degree: NDArray[np.float64], pupil_mm: float) -> NDArray[np.float64]:
    """Return the eye's modulation transfer, 1 at 0, at each frequency, for a pupil of 2 to 6 mm in white light.

    (1 + (u/u₁)²)^−0.62 · √D with u₁ = 21.95 − 5.512 d + 0.3922 d² and D the transfer of a perfect lens of pupil d.
    """
    first = 21.95 - 5.512 * pupil_mm + 0.3922 * pupil_mm**2
    # Of a perfect lens: cut off at d/λ, 2/π (arccos x − x √(1 − x²)) below.
    limit = pupil_mm * np.pi * 1e6 / (WAVELENGTH_NM * 180.0)
    share = np.minimum(cycles_per_degree / limit, 1.0)
    perfect = 2.0 / np.pi * (np.arccos(share) - share * np.sqrt(1.0 - share**2))
    return np.asarray((1.0 + (cycles_per_degree / first) ** 2) ** -0.62 * np.sqrt(np.maximum(perfect, 0.0)))


def through_the_eye(luminance: NDArray[np.float32], camera: Camera) -> NDArray[np.float32]:
    """Return ``luminance`` (rows, columns) on the camera's grid as an eye of the camera's pupil spreads it.

    Outside of the plate it is dark, and light that falls there is lost.
    """
    from scipy.fft import fftfreq, irfft2, next_fast_len, rfft2, rfftfreq

    if camera.pupil_mm is None:
        return luminance
    px_per_degree = camera.resolution_px_per_mm * camera.distance_mm * np.tan(np.radians(1.0))
    rows, columns = luminance.shape
    margin = int(np.ceil(px_per_degree))
    shape = next_fast_len(rows + margin, real=True), next_fast_len(columns + margin, real=True)
    down = fftfreq(shape[0]) * px_per_degree
    across = rfftfreq(shape[1]) * px_per_degree
    transfer = eye_mtf(np.hypot(across[None, :], down[:, None]), camera.pupil_mm).astype(np.float32)
    spread = irfft2(rfft2(luminance, shape) * transfer, shape)[:rows, :columns]
    return np.maximum(spread, np.float32(0)).astype(np.float32)


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
    light: PlateLight, exposure_s: float, sensor: Sensor, noise: Noise | None = None, noise_seed: Sequence[int] = (0,)
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
