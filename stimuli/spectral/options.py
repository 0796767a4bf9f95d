"""How a spectral picture is converted, in Python and typed: here, so that help appears before numpy is there."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from documents.options import Typed
from stimuli.develop.options import EXPOSURE

if TYPE_CHECKING:
    from devices.camera import Exposure

Quantity: TypeAlias = Literal["radiance", "reflectance"]


@dataclass(frozen=True, slots=True)
class SensorOptions:
    """The sensor of a camera that takes a spectral picture.

    Attributes
    ----------
    sensitivities
        Sensor table (wavelength_nm,red,green,blue), for camera RGB of spectral values.
    full_scale_cd_m2
        Luminance of equal-energy light that just saturates the sensor.
    """

    sensitivities: Annotated[Path | None, Typed(metavar="SENSOR.csv")] = None
    full_scale_cd_m2: Annotated[float | None, Typed("--full-scale", "CD_M2")] = None


@dataclass(frozen=True, slots=True)
class SpectralOptions:
    """How a spectral picture is converted.

    Attributes
    ----------
    quantity
        Quantity of the values, if FILE does not state it.
    illuminant
        Illuminant of reflectances: A, D50, D65, E, … or a spectrum.
    white_luminance_cd_m2
        Luminance of a perfect diffuser in that light.
    scale
        Factor for the values or the light, for other units.
    observer
        Colorimetric observer of the XYZ.
    sensor
        The sensor that takes it: camera RGB is then written instead of XYZ.
    exposure
        Exposure to store with the camera RGB, such as 1/15,8,200.
    negative
        What to do with negative XYZ: refuse, or set to 0 and count.
    """

    quantity: Quantity | None = None
    illuminant: Annotated[str | None, Typed(metavar="NAME|LIGHT.csv")] = None
    white_luminance_cd_m2: Annotated[float | None, Typed("--white-luminance", "CD_M2")] = None
    scale: float = 1.0
    observer: Annotated[str, Typed(metavar="NAME")] = "CIE 1931 2"
    sensor: SensorOptions = field(default_factory=SensorOptions)
    exposure: Annotated[Exposure | None, EXPOSURE] = None
    negative: Literal["refuse", "clip"] = "refuse"
