"""The scene: plate, lamps and camera.

Millimetres; x to the right, y up, z from the plate's surface towards the camera; the origin is the plate's middle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.colour_matching import DEFAULT_OBSERVER

Floats = NDArray[np.float64]
Row = tuple[float, float, float]
Spectrum = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Clusters:
    """Conglomerates, as coarse droplets of paint leave them: ``share`` of the flakes lie in some.

    Each holds ``flakes`` on average, spread about its middle as a Gaussian of ``radius_mm``. Its flakes' slopes stray
    from the plate's normal together by ``tilt_sd_deg``, and from there each by its own.
    """

    share: float
    flakes: float
    radius_mm: float
    tilt_sd_deg: float


@dataclass(frozen=True, slots=True)
class Plate:
    """A painted plate. Flake diameters are lognormal between two bounds, flake slopes Gaussian about the normal.

    ``flake_diameter_spread`` is the standard deviation of ln(diameter); ``tilt_sd_deg`` that of each slope's angle;
    ``lobe_sd_deg`` is how far a flake's own surface strays from its mean normal. ``diffraction_nm`` is the
    wavelength at which flakes widen their lobe, the smaller the more; None where they do not. Within
    ``flake_rim_um`` of its edge a flake is no mirror. ``coat_extinction_per_mm`` dims deep flakes. With ``clusters``
    some flakes lie together; else each lies anywhere.

    ``base_reflectance`` is that of what lies between the flakes, taken as matt. ``flop_reflectance`` is that of what
    shines in it, such as flakes too fine to be seen: a lobe of ``flop_lobe_sd_deg`` about the plate's normal.

    ``flake_chromaticity_xy`` is that of the lamp's light once it has gone through the coat to a flake and back; None
    if the coat is colourless, so that it is the lamp's own. ``base_chromaticity_xy`` is that of the base's light, and
    None where ``base_spectrum`` gives it. Spectra multiply the reflectance, on the grid of `stimuli.sparkle.light`.
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
    base_chromaticity_xy: tuple[float, float] | None
    flake_chromaticity_xy: tuple[float, float] | None = None
    diffraction_nm: float | None = None
    flake_rim_um: float = 0.0
    coat_extinction_per_mm: float = 0.0
    flop_reflectance: float = 0.0
    flop_lobe_sd_deg: float = 12.0
    flop_chromaticity_xy: tuple[float, float] | None = None
    base_spectrum: Spectrum | None = None
    flake_spectrum: Spectrum | None = None
    clusters: Clusters | None = None


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp; the zenith is the plate's normal. ``illuminance_lx`` is what a meter reads in the plate's middle.

    It shines from afar, or from ``distance_mm`` from the plate's middle: its direction, its size and its light then
    change over the plate. ``angular_radius_deg`` is that of its disc as seen from the middle. A beam is aimed at the
    middle, and half as strong at half of ``beam_angle_deg`` from its axis; None shines into all directions alike.
    ``spectrum`` is relative, on the grid of `stimuli.sparkle.light`. ``observer`` is the colorimetric observer of its
    chromaticity, and of all XYZ of its light.
    """

    illuminance_lx: float
    chromaticity_xy: tuple[float, float]
    zenith_deg: float
    azimuth_deg: float
    angular_radius_deg: float
    distance_mm: float | None = None
    beam_angle_deg: float | None = None
    spectrum: Spectrum | None = None
    observer: str = DEFAULT_OBSERVER

    @property
    def direction(self) -> Floats:
        """Unit vector (3,) from the plate's middle to the lamp."""
        zenith, azimuth = np.radians(self.zenith_deg), np.radians(self.azimuth_deg)
        return np.array([np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)])

    @property
    def position_mm(self) -> Floats | None:
        """Where the lamp stands, (3,); None if it is far."""
        return None if self.distance_mm is None else self.distance_mm * self.direction


@dataclass(frozen=True, slots=True)
class Noise:
    """The noise of a sensor: electrons in a full channel, and read noise in electrons."""

    full_well_electrons: float
    read_noise_electrons: float


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera moved sideways between the views, its frustum off axis: zero parallax at the plate's surface.

    ``point_spread_sd_px`` is that of a Gaussian, in camera pixels. ``full_well_cd_s_m2`` is the luminance times
    exposure of a pixel whose channels are all full. ``raw_from_XYZ`` maps XYZ to the sensor's channels. With
    ``pupil_mm`` light also goes through an eye's optics of that pupil; without ``noise`` readings are exact.
    """

    distance_mm: float
    interpupillary_distance_mm: float
    resolution_px_per_mm: float
    point_spread_sd_px: float
    full_well_cd_s_m2: float
    raw_from_XYZ: tuple[Row, Row, Row]
    pupil_mm: float | None = None
    noise: Noise | None = None

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
