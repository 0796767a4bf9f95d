"""What is compared: named areas of a photograph and of its rendering, as outlines in pixels.

The origin is the top left corner of the picture and pixels are squares: the first pixel's centre lies at (0.5, 0.5) and
the picture ends at its width and height. A pixel belongs to an area if its centre lies inside, and of two areas that
share an edge to one only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from devices.chart.layout import COLORCHECKER, ChartLayout

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Kind = Literal["patch", "rectangle", "polygon", "plate", "cell"]


@dataclass(frozen=True, eq=False, slots=True)
class Region:
    """An area of both pictures: ``photo_px`` and ``rendering_px`` are its outlines, (n, 2) and (m, 2), x and y.

    ``entry`` is the entry of the regions file that it comes from, ``number`` its place there (a patch's number, 1 to
    24). Sparkles are to be compared on it if ``sparkle``.
    """

    name: str
    kind: Kind
    photo_px: Floats
    rendering_px: Floats
    entry: str
    number: int | None = None
    sparkle: bool = False


@dataclass(frozen=True, eq=False, slots=True)
class Chart:
    """A ColorChecker between its four outer corners, (4, 2) in pixels, in both pictures; patches as in `Region`."""

    entry: str
    photo_px: Floats
    rendering_px: Floats
    inner: float
    layout: ChartLayout = COLORCHECKER


@dataclass(frozen=True, slots=True)
class PlacedRegions:
    """Regions at their places in two pictures of known size; ``charts`` are those whose colours are known."""

    regions: tuple[Region, ...]
    charts: tuple[Chart, ...] = ()


def window(outline_px: Floats, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Return the rows and columns of a picture (height, width, ...) that an outline (n, 2) reaches into."""
    low = np.maximum(np.floor(outline_px.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(outline_px.max(axis=0)).astype(int), [shape[1], shape[0]])
    return slice(int(low[1]), max(int(low[1]), int(high[1]))), slice(int(low[0]), max(int(low[0]), int(high[0])))


def inside(outline_px: Floats, rows: slice, columns: slice) -> Mask:
    """Return which pixels of a window lie inside an outline (n, 2), shape (rows, columns), by the even-odd rule."""
    y = np.arange(rows.start, rows.stop) + 0.5
    width = columns.stop - columns.start
    # Where the outline crosses a row of centres, inside turns into outside: from the next centre on.
    crossings = np.zeros((len(y), width + 1), dtype=np.int32)
    for ends in zip(outline_px, np.roll(outline_px, -1, axis=0), strict=True):
        # From above down, so that two outlines round a shared side alike whichever way each goes along it.
        (x1, y1), (x2, y2) = ends if ends[0][1] <= ends[1][1] else ends[::-1]
        at = np.flatnonzero((y >= y1) & (y < y2))
        if len(at):
            x = x1 + (y[at] - y1) * ((x2 - x1) / (y2 - y1))
            np.add.at(crossings, (at, np.clip(np.ceil(x - 0.5).astype(int) - columns.start, 0, width)), 1)
    return np.asarray(np.cumsum(crossings[:, :width], axis=1, dtype=np.int32) & 1, dtype=np.bool_)


def crosses_itself(outline_px: Floats) -> bool:
    """Return whether two sides of an outline (n, 2) that are no neighbours meet, or a side goes back on the last."""
    start, end = outline_px, np.roll(outline_px, -1, axis=0)
    count = len(start)

    def side_of(a: Floats, b: Floats, p: Floats) -> Floats:
        """Twice the signed area of a, b, p for all sides (i) and points (j): 0 where p is on the line."""
        ab = (b - a)[:, None, :]
        ap = p[None, :, :] - a[:, None, :]
        return np.asarray(ab[..., 0] * ap[..., 1] - ab[..., 1] * ap[..., 0])

    to_start, to_end = side_of(start, end, start), side_of(start, end, end)
    apart = (to_start * to_end) > 0  # both ends of side j on one side of side i
    low, high = np.minimum(start, end), np.maximum(start, end)
    boxes = np.all((low[:, None] <= high[None]) & (low[None] <= high[:, None]), axis=-1)
    meet = boxes & ~apart & ~apart.T
    gap = np.abs(np.arange(count)[:, None] - np.arange(count)[None])
    meet &= (gap > 1) & (gap < count - 1)
    following = np.roll(end - start, -1, axis=0)
    sides = end - start
    turn = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    back = (turn == 0) & (np.sum(sides * following, axis=1) < 0)
    return bool(meet.any() or back.any())
