"""How photographs are developed, in Python and typed: here, so that help appears before numpy is there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from documents.options import Typed

if TYPE_CHECKING:
    from devices.camera import CameraModel, Exposure
    from stimuli.develop.levels import Levels

Demosaic: TypeAlias = Literal["superpixel", "bilinear", "malvar", "vng", "ppg", "ahd"]
Negative: TypeAlias = Literal["clip", "refuse"]
# It is linear, so that mean light and the ratio of exposures stay: docs/decisions/0012-demosaicing.md.
DEFAULT_DEMOSAIC: Demosaic = "malvar"
CAMERA = Typed(metavar="CAMERA.yaml", read="devices.camera.read_camera")
EXPOSURE = Typed(metavar="TIME,F,ISO", read="devices.camera.parse_exposure")
FRAMES, CODE = Typed(metavar="FRAME|FOLDER"), Typed(metavar="CODE")


@dataclass(frozen=True, slots=True)
class DevelopOptions:
    """How photographs are developed: see `read_camera_image` and `to_xyz`.

    Attributes
    ----------
    camera
        Camera file written by `camera fit`. Default: keep camera RGB.
    exposure
        Exposure, such as 1/15,8,200. Default: the file's own.
    demosaic
        Demosaicing method; superpixel does not interpolate and halves the size.
    black
        Black level of the sensor. Default: the file's own.
    white
        Full scale of the sensor. Default: the file's own.
    saturated
        Level from which a photosite counts as saturated. Default: full scale.
    dark
        Dark frame to subtract, or a folder; several are averaged.
    flat
        Flat field to divide by, or a folder; several are averaged.
    as_stored
        Do not rotate the picture upright.
    linear
        Read a TIFF or OpenEXR file as linear camera RGB, whatever it declares.
    negative
        What to do with negative XYZ from noise around black: set to 0 and count, or refuse.
    """

    camera: Annotated[CameraModel | None, CAMERA] = None
    exposure: Annotated[Exposure | None, EXPOSURE] = None
    demosaic: Demosaic = DEFAULT_DEMOSAIC
    black: Annotated[float | None, CODE] = None
    white: Annotated[float | None, CODE] = None
    saturated: Annotated[float | None, CODE] = None
    dark: Annotated[tuple[Path, ...], FRAMES] = ()
    flat: Annotated[tuple[Path, ...], FRAMES] = ()
    as_stored: bool = False
    linear: bool = False
    negative: Negative = "clip"

    @property
    def levels(self) -> Levels:
        """The codes that are black, full scale and saturated; StimulusError if they cannot be."""
        from stimuli.develop.levels import Levels

        return Levels(self.black, self.white, self.saturated)
