"""How a chart's patches lie between its corners: rows and columns of squares, seen in perspective."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from documents import Finding
from stimuli.errors import StimulusError

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ChartLayout:
    """``rows`` of ``columns`` square patches, ``gap`` of a patch's side apart; the ColorChecker's if not said."""

    rows: int = 4
    columns: int = 6
    gap: float = 0.15

    def __len__(self) -> int:
        return self.rows * self.columns

    @property
    def size(self) -> tuple[float, float]:
        """Width and height from outer corner to outer corner, in sides of a patch."""
        return (
            self.columns + (self.columns - 1) * self.gap,
            self.rows + (self.rows - 1) * self.gap,
        )

    def centres(self) -> Floats:
        """Return the centres (n, 2) of the patches, x and y, row by row from the top left, in sides of a patch."""
        rows, columns = np.divmod(np.arange(len(self)), self.columns)
        return np.column_stack([columns, rows]) * (1.0 + self.gap) + 0.5

    def outline(self) -> Floats:
        """Return the outer corners (4, 2): top left, top right, bottom right, bottom left."""
        width, height = self.size
        return np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])


COLORCHECKER = ChartLayout()


def check_corners(corners_px: ArrayLike, shape: tuple[int, ...], file: str | None = None) -> Floats:
    """Return the corners (4, 2), x and y in pixels; StimulusError unless they are a convex quadrangle in the picture.

    Pixel centres lie at whole numbers and a half: the picture is from 0 to its width and height.
    """
    corners = np.asarray(corners_px, dtype=np.float64)
    height, width = shape[:2]
    if corners.shape != (4, 2) or not np.all(np.isfinite(corners)):
        raise StimulusError(Finding(f"a chart has four corners x,y, not {corners.tolist()}", file))
    if np.any(corners < 0) or np.any(corners > [width, height]):
        raise StimulusError(
            Finding(
                f"a corner of the chart lies outside the picture of {width} × {height} pixels: {corners.tolist()}",
                file,
                remedy="give x,y in pixels from the top left",
            )
        )
    sides = np.roll(corners, -1, axis=0) - corners
    following = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    if not (np.all(turns > 0) or np.all(turns < 0)):
        raise StimulusError(
            Finding(
                "the chart's corners are no convex quadrangle",
                file,
                remedy="give them around the chart: top left, top right, bottom right, bottom left",
            )
        )
    return corners


def perspective(source: Floats, target: Floats) -> Floats:
    """Return the perspective matrix (3, 3) that takes four points (4, 2) to four others."""
    rows = []
    for (x, y), (u, v) in zip(source, target, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
    numbers = np.linalg.solve(np.array(rows), target.ravel())
    return np.append(numbers, 1.0).reshape(3, 3)


def project(matrix: Floats, points: Floats) -> Floats:
    """Return points (..., 2) after the perspective matrix (3, 3)."""
    lifted = np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1) @ matrix.T
    return np.asarray(lifted[..., :2] / lifted[..., 2:])


def patch_quadrangles(corners_px: Floats, layout: ChartLayout = COLORCHECKER, inner: float = 0.5) -> Floats:
    """Return the inner part of each patch, (n, 4, 2) in pixels; ``inner`` is its side as a share of the patch's."""
    matrix = perspective(layout.outline(), corners_px)
    around = 0.5 * inner * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return project(matrix, layout.centres()[:, None, :] + around[None])
