"""How finely a camera images a plane: pixels per millimetre from sensor, lens and distance, and back.

A thin lens of focal length f that is focused on a plane at the distance d images it with the magnification
m = f/(d − f), on a sensor f (1 + m) behind it [Hecht2017]. From plane to sensor it is f (2 + m + 1/m), never less than
4 f. A pinhole, or a lens left at infinity, has m = f/d; so the thesis calculates (Section 4.3.1), whose 146 pixels per
centimetre come from 36 × 24 mm, 50 mm and 700 mm. A thin lens focused there gives 157.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from devices.camera.options import GeometryOptions, Lens, Origin, Pair
from devices.errors import DeviceError
from documents import Finding
from documents.text import JsonResult


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
    sample_mm
        Width and height of something on the plane; None for nothing.

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
    sample_mm: Pair | None = None
    json_optional: ClassVar = ("sample_mm", "sample_px")
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
        "sample_px",
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

    def told(self) -> Iterator[str]:
        """Yield what the camera images, a line each."""
        across, down = self.pixels_per_mm
        width, height = self.field_mm
        angles = self.field_of_view_deg
        yield f"Resolution: {across:.4g} pixels per mm across, {down:.4g} down"
        yield f"One pixel: {self.pixel_um[0]:.1f} × {self.pixel_um[1]:.1f} µm of the plane"
        yield f"Picture: {width:.1f} × {height:.1f} mm of the plane"
        yield f"Field of view: {angles[0]:.1f}° × {angles[1]:.1f}°, {angles[2]:.1f}° along the diagonal"
        yield f"Lens: {self.focal_mm:.4g} mm, {self.lens_distance_mm:.1f} mm from the plane"
        yield f"Plane to sensor: {self.lens_distance_mm + self.image_distance_mm:.1f} mm"
        yield f"Magnification: {self.magnification:.4g}"
        yield f"As seen from the lens: {self.pixels_per_degree:.1f} pixels per degree"
        if self.sample_mm and self.sample_px:
            width, height = self.sample_px
            yield f"A sample of {self.sample_mm[0]:g} × {self.sample_mm[1]:g} mm: {width:.0f} × {height:.0f} pixels"

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

    @property
    def sample_px(self) -> Pair | None:
        """Width and height in pixels of the sample; None without one."""
        across, down = self.pixels_per_mm
        return None if self.sample_mm is None else (self.sample_mm[0] * across, self.sample_mm[1] * down)


def plan_geometry(options: GeometryOptions) -> CameraGeometry:
    """Pixels per millimetre from sensor, lens and distance, and back.

    Give two of --focal-mm, --distance-mm and --px-per-mm; the third follows. The camera looks straight at a plane.

    Raises
    ------
    DeviceError
        As `CameraGeometry` does; if not two are given, or the resolution is not above 0.

    Examples
    --------
    >>> needed = plan_geometry(GeometryOptions((36.0, 24.0), (7360, 4912), focal_mm=50.0, px_per_mm=14.6))
    >>> round(needed.distance_mm, 1)
    750.2
    """
    focal_mm, distance_mm = options.focal_mm, options.distance_mm
    if sum(value is not None for value in (focal_mm, distance_mm, options.px_per_mm)) != 2:
        what = "of focal length, distance and pixels per mm, two are needed; the third follows"
        raise DeviceError(Finding(what, remedy="give two of them"))
    if options.px_per_mm is not None:
        focal_mm, distance_mm = _at_resolution(options, options.px_per_mm)
    assert focal_mm is not None
    assert distance_mm is not None
    sensor_mm, size_px, sample_mm = options.sensor_mm, options.pixels, options.size_mm
    return CameraGeometry(sensor_mm, size_px, focal_mm, distance_mm, options.origin, options.lens, sample_mm)


def _at_resolution(options: GeometryOptions, pixels_per_mm: float) -> Pair:
    """Return focal length and distance in mm of the camera whose width has ``pixels_per_mm`` of the plane."""
    _check_sensor(options.sensor_mm, options.pixels)
    _above_zero("resolution", pixels_per_mm, "pixels per mm")
    m = pixels_per_mm * options.sensor_mm[0] / options.pixels[0]
    if (options.lens, options.origin) == ("thin", "sensor") and m > 1:
        raise DeviceError(
            Finding(
                f"{pixels_per_mm:g} pixels per mm is larger than life on this sensor, and two distances from the "
                "sensor give it",
                remedy="give the distance from the lens",
            )
        )
    # The distance in focal lengths: at life size it is 4 from a sensor, but for rounding.
    times = {
        ("thin", "lens"): 1 + 1 / m,
        ("thin", "sensor"): max(2 + m + 1 / m, 4.0),
        ("pinhole", "lens"): 1 / m,
        ("pinhole", "sensor"): 1 + 1 / m,
    }[options.lens, options.origin]
    if options.focal_mm is not None:
        _above_zero("focal length", options.focal_mm, "mm")
        return options.focal_mm, options.focal_mm * times
    assert options.distance_mm is not None
    _above_zero("distance", options.distance_mm, "mm")
    return options.distance_mm / times, options.distance_mm


def _check_sensor(sensor_mm: Pair, size_px: tuple[int, int]) -> None:
    for name, value in zip(("width", "height"), sensor_mm, strict=True):
        _above_zero(f"sensor's {name}", value, "mm")
    for name, number in zip(("columns", "rows"), size_px, strict=True):
        _above_zero(f"picture's number of {name}", number, "pixels")


def _above_zero(name: str, value: float, unit: str) -> None:
    if not (np.isfinite(value) and value > 0):
        raise DeviceError(Finding(f"the {name} is {value:g} {unit}", remedy="it must be a number above 0"))
