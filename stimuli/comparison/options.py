"""How two pictures are compared, in Python and typed: here, so that help appears before numpy is there."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from documents.options import Typed
from stimuli.develop.options import EXPOSURE
from stimuli.spectral.options import Quantity, SensorOptions

if TYPE_CHECKING:
    from devices.camera import CameraModel, Exposure
    from documents.arrays import Floats
    from stimuli.measures import ViewingConditions
    from stimuli.pictures import Decoding
    from stimuli.spectral import Illumination

Holds: TypeAlias = Literal["xyz", "rec709", "camera-rgb", "spectral"]
LuminanceMode: TypeAlias = Literal["absolute", "mean_ratio", "least_squares"]
RegistrationMode: TypeAlias = Literal["auto", "none", "corners"]
WhiteName: TypeAlias = Literal["icc-d50", "d50", "d65", "a", "e"]
Place: TypeAlias = tuple[float, float]
Corners: TypeAlias = tuple[Place, Place, Place, Place]
CORNERS, CD_M2, MOST_PX = "X,Y X,Y X,Y X,Y", "CD_M2", 1e9


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """How both files are read.

    With a ``sensor`` a spectral picture is taken by the camera's own sensor and goes through ``camera`` like a
    photograph; without, it is summed for the colorimetric ``observer``. Ordinary pictures without ``colour_space`` are
    refused.

    Attributes
    ----------
    camera
        Camera file written by `camera fit`, for raw photographs and camera RGB.
    exposure
        Exposure of camera RGB whose file has none, such as 1/15,8,200.
    linear
        Read a TIFF or OpenEXR file as linear camera RGB, whatever it declares.
    photo_holds
        Quantity of the values in PHOTO, if the file does not state it.
    rendering_holds
        Quantity of the values in RENDERING, if the file does not state it.
    colour_space
        Colour space of pictures such as PNG and JPEG, or what each declares.
    picture_white_cd_m2
        Luminance of the white of such pictures.
    sensor
        The sensor that takes a spectral rendering.
    quantity
        Quantity of spectral values.
    illuminant
        Illuminant of a spectral rendering of reflectance.
    illuminant_luminance_cd_m2
        Luminance of a perfect diffuser in that light.
    observer
        Observer for XYZ of spectral pictures. Default: CIE 1931 2.
    """

    camera: Annotated[CameraModel | None, Typed(metavar="C.yaml", read="devices.camera.read_camera")] = None
    exposure: Annotated[Exposure | None, EXPOSURE] = None
    linear: bool = False
    photo_holds: Holds | None = None
    rendering_holds: Holds | None = None
    colour_space: Literal["declared", "srgb", "display-p3", "adobe-rgb", "rec2020", "icc"] | None = None
    picture_white_cd_m2: Annotated[float | None, Typed("--picture-white", CD_M2)] = None
    sensor: SensorOptions = field(default_factory=SensorOptions)
    quantity: Quantity | None = None
    illuminant: Annotated[str | None, Typed(metavar="NAME|LIGHT.csv")] = None
    illuminant_luminance_cd_m2: Annotated[float | None, Typed("--illuminant-luminance", CD_M2)] = None
    observer: Annotated[str | None, Typed(metavar="NAME")] = None

    @property
    def seen_by(self) -> str:
        """The colorimetric observer of the XYZ."""
        from devices.colour_matching import DEFAULT_OBSERVER

        return self.observer or DEFAULT_OBSERVER

    @property
    def light(self) -> Illumination:
        """The light of a picture of reflectance. Raises StimulusError if its luminance is not above 0."""
        from stimuli.spectral import Illumination

        return Illumination(self.illuminant, self.illuminant_luminance_cd_m2)

    @property
    def decoding(self) -> Decoding | None:
        """How the codes of ordinary pictures become light, None where they do not."""
        from stimuli.pictures import Decoding

        space = self.colour_space
        return None if space is None else Decoding(space, self.picture_white_cd_m2, negative="clip")


@dataclass(frozen=True, eq=False, slots=True)
class CompareOptions:
    """How two pictures are compared.

    Attributes
    ----------
    reading
        How both files are read.
    viewing
        Where the pictures are seen; without it they are not compared as the eye resolves them.
    white
        White point of CIELAB. Default: icc-d50.
    white_luminance_cd_m2
        Luminance of that white. Default: that of the chart's white, or of the display.
    luminance
        Compare luminances as they are, or times one factor for all. Default: absolute.
    register
        Registration: find shift and rotation, keep the pixels, or match four corners.
    photo_corners_px
        Four corners in PHOTO, in pixels.
    rendering_corners_px
        The same four corners in RENDERING, in pixels.
    delta_e_limit
        Largest ΔE00 that counts as equal. Default: 1.4.
    measures
        Measures to report beside the verdict, such as flip,pu-ssim, or all; docs/measures.md lists them.
    """

    reading: ReadOptions = field(default_factory=ReadOptions)
    viewing: ViewingConditions | None = None
    white: WhiteName | None = None
    white_luminance_cd_m2: Annotated[float | None, Typed("--white-luminance", CD_M2)] = None
    luminance: LuminanceMode | None = None
    register: RegistrationMode = "auto"
    photo_corners_px: Annotated[Corners | None, Typed("--photo-corners", CORNERS, -MOST_PX, MOST_PX)] = None
    rendering_corners_px: Annotated[Corners | None, Typed("--rendering-corners", CORNERS, -MOST_PX, MOST_PX)] = None
    delta_e_limit: Annotated[float | None, Typed("--limit", "ΔE00", least=0, above=True)] = None
    measures: Annotated[tuple[str, ...], Typed(metavar="NAMES")] = ()

    @property
    def pixels_per_degree(self) -> float | None:
        """How finely the pictures are seen, None where it is not known."""
        return None if self.viewing is None else self.viewing.pixels_per_degree

    @property
    def display_white_XYZ(self) -> Floats | None:
        """The white of the display, XYZ (3,), None where it is not known."""
        return None if self.viewing is None else self.viewing.display_white_XYZ

    @property
    def refused(self) -> str:
        """Which options do not go together, in words; empty where all do."""
        reading, sensor = self.reading, self.reading.sensor
        corners = (self.photo_corners_px is not None, self.rendering_corners_px is not None)
        pairs = {
            "photo-corners and rendering-corners": corners,
            "sensitivities and full-scale": (sensor.sensitivities is not None, sensor.full_scale_cd_m2 is not None),
            "colour-space and picture-white, such as srgb and 100,": (
                reading.colour_space is not None,
                reading.picture_white_cd_m2 is not None,
            ),
        }
        if apart := next((names for names, (one, other) in pairs.items() if one != other), ""):
            return f"{apart} go together"
        return "corners go with register corners" if any(corners) and self.register != "corners" else ""
