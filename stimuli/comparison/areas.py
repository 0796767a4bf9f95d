"""Areas of a picture, as outlines in pixels: which pixels lie in an area, and their mean colour.

The origin is the top left corner of the picture and pixels are squares: the first pixel's centre lies at (0.5, 0.5) and
the picture ends at its width and height. A pixel belongs to an area if its centre lies inside, and of two areas that
share an edge to one only.

Means are taken in one pass over the rows, with sums in float64. The standard error of a mean comes from the scatter of
the means of small cells of the area, after a plane through them was subtracted: neighbouring pixels are not independent
(demosaicing, blur, texture), means of cells nearly are, and light that falls off evenly is no noise. An area with too
few whole cells has no standard error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from documents import Finding
from documents.arrays import Floats
from stimuli.errors import StimulusError
from stimuli.pictures.rows import Mask, Rows, RowsDone, bands

# Cells along the longer side of an area, and their least side in pixels.
CELLS_ACROSS, LEAST_CELL_PX = 8, 4
# A plane takes three; of fewer cells than this the scatter is unreliable.
LEAST_CELLS = 12
# More are not read.
_MOST_FINDINGS = 20


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
    crossings = np.zeros((len(y), width + 1), dtype=np.uint8)
    for ends in zip(outline_px, np.roll(outline_px, -1, axis=0), strict=True):
        # From above down, so that two outlines round a shared side alike whichever way each goes along it.
        (x1, y1), (x2, y2) = ends if ends[0][1] <= ends[1][1] else ends[::-1]
        at = np.flatnonzero((y >= y1) & (y < y2))
        if len(at):
            x = x1 + (y[at] - y1) * ((x2 - x1) / (y2 - y1))
            np.add.at(crossings, (at, np.clip(np.ceil(x - 0.5).astype(int) - columns.start, 0, width)), 1)
    # Only odd and even count, which an overflow leaves as they are.
    return np.asarray(np.cumsum(crossings[:, :width], axis=1, dtype=np.uint8) & 1).view(np.bool_)


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


@dataclass(frozen=True, eq=False, slots=True)
class AreaMean:
    """One area of one picture: mean and standard deviation of its pixels' ``XYZ``, (3,) each, in the picture's unit.

    ``covariance_XYZ``, (3, 3), is that of the mean; None where it is not known.
    """

    pixels: int
    XYZ: Floats
    sd_XYZ: Floats
    covariance_XYZ: Floats | None
    saturated_share: float


class _Sums:
    """The sums over one area while the picture is read."""

    def __init__(self, outline_px: Floats, shape: tuple[int, ...]) -> None:
        self.outline_px = outline_px
        self.rows, self.columns = window(outline_px, shape)
        height, width = self.rows.stop - self.rows.start, self.columns.stop - self.columns.start
        self.cell_px = max(LEAST_CELL_PX, max(height, width) // CELLS_ACROSS)
        self.cells = (-(-height // self.cell_px), -(-width // self.cell_px))
        self.cell_sums = np.zeros((3, *self.cells))
        self.cell_pixels = np.zeros(self.cells, dtype=np.int64)
        self.squares = np.zeros(3)
        self.mean = np.zeros(3)
        self.pixels = self.saturated = self.bad = 0

    def add(self, band: slice, picture: NDArray[np.floating], flags: Mask | None) -> None:
        """Take in the rows of ``band``, whose pixels are ``picture`` (rows, width, 3)."""
        rows = slice(max(band.start, self.rows.start), min(band.stop, self.rows.stop))
        own = slice(rows.start - band.start, rows.stop - band.start)
        mask = inside(self.outline_px, rows, self.columns)
        count = int(np.count_nonzero(mask))
        if not count:
            return
        whole = count == mask.size
        # Planes, so that NumPy's sums run pairwise along them.
        part = picture[own, self.columns]
        planes = np.ascontiguousarray((part.reshape(-1, 3) if whole else part[mask]).T, dtype=np.float64)
        if not np.isfinite(planes).all():  # reported at the end, for all regions at once
            finite = np.isfinite(planes).all(axis=0)
            self.bad += count - int(np.count_nonzero(finite))
            planes[:, ~finite] = 0.0
        if flags is not None:
            full = flags[own, self.columns][mask]
            self.saturated += int(np.count_nonzero(full.any(axis=1) if full.ndim == 2 else full))
        self._add_cells(rows, planes, mask)
        # Parts are joined as in [Chan1983], so that nothing cancels.
        mean = planes.mean(axis=1)
        apart = mean - self.mean
        total = self.pixels + count
        planes -= mean[:, None]
        planes *= planes
        self.squares += planes.sum(axis=1) + apart**2 * (self.pixels * count / total)
        self.mean += apart * (count / total)
        self.pixels = total

    def _add_cells(self, rows: slice, planes: Floats, mask: Mask) -> None:
        """Take in the cells' sums of planes (3, n): the pixels in ``mask`` of some rows."""
        first, last = rows.start - self.rows.start, rows.stop - self.rows.start
        row, column = np.arange(first, last) // self.cell_px, np.arange(mask.shape[1]) // self.cell_px
        if planes.shape[1] == mask.size:
            # Every pixel lies inside: sums along lines take a quarter of the time of sums by each pixel's cell.
            columns, lines = (np.flatnonzero(np.diff(cells, prepend=-1)) for cells in (column, row))
            sums = np.add.reduceat(planes.reshape(3, *mask.shape), columns, axis=2)
            here = slice(row[0], row[-1] + 1)
            self.cell_sums[:, here] += np.add.reduceat(sums, lines, axis=1)
            self.cell_pixels[here] += np.outer(np.bincount(row - row[0]), np.bincount(column))
            return
        cell = (row[:, None] * self.cells[1] + column)[mask]
        size = self.cells[0] * self.cells[1]
        self.cell_pixels += np.bincount(cell, minlength=size).reshape(self.cells)
        for channel in range(3):
            self.cell_sums[channel] += np.bincount(cell, planes[channel], size).reshape(self.cells)

    def result(self) -> AreaMean:
        sd = np.sqrt(self.squares / (self.pixels - 1)) if self.pixels > 1 else np.zeros(3)
        return AreaMean(self.pixels, self.mean, sd, self._covariance(), self.saturated / self.pixels)

    def _covariance(self) -> Floats | None:
        whole = self.cell_pixels == self.cell_px**2
        count = int(np.count_nonzero(whole))
        if count < LEAST_CELLS:
            return None
        row, column = np.nonzero(whole)
        plane = np.column_stack([np.ones(count), row, column]).astype(np.float64)
        means = self.cell_sums[:, whole].T / self.cell_px**2
        left = means - plane @ np.linalg.lstsq(plane, means, rcond=None)[0]
        return np.asarray(left.T @ left / (count - 3) * (self.cell_px**2 / self.pixels))


