"""How a camera is fitted to a chart, in Python and typed: here, so that help appears before numpy is there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from documents.options import Typed
from stimuli.develop import EXPOSURE, FRAMES

if TYPE_CHECKING:
    from devices.camera import Exposure

Pair: TypeAlias = tuple[float, float]
Triple: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class ChartOptions:
    """How a camera is fitted to a chart.

    Attributes
    ----------
    reference
        Measured patches of the chart as CSV: X,Y,Z[,name] in cd/m²; once for all photographs, or once for each.
    white_XYZ_cd_m2
        Measured white patch in cd/m²; the other patches as on a ColorChecker.
    corners_px
        Outer corners of the patches in pixels, in order around the chart. Default: detected.
    exposure
        Exposure, such as 1/15,8,800. Default: the photograph's own.
    form
        Form of the camera model; affine has an offset and holds for one exposure only.
    loss
        Error to minimise: least squares in XYZ, or ΔE00.
    black_rgb
        Black level to subtract first, as shares of full scale. Default: 0,0,0.
    saturated
        Level from which a photosite counts as saturated. Default: the file's white.
    dark
        Dark frame to subtract, or a folder; several are averaged.
    flat
        Flat field to divide by, or a folder; several are averaged.
    linear
        Read a TIFF or OpenEXR file as linear camera RGB, whatever it declares.
    observer
        Colorimetric observer of the measured XYZ; the camera file names it. Default: the table's, else CIE 1931 2.
    camera_name
        Name of the camera.
    """

    reference: Annotated[tuple[Path, ...], Typed(metavar="REF.csv")] = ()
    white_XYZ_cd_m2: Annotated[Triple | None, Typed("--white", "X,Y,Z")] = None
    corners_px: Annotated[tuple[Pair, Pair, Pair, Pair] | None, Typed("--corners", "X,Y X,Y X,Y X,Y")] = None
    exposure: Annotated[Exposure | None, EXPOSURE] = None
    form: Literal["linear", "affine"] = "linear"
    loss: Literal["xyz", "delta-e"] = "xyz"
    black_rgb: Annotated[Triple, Typed("--black", "R,G,B")] = (0.0, 0.0, 0.0)
    saturated: Annotated[float | None, Typed(metavar="CODE")] = None
    dark: Annotated[tuple[Path, ...], FRAMES] = ()
    flat: Annotated[tuple[Path, ...], FRAMES] = ()
    linear: bool = False
    observer: Annotated[str | None, Typed(metavar="NAME")] = None
    camera_name: Annotated[str, Typed("--name", "TEXT")] = ""
