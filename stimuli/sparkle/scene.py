"""What stands in front of the camera: plate, lamp and the camera itself.

Millimetres; x to the right, y up, z from the plate's surface towards the camera; the origin is the plate's middle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Row = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Plate:
    """A painted plate. Flake diameters are lognormal between two bounds, flake slopes Gaussian about the normal.

    ``flake_diameter_spread`` is the standard deviation of ln(diameter); ``tilt_sd_deg`` that of each slope's angle;
    ``lobe_sd_deg`` says how far a flake's own surface strays from its mean normal. ``base_reflectance`` is that of
    what lies between the flakes, taken as matt. ``flake_chromaticity_xy`` is that of the lamp's light once it has gone
    through the coat to a flake and back; None if the coat is colourless, so that it is the lamp's own.
    """

    width_mm: float
    height_mm: float
    flakes_per_mm2: float
    flake_diameter_median_um: float
    flake_diameter_spread: float
    flake_diameter_min_um: float
    flake_diameter_max_um: float
    flake_depth_max_um: float
    flake_reflectance: float
    tilt_sd_deg: float
    lobe_sd_deg: float
    coat_refractive_index: float
    base_reflectance: float
    base_chromaticity_xy: tuple[float, float]
    flake_chromaticity_xy: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Lamp:
    """A far lamp. ``illuminance_lx`` is what a meter lying on the plate reads; the zenith is the plate's normal."""

    illuminance_lx: float
    chromaticity_xy: tuple[float, float]
    zenith_deg: float
    azimuth_deg: float
    angular_radius_deg: float

    @property
    def direction(self) -> Floats:
        """Unit vector (3,) from the plate to the lamp."""
        zenith, azimuth = np.radians(self.zenith_deg), np.radians(self.azimuth_deg)
        return np.array([np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)])


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera moved sideways between the views, its frustum off axis: zero parallax at the plate's surface.

    ``point_spread_sd_px`` is that of a Gaussian, in camera pixels. ``full_well_cd_s_m2`` is the luminance times
    exposure of a pixel whose channels are all full. ``raw_from_XYZ`` maps XYZ to the sensor's channels.
    """

    distance_mm: float
    interpupillary_distance_mm: float
    resolution_px_per_mm: float
    point_spread_sd_px: float
    full_well_cd_s_m2: float
    raw_from_XYZ: tuple[Row, Row, Row]

    def position_mm(self, eye: str) -> Floats:
        """Where the lens stands, (3,), for ``left``, ``right`` or ``center``."""
        side = {"left": -0.5, "center": 0.0, "right": 0.5}[eye]
        return np.array([side * self.interpupillary_distance_mm, 0.0, self.distance_mm])

    def grid_px(self, plate: Plate) -> tuple[int, int]:
        """Columns and rows of camera pixels that the plate covers."""
        return (
            max(1, round(plate.width_mm * self.resolution_px_per_mm)),
            max(1, round(plate.height_mm * self.resolution_px_per_mm)),
        )