def area_means(
    picture: Rows,
    outlines: Sequence[tuple[str, Floats]],
    saturated: Mask | None = None,
    *,
    least_pixels: int = 1,
    what: str = "picture",
    rows_done: RowsDone | None = None,
) -> tuple[AreaMean, ...]:
    """Return the mean colour of each area of a picture, (height, width, 3), in one pass over the rows that are needed.

    ``outlines`` are names and outlines (n, 2) in pixels as `PairedArea` has them; ``what`` is what messages call the
    picture. ``rows_done`` is called with how many rows of how many are done.

    Raises
    ------
    StimulusError
        For every area that holds fewer than ``least_pixels`` pixels, or values that are no finite numbers.
    """
    gathered = [_Sums(outline, picture.shape) for _, outline in outlines]
    for band in bands(picture.shape):
        here = [sums for sums in gathered if sums.rows.start < band.stop and sums.rows.stop > band.start]
        if here:
            low, high = min(sums.rows.start for sums in here), max(sums.rows.stop for sums in here)
            part = slice(max(low, band.start), min(high, band.stop))
            rows, flags = picture[part], None if saturated is None else saturated[part]
            for sums in here:
                sums.add(part, rows, flags)
        if rows_done is not None:
            rows_done(band.stop, picture.shape[0])
    faults = []
    for (name, _), sums in zip(outlines, gathered, strict=True):
        if sums.pixels < max(1, least_pixels):
            faults.append(
                Finding(
                    f"the region '{name}' holds {sums.pixels} pixels of the {what}, fewer than {max(1, least_pixels)}",
                    remedy="make it larger, or set 'least_pixels'",
                )
            )
        elif sums.bad:
            faults.append(Finding(f"the region '{name}' holds {sums.bad} pixels of the {what} that are no numbers"))
    if len(faults) > _MOST_FINDINGS:
        faults[_MOST_FINDINGS:] = [Finding(f"{len(faults) - _MOST_FINDINGS} more regions have such faults")]
    if faults:
        raise StimulusError(faults)
    return tuple(sums.result() for sums in gathered)
