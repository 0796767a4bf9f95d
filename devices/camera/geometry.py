"""How finely a camera images a plane: pixels per millimetre from sensor, lens and distance, and back.

A thin lens of focal length f that is focused on a plane at the distance d images it with the magnification
m = f/(d − f), on a sensor f (1 + m) behind it [Hecht2017]. From plane to sensor it is f (2 + m + 1/m), never less than
4 f. A pinhole, or a lens left at infinity, has m = f/d; so the thesis calculates (Section 4.3.1), whose 146 pixels per
centimetre come from 36 × 24 mm, 50 mm and 700 mm. A thin lens focused there gives 157.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from devices.errors import DeviceError
from documents import Finding
from documents.text import JsonResult

Lens = Literal["thin", "pinhole"]
Origin = Literal["lens", "sensor"]
Pair = tuple[float, float]


@dataclass(frozen=True, slots=True)
class CameraGeometry(JsonResult):
    """A camera that looks straight at a plane.

    Parameters
    ----------
    sensor_mm
        Width and height of the part of the sensor that the pixels cover.
    size_px
        Columns and rows of the picture.
    focal_mm
        The focal length, above 0.
    distance_mm
        From the plane to the lens (its front principal plane), or to the sensor, by ``origin``.
    origin
        Where the distance ends: ``lens`` or ``sensor``, which cameras mark with ⊖.
    lens
        ``thin`` is a lens focused on the plane; ``pinhole`` neglects that it moves away from the sensor for that.

    Raises
    ------
    DeviceError
        If a length or number of pixels is not above 0, or the lens gives no image of the plane on the sensor.

    Examples
    --------
    The thesis's camera, as the thesis calculates it (Section 4.3.1), and as a thin lens:

    >>> thesis = CameraGeometry((36.0, 24.0), (7360, 4912), 50.0, 700.0, lens="pinhole")
    >>> round(10 * thesis.pixels_per_mm[0]), [round(side) for side in thesis.field_mm]
    (146, [504, 336])
    >>> round(10 * CameraGeometry((36.0, 24.0), (7360, 4912), 50.0, 700.0).pixels_per_mm[0])
    157
    """

    sensor_mm: Pair
    size_px: tuple[int, int]
    focal_mm: float
    distance_mm: float
    origin: Origin = "lens"
    lens: Lens = "thin"
    json_keys: ClassVar = {"origin": "distance_from"}
    json_also: ClassVar = (
        "lens_distance_mm",
        "image_distance_mm",
        "magnification",
        "pixels_per_mm",
        "pixel_um",
        "field_mm",
        "field_of_view_deg",
        "pixels_per_degree",
    )

    def __post_init__(self) -> None:
        _check_sensor(self.sensor_mm, self.size_px)
        _above_zero("focal length", self.focal_mm, "mm")
        _above_zero("distance", self.distance_mm, "mm")
        least = self.focal_mm * (0 if (self.lens, self.origin) == ("pinhole", "lens") else 1)
        if (self.lens, self.origin) == ("thin", "sensor"):
            if self.distance_mm < 4 * self.focal_mm:
                raise DeviceError(
                    Finding(
                        f"no lens of {self.focal_mm:g} mm images a plane on a sensor {self.distance_mm:g} mm from it",
                        remedy=f"from plane to sensor it takes 4 × {self.focal_mm:g} = {4 * self.focal_mm:g} mm",
                    )
                )
        elif not self.distance_mm > least:
            raise DeviceError(
                Finding(
                    f"a lens of {self.focal_mm:g} mm gives no image of a plane {self.distance_mm:g} mm from the "
                    f"{self.origin}",
                    remedy=f"it must stand farther than {least:g} mm away",
                )
            )

    @classmethod
    def at_resolution(
        cls,
        sensor_mm: Pair,
        size_px: tuple[int, int],
        pixels_per_mm: float,
        *,
        focal_mm: float | None = None,
        distance_mm: float | None = None,
        origin: Origin = "lens",
        lens: Lens = "thin",
    ) -> CameraGeometry:
        """Return the camera whose width has ``pixels_per_mm`` of the plane: its distance, or the lens it needs.

        One of ``focal_mm`` and ``distance_mm`` is given, and the other found.

        Raises
        ------
        DeviceError
            As the class does, or if the resolution is not above 0.
        ValueError
            If both or neither are given.

        Examples
        --------
        >>> needed = CameraGeometry.at_resolution((36.0, 24.0), (7360, 4912), 14.6, focal_mm=50.0)
        >>> round(needed.distance_mm, 1)
        750.2
        >>> back = CameraGeometry.at_resolution((36.0, 24.0), (7360, 4912), 14.6, distance_mm=needed.distance_mm)
        >>> round(back.focal_mm, 6)
        50.0
        """
        if (focal_mm is None) == (distance_mm is None):
            raise ValueError("give focal_mm or distance_mm, one of the two")
        _check_sensor(sensor_mm, size_px)
        _above_zero("resolution", pixels_per_mm, "pixels per mm")
        m = pixels_per_mm * sensor_mm[0] / size_px[0]
        # The distance in focal lengths.
        times = {
            ("thin", "lens"): 1 + 1 / m,
            ("thin", "sensor"): 2 + m + 1 / m,
            ("pinhole", "lens"): 1 / m,
            ("pinhole", "sensor"): 1 + 1 / m,
        }[lens, origin]
        if focal_mm is not None:
            _above_zero("focal length", focal_mm, "mm")
            distance_mm = focal_mm * times
        elif distance_mm is not None:
            _above_zero("distance", distance_mm, "mm")
            focal_mm = distance_mm / times
        assert focal_mm is not None
        assert distance_mm is not None
        if (lens, origin) == ("thin", "sensor") and m > 1:
            raise DeviceError(
                Finding(
                    f"{pixels_per_mm:g} pixels per mm is larger than life on this sensor, and two distances from the "
                    "sensor give it",
                    remedy="give the distance from the lens",
                )
            )
        # At life size the distance is 4 f but for rounding.
        return cls(sensor_mm, size_px, focal_mm, max(distance_mm, _least_mm(focal_mm, lens, origin)), origin, lens)

    @property
    def magnification(self) -> float:
        """Size on the sensor for size on the plane; from a sensor, the smaller of the two that its distance allows."""
        f, d = self.focal_mm, self.distance_mm
        if self.lens == "pinhole":
            return f / (d if self.origin == "lens" else d - f)
        if self.origin == "lens":
            return f / (d - f)
        half = d / (2 * f) - 1
        # The smaller root of m² − 2·half·m + 1, written so that nothing cancels.
        return 1 / (half + float(np.sqrt(max(half**2 - 1, 0.0))))

    @property
    def lens_distance_mm(self) -> float:
        """From the plane to the lens."""
        return self.distance_mm if self.origin == "lens" else self.distance_mm - self.image_distance_mm

    @property
    def image_distance_mm(self) -> float:
        """From the lens to the sensor."""
        return self.focal_mm * (1 if self.lens == "pinhole" else 1 + self.magnification)

    @property
    def pixels_per_mm(self) -> Pair:
        """Pixels of the picture for a millimetre of the plane, across and down."""
        across, down = (px / mm for px, mm in zip(self.size_px, self.sensor_mm, strict=True))
        return self.magnification * across, self.magnification * down

    @property
    def pixel_um(self) -> Pair:
        """Width and height on the plane of what one pixel sees, in µm."""
        across, down = self.pixels_per_mm
        return 1000 / across, 1000 / down

    @property
    def field_mm(self) -> Pair:
        """Width and height of the part of the plane that is in the picture."""
        width, height = self.sensor_mm
        return width / self.magnification, height / self.magnification

    @property
    def field_of_view_deg(self) -> tuple[float, float, float]:
        """The picture's angle across, down and along its diagonal, as seen from the lens."""
        width, height = self.sensor_mm
        across, down, along = (
            float(2 * np.degrees(np.arctan(side / (2 * self.image_distance_mm))))
            for side in (width, height, float(np.hypot(width, height)))
        )
        return across, down, along

    @property
    def pixels_per_degree(self) -> float:
        """Pixels across for a degree about the optical axis, as seen from the lens."""
        return float(self.size_px[0] / self.sensor_mm[0] * self.image_distance_mm * np.tan(np.radians(1.0)))

    def size_in_px(self, size_mm: Pair) -> Pair:
        """Return the width and height in pixels of what has ``size_mm`` on the plane."""
        across, down = self.pixels_per_mm
        return size_mm[0] * across, size_mm[1] * down


def _least_mm(focal_mm: float, lens: Lens, origin: Origin) -> float:
    return 4 * focal_mm if (lens, origin) == ("thin", "sensor") else 0.0


def _check_sensor(sensor_mm: Pair, size_px: tuple[int, int]) -> None:
    for name, value in zip(("width", "height"), sensor_mm, strict=True):
        _above_zero(f"sensor's {name}", value, "mm")
    for name, number in zip(("columns", "rows"), size_px, strict=True):
        _above_zero(f"picture's number of {name}", number, "pixels")


def _above_zero(name: str, value: float, unit: str) -> None:
    if not (np.isfinite(value) and value > 0):
        raise DeviceError(Finding(f"the {name} is {value:g} {unit}", remedy="it must be a number above 0"))
