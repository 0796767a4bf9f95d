"""Regions files: the areas of a photograph that are compared with its rendering, and the limits."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, PositiveFloat, PositiveInt

from documents import InputError, load_document
from documents.yaml import Strict, YamlSource
from stimuli.comparison.luminance import LuminanceMode
from stimuli.comparison.verdict import Limits

# What a file may ask for at most: areas in all, and places in pixels or shares. No picture has as many.
MOST_AREAS = 10_000
MOST = 1e9
Coordinate = Annotated[float, Field(ge=-MOST, le=MOST)]
Length = Annotated[float, Field(gt=0, le=MOST)]
Point = tuple[Coordinate, Coordinate]
Corners = tuple[Point, Point, Point, Point]
Points = Annotated[tuple[Point, ...], Field(min_length=3, max_length=1000)]
Box = tuple[Coordinate, Coordinate, Length, Length]
Name = Annotated[str, Field(min_length=1, max_length=80)]
Share = Annotated[float, Field(gt=0, le=1)]
_PATCHES = {"colorchecker": 24}
Units = Literal["px", "share"]
WhiteName = Literal["icc-d50", "d50", "d65", "a", "e"]


class ColorCheckerSpec(Strict):
    """The 24 patches between the chart's outer corners: top left, top right, bottom right, bottom left.

    ``inner`` is the side of what counts, as a share of a patch's side. With ``colours: other``, a chart of the same
    layout whose colours are not the ColorChecker's, it is not checked which way round it lies.
    """

    kind: Literal["colorchecker"]
    name: Name = "chart"
    corners: Corners
    rendering_corners: Corners | None = None
    inner: Share = 0.5
    colours: Literal["published", "other"] = "published"


class RectangleSpec(Strict):
    """A rectangle: ``box`` is left, top, width and height."""

    kind: Literal["rectangle"]
    name: Name
    box: Box
    rendering_box: Box | None = None
    sparkle: bool = False


class PolygonSpec(Strict):
    """Any area whose outline does not cross itself."""

    kind: Literal["polygon"]
    name: Name
    points: Points
    rendering_points: Points | None = None
    sparkle: bool = False


class PlateSpec(Strict):
    """A plate between its four corners, or the whole picture without them; ``inner`` leaves its rim out."""

    kind: Literal["plate"]
    name: Name = "plate"
    corners: Corners | None = None
    rendering_corners: Corners | None = None
    inner: Share = 1.0
    sparkle: bool = True


class GridSpec(Strict):
    """A regular grid of areas between four corners, or over the whole picture without them."""

    kind: Literal["grid"]
    name: Name = "grid"
    rows: Annotated[PositiveInt, Field(le=100)]
    columns: Annotated[PositiveInt, Field(le=100)]
    corners: Corners | None = None
    rendering_corners: Corners | None = None
    inner: Share = 1.0


RegionSpec = Annotated[
    ColorCheckerSpec | RectangleSpec | PolygonSpec | PlateSpec | GridSpec, Field(discriminator="kind")
]


class LimitsSpec(Strict):
    """The limits of `Limits`, those that are not its own."""

    delta_e: PositiveFloat | None = None
    above_limit_percent: Annotated[float, Field(gt=0, le=100)] | None = None
    registration_residual_px: PositiveFloat | None = None
    sparkle_relative: PositiveFloat | None = None
    sparkle_z: PositiveFloat | None = None
    sparkle_relative_se: PositiveFloat | None = None
    disparity_px: PositiveFloat | None = None
    stands_out_delta_xy: PositiveFloat | None = None
    stands_out_luminance: PositiveFloat | None = None
    stands_out_z: PositiveFloat | None = None


class RegionsSpec(Strict):
    """A regions file."""

    schema_version: Literal[1]
    units: Units = "px"
    regions: Annotated[tuple[RegionSpec, ...], Field(min_length=1, max_length=1000)]
    white: WhiteName = "icc-d50"
    white_luminance_cd_m2: PositiveFloat | None = None
    white_region: str | None = None
    luminance: LuminanceMode = "absolute"
    least_pixels: PositiveInt = 25
    most_saturated_share: Annotated[float, Field(ge=0, lt=1)] = 0.001
    limits: LimitsSpec = LimitsSpec()


@dataclass(frozen=True, slots=True)
class RegionsFile:
    """A regions file that was read; `place_regions` puts its regions onto two pictures."""

    spec: RegionsSpec
    source: YamlSource
    limits: Limits

    @property
    def file(self) -> str:
        """The path as it was given."""
        return self.source.file


def read_regions(path: Path) -> RegionsFile:
    """Read the regions file at ``path``.

    Parameters
    ----------
    path
        A regions file, such as ``configs/regions/plate.yaml``.

    Returns
    -------
    RegionsFile
        The regions, the white and the limits.

    Raises
    ------
    InputError
        With every fault and its place.

    Examples
    --------
    >>> read_regions(Path("configs/regions/plate.yaml")).limits.delta_e
    1.4
    """
    spec, source = load_document(path, RegionsSpec, "regions")
    areas = 0
    for number, region in enumerate(spec.regions):
        areas += region.rows * region.columns if isinstance(region, GridSpec) else _PATCHES.get(region.kind, 1)
        if areas > MOST_AREAS:
            message = f"with '{region.name}' these are {areas} areas"
            remedy = f"a regions file has {MOST_AREAS} at most"
            raise InputError(source.finding(("regions", number), message, remedy))
    given = {name: value for name, value in spec.limits.model_dump().items() if value is not None}
    return RegionsFile(spec, source, Limits(**given))
