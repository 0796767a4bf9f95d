"""Regions files: the areas of a photograph that are compared with its rendering, and the limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from devices.chart import COLORCHECKER, ChartLayout, patch_quadrangles
from devices.readings import colorchecker_xyY
from documents import InputError, load_document
from documents.arrays import Floats
from documents.yaml import FileModel, Natural, Positive, YamlSource
from stimuli.comparison.options import LuminanceMode, WhiteName
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
AreaKind = Literal["patch", "rectangle", "polygon", "plate", "cell"]
# The corners of a whole picture, in shares of it, from the top left on.
WHOLE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
Units = Literal["px", "share"]


class _Areas(FileModel):
    """An entry: between four corners of what ``layout`` divides, or one outline where there is none."""

    area_kind: ClassVar[AreaKind]
    outline_key: ClassVar[Literal["corners", "box", "points"]] = "corners"
    if TYPE_CHECKING:  # each kind has its own, in the order of its keys
        name: str
        inner: float

    @property
    def layout(self) -> ChartLayout | None:
        """Where areas lie between the corners; None of an outline that is one area."""
        return None

    @property
    def area_names(self) -> tuple[str, ...]:
        """The name of each area."""
        return (self.name,)

    def areas(self, outline: Floats) -> Sequence[Floats]:
        """Return the outlines of its areas in a picture, of its own there, (n, 2)."""
        return [outline] if self.layout is None else list(patch_quadrangles(outline, self.layout, self.inner))

    def outline(self, prefix: str) -> Floats | None:
        """Return the outline (n, 2) that it gives, in the file's unit, of the photograph, or with ``rendering_``."""
        points = getattr(self, prefix + self.outline_key)
        return None if points is None else np.array(points, dtype=np.float64)


class ColorCheckerSpec(_Areas):
    """The 24 patches between the chart's outer corners: top left, top right, bottom right, bottom left.

    ``inner`` is the side of what counts, as a share of a patch's side. With ``colours: other``, a chart of the same
    layout whose colours are not the ColorChecker's, it is not checked which way round it lies.
    """

    kind: Literal["colorchecker"]
    """Which kind of entry this is; it decides which other keys there are."""
    name: Name = "chart"
    """A name of your own, by which records and reports call it."""
    corners: Corners
    """The outer corners: top left, top right, bottom right, bottom left."""
    rendering_corners: Corners | None = None
    """The corners in the rendering, where they lie elsewhere than in the photograph."""
    inner: Share = 0.5
    """The share of the sides that counts; the rim is left out."""
    colours: Literal["published", "other"] = "published"
    """Whether the chart has the published colours of the ColorChecker."""
    area_kind = "patch"

    @property
    def layout(self) -> ChartLayout:
        """That of a ColorChecker."""
        return COLORCHECKER

    @property
    def area_names(self) -> tuple[str, ...]:
        """The names of the 24 patches."""
        names, _ = colorchecker_xyY()
        return tuple(f"{self.name} {place} {name}" for place, name in enumerate(names, 1))


class RectangleSpec(_Areas):
    """A rectangle: ``box`` is left, top, width and height."""

    area_kind = "rectangle"
    outline_key = "box"

    kind: Literal["rectangle"]
    """Which kind of entry this is; it decides which other keys there are."""
    name: Name
    """A name of your own, by which records and reports call it."""
    box: Box
    """Left, top, width and height."""
    rendering_box: Box | None = None
    """The box in the rendering, where it lies elsewhere than in the photograph."""
    sparkle: bool = False
    """Whether its sparkles are compared."""

    def outline(self, prefix: str) -> Floats | None:
        """Return the corners of its box, (4, 2)."""
        box = getattr(self, f"{prefix}box")
        if box is None:
            return None
        left, top, width, height = box
        return np.asarray(np.array([left, top]) + WHOLE * np.array([width, height]))


