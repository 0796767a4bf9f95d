"""Tables of a profile from device codes to the connection space: ``mft1``, ``mft2`` and ``mAB ``.

[ICC2022], 10.10 to 10.12. Curves, a grid, curves, a matrix and curves again, of which a profile may leave out all but
the last. Between the grid's points the colours of the tetrahedron around a code are weighted [Kasson1993], as
most programs do; ICC leaves that open.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from devices.colour import lab_to_xyz
from devices.colour.white_points import WHITE_POINTS_XYZ
from devices.profiles.curves import SampledCurve, TagCurve, curves_at
from devices.profiles.tag_table import Tag
from documents.arrays import Floats

# The largest value of u1Fixed15, which XYZ is stored in.
XYZ_RANGE = 65535.0 / 32768.0
# Lab of ``mft2`` keeps the coding of version 2, in which 0xFF00 is 100.
_LAB_16_OF_V2 = 65535.0 / 65280.0


Stage = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True, eq=False)
class ProfileTable:
    """The ``stages`` that colours (n, 3) run through, as shares of each coding's range in 0..1.

    ``pcs`` is the connection space at its one end, ``XYZ`` or ``Lab``, and ``stretch`` scales the coding of its Lab.
    """

    pcs: str
    stages: tuple[Stage, ...]
    stretch: float = 1.0

    def xyz(self, codes: ArrayLike) -> Floats:
        """Return XYZ (n, 3) of the connection space (D50 with Y = 1 is white) for device codes (n, 3) in 0..1."""
        values = self.through(codes)
        if self.pcs == "XYZ":
            return values * XYZ_RANGE
        lab = values * self.stretch * (100.0, 255.0, 255.0) - (0.0, 128.0, 128.0)
        return lab_to_xyz(lab, WHITE_POINTS_XYZ["icc-d50"])

    def through(self, values: ArrayLike) -> Floats:
        """Return what becomes of ``values`` (n, 3) in 0..1."""
        out = np.clip(np.asarray(values, dtype=np.float64), 0.0, 1.0)
        for stage in self.stages:
            out = stage(out)
        return out


def _curves(curves: Sequence[TagCurve]) -> Stage:
    return lambda values: np.stack([curve(values[:, channel]) for channel, curve in enumerate(curves)], axis=1)


def _grid(grid: Floats) -> Stage:
    return lambda values: between(grid, values)


def _matrix(numbers: Floats) -> Stage:
    rows, offset = numbers[:9].reshape(3, 3), numbers[9:]
    return lambda values: np.clip(values @ rows.T + offset, 0.0, 1.0)


def between(grid: Floats, values: Floats) -> Floats:
    """Return what ``grid`` (r, g, b, k) holds at ``values`` (n, 3) in 0..1, shape (n, k), weighted in tetrahedra."""
    last = np.array(grid.shape[:3]) - 1
    place = np.clip(values, 0.0, 1.0) * last
    base = np.minimum(place.astype(np.intp), np.maximum(last - 1, 0))
    share = place - base
    order = np.argsort(-share, axis=1, kind="stable")
    ordered = np.take_along_axis(share, order, axis=1)
    rows = np.arange(len(values))
    corner = base.copy()
    out = (1.0 - ordered[:, :1]) * grid[tuple(corner.T)]
    for step in range(3):
        axis = order[:, step]
        corner[rows, axis] = np.minimum(corner[rows, axis] + 1, last[axis])
        following = ordered[:, step + 1 : step + 2] if step < 2 else 0.0
        out = out + (ordered[:, step : step + 1] - following) * grid[tuple(corner.T)]
    return np.asarray(out)


def read_table(tag: Tag, pcs: str) -> ProfileTable:
    """Return the table in ``tag`` of a profile that connects to ``pcs``, ``XYZ`` or ``Lab``.

    Of the type ``mBA ``, which leads back to codes, `ProfileTable.through` takes and gives shares of each coding.

    Raises
    ------
    DeviceError
        If it is of another type, not from three channels to three, or cut off.
    """
    if tag.type not in ("mft1", "mft2", "mAB ", "mBA "):
        raise tag.wrong_type("'mft1', 'mft2' or 'mAB '")
    channels, outputs = tag.whole(8, "B"), tag.whole(9, "B")
    if (channels, outputs) != (3, 3):
        raise tag.error(f"leads from {channels} channels to {outputs}", "3 to 3 is needed")
    return _in_a_row(tag, pcs) if tag.type.startswith("mft") else _by_offsets(tag, pcs)


def _in_a_row(tag: Tag, pcs: str) -> ProfileTable:
    """Read ``mft1`` or ``mft2``: input tables, grid, output tables, without gaps."""
    points = tag.whole(10, "B")
    if points < 2:
        raise tag.error(f"has a grid of {points} points a side", "2 at least")
    wide = tag.type == "mft2"
    entries = (tag.whole(48, "H"), tag.whole(50, "H")) if wide else (256, 256)
    if min(entries) < 2:
        raise tag.error(f"has curves of {min(entries)} entries", "2 at least")
    start = 52 if wide else 48
    size = 2 if wide else 1
    full = 65535.0 if wide else 255.0

    def numbers(at: int, count: int) -> Floats:
        return (tag.u16(at, count) if wide else tag.u8(at, count)).astype(np.float64) / full

    def curves(at: int, count: int) -> Stage:
        return _curves([SampledCurve(row) for row in numbers(at, 3 * count).reshape(3, count)])

    first = curves(start, entries[0])
    start += 3 * entries[0] * size
    grid = numbers(start, 3 * points**3).reshape(points, points, points, 3)
    last = curves(start + 3 * points**3 * size, entries[1])
    return ProfileTable(pcs, (first, _grid(grid), last), _LAB_16_OF_V2 if wide else 1.0)


def _by_offsets(tag: Tag, pcs: str) -> ProfileTable:
    """Read ``mAB `` or ``mBA ``: each stage where its offset says."""
    at_last, at_matrix, at_middle, at_grid, at_first = (tag.whole(12 + 4 * i, "I") for i in range(5))
    if not at_last:
        raise tag.error("has no curves at its end ('B')", "the profile is damaged")
    if bool(at_grid) != bool(at_first):
        raise tag.error("has a grid without curves before it, or these without it", "the profile is damaged")
    found = [
        _curves(curves_at(tag, at_first, 3)) if at_first else None,
        _grid(_grid_at(tag, at_grid)) if at_grid else None,
        _curves(curves_at(tag, at_middle, 3)) if at_middle else None,
        _matrix(tag.fixed(at_matrix, 12)) if at_matrix else None,
        _curves(curves_at(tag, at_last, 3)),
    ]
    there = [stage for stage in found if stage is not None]
    return ProfileTable(pcs, tuple(there if tag.type == "mAB " else reversed(there)))


def _grid_at(tag: Tag, at: int) -> Floats:
    red, green, blue = (int(points) for points in tag.u8(at, 3))
    size = tag.whole(at + 16, "B")
    if min(red, green, blue) < 2 or size not in (1, 2):
        what = f"has a grid of {red}x{green}x{blue} points in numbers of {size} bytes"
        raise tag.error(what, "2 points a side at least, in 1 or 2 bytes")
    count = 3 * red * green * blue
    values = tag.u8(at + 20, count) / 255.0 if size == 1 else tag.u16(at + 20, count) / 65535.0
    return np.asarray(values, dtype=np.float64).reshape(red, green, blue, 3)
