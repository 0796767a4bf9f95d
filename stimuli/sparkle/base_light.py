"""What lies between the flakes: a matt base, and what shines in it and darkens with the angle (flop)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from stimuli.sparkle.lamplight import illuminance_lx
from stimuli.sparkle.optics import mirror
from stimuli.sparkle.scene import Camera, Lamp, Plate

Floats = NDArray[np.float64]

# Places along an axis at which a field is computed at least, and how many per stretch over which it changes.
_LEAST_NODES = 17
_NODES_PER_STRETCH = 6


def matt_luminance(plate: Plate, lamp: Lamp, camera: Camera) -> NDArray[np.float32] | float:
    """Return the matt base's luminance, reflectance · E/π: one number if the lamp is far, else (rows, columns)."""
    if lamp.distance_mm is None or plate.base_reflectance == 0:
        return plate.base_reflectance * lamp.illuminance_lx / np.pi

    def luminance(x_mm: Floats, y_mm: Floats) -> Floats:
        return np.asarray(plate.base_reflectance / np.pi * illuminance_lx(lamp, x_mm, y_mm))

    return over_pixels(luminance, plate, lamp, camera, 1.0)


def flop_luminance(plate: Plate, lamp: Lamp, camera: Camera, eye_mm: Floats) -> NDArray[np.float32] | float:
    """Return the luminance (rows, columns) of what shines in the base, as the eye at ``eye_mm`` sees it.

    Flakes too fine to be seen one by one are one mirror that lies flat: their tilts widen its lobe.
    """
    if plate.flop_reflectance == 0:
        return 0.0
    sd = float(np.radians(plate.flop_lobe_sd_deg))

    def luminance(x_mm: Floats, y_mm: Floats) -> Floats:
        flat = np.array([0.0, 0.0, 1.0])
        return mirror((x_mm, y_mm), flat, plate.flop_reflectance, sd, plate, lamp, eye_mm).luminance_cd_m2

    return over_pixels(luminance, plate, lamp, camera, sd)


def over_pixels(
    luminance: Callable[[Floats, Floats], Floats], plate: Plate, lamp: Lamp, camera: Camera, turn_rad: float
) -> NDArray[np.float32]:
    """Return a smooth ``luminance(x_mm, y_mm)`` at each camera pixel's middle, float32 (rows, columns).

    It is computed at a few places and interpolated by cubic splines, unless these places are more than the pixels. It
    changes over stretches that turn the direction to eye or lamp by ``turn_rad``, or leave the lamp's beam.
    """
    from scipy.interpolate import RectBivariateSpline

    turn = min(turn_rad, 0.5)
    per_mm = 1.0 / camera.distance_mm
    position = lamp.position_mm
    if position is not None:
        per_mm += 1.0 / position[2]
        if lamp.beam_angle_deg is not None:
            turn = min(turn, np.radians(lamp.beam_angle_deg / 2))
    columns, rows = camera.grid_px(plate)
    across = ((np.arange(columns) + 0.5) / columns - 0.5) * plate.width_mm
    up = (0.5 - (np.arange(rows) + 0.5) / rows) * plate.height_mm
    nodes_x, nodes_y = (
        max(_LEAST_NODES, int(np.ceil(_NODES_PER_STRETCH * size * per_mm / turn)))
        for size in (plate.width_mm, plate.height_mm)
    )
    if nodes_x * nodes_y >= columns * rows:
        found = np.stack([luminance(across, np.full_like(across, height)) for height in up])
    else:
        x = np.linspace(-0.5, 0.5, nodes_x) * plate.width_mm
        y = np.linspace(-0.5, 0.5, nodes_y) * plate.height_mm
        grid = np.meshgrid(x, y)
        known = luminance(grid[0].ravel(), grid[1].ravel()).reshape(grid[0].shape)
        found = np.asarray(RectBivariateSpline(y, x, known)(up[::-1], across))[::-1]
    return np.maximum(found, 0.0).astype(np.float32)