class PolygonSpec(_Areas):
    """Any area whose outline does not cross itself."""

    area_kind = "polygon"
    outline_key = "points"

    kind: Literal["polygon"]
    """Which kind of entry this is; it decides which other keys there are."""
    name: Name
    """A name of your own, by which records and reports call it."""
    points: Points
    """The corners of the outline, x and y each."""
    rendering_points: Points | None = None
    """The corners in the rendering, where they lie elsewhere than in the photograph."""
    sparkle: bool = False
    """Whether its sparkles are compared."""


class PlateSpec(_Areas):
    """A plate between its four corners, or the whole picture without them; ``inner`` leaves its rim out."""

    area_kind = "plate"

    kind: Literal["plate"]
    """Which kind of entry this is; it decides which other keys there are."""
    name: Name = "plate"
    """The name of the plate."""
    corners: Corners | None = None
    """The outer corners: top left, top right, bottom right, bottom left."""
    rendering_corners: Corners | None = None
    """The corners in the rendering, where they lie elsewhere than in the photograph."""
    inner: Share = 1.0
    """The share of the sides that counts; the rim is left out."""
    sparkle: bool = True
    """Whether its sparkles are compared."""

    @property
    def layout(self) -> ChartLayout:
        """One area."""
        return ChartLayout(1, 1, 0.0)


class GridSpec(_Areas):
    """A regular grid of areas between four corners, or over the whole picture without them."""

    area_kind = "cell"

    kind: Literal["grid"]
    """Which kind of entry this is; it decides which other keys there are."""
    name: Name = "grid"
    """A name of your own, by which records and reports call it."""
    rows: Annotated[Natural, Field(le=100)]
    """How many rows."""
    columns: Annotated[Natural, Field(le=100)]
    """How many columns."""
    corners: Corners | None = None
    """The outer corners: top left, top right, bottom right, bottom left."""
    rendering_corners: Corners | None = None
    """The corners in the rendering, where they lie elsewhere than in the photograph."""
    inner: Share = 1.0
    """The share of the sides that counts; the rim is left out."""

    @property
    def layout(self) -> ChartLayout:
        """Its cells, without gaps."""
        return ChartLayout(self.rows, self.columns, 0.0)

    @property
    def area_names(self) -> tuple[str, ...]:
        """The name of each cell, row by row."""
        cells = product(range(1, self.rows + 1), range(1, self.columns + 1))
        return tuple(f"{self.name} row {row} column {column}" for row, column in cells)


RegionSpec = Annotated[
    ColorCheckerSpec | RectangleSpec | PolygonSpec | PlateSpec | GridSpec, Field(discriminator="kind")
]


class RegionsSpec(FileModel):
    """A regions file."""

    schema_version: Literal[1]
    """The version of the file format: 1."""
    units: Units = "px"
    """Whether places are in pixels or in shares of the picture."""
    regions: Annotated[tuple[RegionSpec, ...], Field(min_length=1, max_length=1000)]
    """The areas to compare."""
    white: WhiteName = "icc-d50"
    """The white point of the comparison."""
    white_luminance_cd_m2: Positive | None = None
    """The luminance of white, in cd/m²."""
    white_region: str | None = None
    """The region that is white."""
    luminance: LuminanceMode = "absolute"
    """Whether luminances are compared as they are, or scaled to each other."""
    least_pixels: Natural = 25
    """How many pixels a region must have at least."""
    most_saturated_share: Annotated[float, Field(ge=0, lt=1)] = 0.001
    """The share of a region's pixels that may be saturated."""
    limits: Limits = Limits()
    """The limits of the verdict."""


@dataclass(frozen=True, slots=True)
class RegionsFile:
    """A regions file that was read; `place_regions` puts its regions onto two pictures."""

    spec: RegionsSpec
    source: YamlSource

    @property
    def limits(self) -> Limits:
        """The limits of the verdict."""
        return self.spec.limits

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
        areas += 1 if region.layout is None else region.layout.rows * region.layout.columns
        if areas > MOST_AREAS:
            message = f"with '{region.name}' these are {areas} areas"
            remedy = f"a regions file has {MOST_AREAS} at most"
            raise InputError(source.finding(("regions", number), message, remedy))
    return RegionsFile(spec, source)
