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


@dataclass(frozen=True, slots=True)
class MetamerismOptions:
    """Under which light objects are matched on a screen, for whom, and who else sees both.

    Attributes
    ----------
    illuminant
        Light on the objects: A, D50, D65, … .
    observer
        Observer of the match.
    field_deg
        Field of the persons. Default: the observer's.
    persons
        How many to draw.
    ages_years
        Ages of the persons in years. Default: 20..60.
    seed
        Random seed of the persons.
    categories
        Take the ten categorical observers instead of drawn persons.
    white_luminance_cd_m2
        Luminance of a perfect diffuser.
    """

    illuminant: Annotated[str, Typed(metavar="NAME|LIGHT.csv")]
    observer: Annotated[str, Typed(metavar="NAME")] = "CIE 1931 2"
    field_deg: Annotated[float | None, Typed("--field", "DEG")] = None
    persons: Annotated[int, Typed(least=1, most=100_000)] = 1000
    ages_years: Annotated[tuple[float, float], Typed("--ages", "FROM..TO", between="..")] = (20.0, 60.0)
    seed: Annotated[int, Typed(least=0, most=1e40)] = 1
    categories: bool = False
    white_luminance_cd_m2: Annotated[float | None, Typed("--white-luminance", "CD_M2")] = None
