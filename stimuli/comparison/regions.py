"""Regions: named areas of a photograph and of its rendering, placed by a regions file, with every fault reported."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from devices.chart import COLORCHECKER, ChartLayout
from documents import Finding
from documents.arrays import Floats
from stimuli.comparison.areas import crosses_itself
from stimuli.comparison.regions_file import WHOLE, AreaKind, RegionsFile, RegionSpec
from stimuli.errors import StimulusError

Shape = tuple[int, ...]
# The prefix of an outline's key, and the name of the picture, for each side.
_SIDES = (("", "photograph"), ("rendering_", "rendering"))


@dataclass(frozen=True, eq=False, slots=True)
class PairedArea:
    """An area of both pictures: ``photo_px`` and ``rendering_px`` are its outlines, (n, 2) and (m, 2), x and y.

    ``entry`` is the entry of the regions file that it comes from, ``number`` its place there (a patch's number, 1 to
    24). Sparkles are to be compared on it if ``sparkle``.
    """

    name: str
    kind: AreaKind
    photo_px: Floats
    rendering_px: Floats
    entry: str
    number: int | None = None
    sparkle: bool = False


@dataclass(frozen=True, eq=False, slots=True)
class Chart:
    """A ColorChecker between its four outer corners, (4, 2) in pixels, in both pictures; patches as in `PairedArea`."""

    entry: str
    photo_px: Floats
    rendering_px: Floats
    inner: float
    layout: ChartLayout = COLORCHECKER


@dataclass(frozen=True, slots=True)
class PlacedRegions:
    """Regions at their places in two pictures of known size; ``charts`` are those whose colours are known."""

    regions: tuple[PairedArea, ...]
    charts: tuple[Chart, ...] = ()


def place_regions(regions: RegionsFile, photo: Shape, rendering: Shape | None = None) -> PlacedRegions:
    """Return the regions of a file at their places in a photograph and in its rendering.

    Parameters
    ----------
    regions
        The file: see `read_regions`.
    photo
        The shape of the photograph, (height, width, ...).
    rendering
        The shape of the rendering. Without it the two lie on one grid, and outlines that are given for the rendering
        alone are not used. With it, a region without such an outline has the photograph's numbers there.

    Returns
    -------
    PlacedRegions
        Outlines in pixels, of areas and of charts whose colours are known.

    Raises
    ------
    StimulusError
        For every region that reaches out of its picture, crosses itself, or has another's name.

    Examples
    --------
    >>> from pathlib import Path
    >>> from stimuli.comparison import read_regions
    >>> placed = place_regions(read_regions(Path("configs/regions/plate.yaml")), (200, 300, 3))
    >>> [(region.name, region.photo_px[2].tolist()) for region in placed.regions]
    [('plate', [294.0, 196.0])]
    """
    placer = _Placer(regions, photo, rendering)
    placed = [area for number, spec in enumerate(regions.spec.regions) for area in placer.areas(number, spec)]
    first: dict[str, PairedArea] = {}
    for region in placed:
        if first.setdefault(region.name, region) is not region:
            placer.fault(placer.number_of(region.entry), "name", f"there are two regions '{region.name}'", "rename one")
    wanted = regions.spec.white_region
    if wanted is not None and wanted not in first:
        remedy = "expected one of: " + ", ".join(list(first)[:30])
        placer.findings.append(regions.source.finding(("white_region",), f"there is no region '{wanted}'", remedy))
    if placer.findings:
        raise StimulusError(placer.findings)
    return PlacedRegions(tuple(placed), tuple(placer.charts))


def corner_pairs(regions: RegionsFile, photo: Shape, rendering: Shape) -> tuple[Floats, Floats] | None:
    """Return the places (n, 2) that a file gives in both pictures, in pixels as of a `PairedArea`; None without any.

    The homography through them brings one picture onto the other.
    """
    here: list[Floats] = []
    there: list[Floats] = []
    for spec in regions.spec.regions:
        photo_places, rendering_places = (spec.outline(prefix) for prefix, _ in _SIDES)
        if photo_places is not None and rendering_places is not None and len(photo_places) == len(rendering_places):
            here.append(photo_places * _unit(regions, photo))
            there.append(rendering_places * _unit(regions, rendering))
    return (np.concatenate(here), np.concatenate(there)) if here else None


def _unit(regions: RegionsFile, shape: Shape) -> Floats:
    return np.array([shape[1], shape[0]], dtype=np.float64) if regions.spec.units == "share" else np.ones(2)


class _Placer:
    """Gathers areas, charts and faults."""

    def __init__(self, regions: RegionsFile, photo: Shape, rendering: Shape | None) -> None:
        self.regions = regions
        self.shapes = (photo, rendering)
        self.findings: list[Finding] = []
        self.charts: list[Chart] = []
        self._numbers: dict[str, int] = {}

    def number_of(self, entry: str) -> int:
        return self._numbers[entry]

    def fault(self, number: int, key: str, message: str, remedy: str | None = None) -> None:
        self.findings.append(self.regions.source.finding(("regions", number, key), message, remedy))

    def areas(self, number: int, spec: RegionSpec) -> Iterator[PairedArea]:
        """Yield the areas of an entry, none if there is a fault in its outline."""
        self._numbers[spec.name] = number
        photo = self._outline(number, spec, 0)
        rendering = photo if self.shapes[1] is None else self._outline(number, spec, 1)
        if photo is None or rendering is None:
            return
        if getattr(spec, "colours", "other") == "published":
            self.charts.append(Chart(spec.name, photo, rendering, spec.inner))
        numbered = spec.area_kind in ("patch", "cell")
        areas = zip(spec.area_names, spec.areas(photo), spec.areas(rendering), strict=True)
        for place, (name, here, there) in enumerate(areas, 1):
            sparkle = getattr(spec, "sparkle", False)
            yield PairedArea(name, spec.area_kind, here, there, spec.name, place if numbered else None, sparkle)

    def _outline(self, number: int, spec: RegionSpec, side: int) -> Floats | None:
        """Return the outline of an entry in one picture, in pixels; None, and a finding, if it is no outline."""
        shape = self.shapes[side] or self.shapes[0]
        prefix, picture = _SIDES[side]
        given = spec.outline(prefix)
        if given is None and side:
            prefix, given = "", spec.outline("")
        height, width = shape[:2]
        if given is None:
            return np.asarray(WHOLE * np.array([width, height]))
        outline = given * _unit(self.regions, shape)
        key = prefix + spec.outline_key
        slack = 1e-9 * max(width, height)
        if np.any(outline < -slack) or np.any(outline > np.array([width, height]) + slack):
            low, high = outline.min(axis=0), outline.max(axis=0)
            unit = "shares of the picture" if self.regions.spec.units == "share" else "pixels from the top left"
            self.fault(
                number,
                key,
                f"the region '{spec.name}' reaches from ({low[0]:.6g}, {low[1]:.6g}) to "
                f"({high[0]:.6g}, {high[1]:.6g}) px and the {picture} has {width} × {height}",
                f"coordinates are in {unit}",
            )
            return None
        if crosses_itself(outline):
            remedy = "give the points around it in order"
            if len(outline) == 4:
                remedy = "give them around it: top left, top right, bottom right, bottom left"
            self.fault(number, key, f"the outline of the region '{spec.name}' crosses itself", remedy)
            return None
        if spec.layout is not None and not _convex(outline):
            self.fault(number, key, f"the corners of '{spec.name}' are no convex quadrangle", "check each corner")
            return None
        return outline


def _convex(corners: Floats) -> bool:
    sides = np.roll(corners, -1, axis=0) - corners
    following = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    return bool(np.all(turns > 0) or np.all(turns < 0))
