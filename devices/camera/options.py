"""How a camera's geometry is planned, in Python and typed: here, so that help appears before numpy is there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

from documents.options import Typed

Lens: TypeAlias = Literal["thin", "pinhole"]
Origin: TypeAlias = Literal["lens", "sensor"]
Pair: TypeAlias = tuple[float, float]


@dataclass(frozen=True, slots=True)
class GeometryOptions:
    """What is known of a camera that looks straight at a plane.

    Attributes
    ----------
    sensor_mm
        Width and height of the sensor, such as 36x24.
    pixels
        Columns and rows of its picture, such as 7360x4912.
    focal_mm
        Focal length of the lens.
    distance_mm
        Distance from the plane that is photographed to the lens.
    px_per_mm
        Pixels that a millimetre of the plane is to have.
    origin
        Where the distance ends: at the lens, or at the sensor, where cameras have the mark ⊖.
    lens
        thin: focused on the plane. pinhole: as if focused at infinity, as the thesis calculates.
    size_mm
        Size of a sample, such as 150x100; its pixels are printed as well.
    """

    sensor_mm: Annotated[Pair, Typed(metavar="WxH", between="x")]
    pixels: Annotated[tuple[int, int], Typed(metavar="WxH", between="x")]
    focal_mm: float | None = None
    distance_mm: float | None = None
    px_per_mm: float | None = None
    origin: Annotated[Origin, Typed("--distance-from")] = "lens"
    lens: Lens = "thin"
    size_mm: Annotated[Pair | None, Typed(metavar="WxH", between="x")] = None
