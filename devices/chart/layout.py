"""How a chart's patches lie between its corners: rows and columns of squares, seen in perspective."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from documents.arrays import Floats


@dataclass(frozen=True, slots=True)
class ChartLayout:
    """``rows`` of ``columns`` square patches, ``gap`` of a patch's side apart; the ColorChecker's by default."""

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


def perspective(source: Floats, target: Floats) -> Floats:
    """Return the perspective matrix (3, 3) that takes four points (4, 2) to four others.

    Parameters
    ----------
    source, target
        Four points before and after, x and y, shape (4, 2), in any unit; no three on one line.

    Returns
    -------
    ndarray
        The matrix, shape (3, 3), with 1 in its last place; `project` applies it.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> seen = np.array([[20.0, 10.0], [80.0, 10.0], [90.0, 60.0], [10.0, 60.0]])
    >>> project(perspective(square, seen), square).round(6).tolist()
    [[20.0, 10.0], [80.0, 10.0], [90.0, 60.0], [10.0, 60.0]]
    """
    rows = []
    for (x, y), (u, v) in zip(source, target, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
    numbers = np.linalg.solve(np.array(rows), target.ravel())
    return np.append(numbers, 1.0).reshape(3, 3)


def project(matrix: Floats, points: Floats) -> Floats:
    """Return points (..., 2) after the perspective matrix (3, 3).

    Parameters
    ----------
    matrix
        A perspective matrix, shape (3, 3), such as `perspective` returns.
    points
        Points x and y, shape (..., 2), in the unit of the matrix's source.

    Returns
    -------
    ndarray
        The points in the unit of the matrix's target, shape (..., 2).

    Examples
    --------
    >>> matrix = np.array([[2.0, 0.0, 10.0], [0.0, 2.0, 20.0], [0.0, 0.0, 1.0]])
    >>> project(matrix, np.array([[0.0, 0.0], [5.0, 5.0]])).tolist()
    [[10.0, 20.0], [20.0, 30.0]]
    """
    lifted = points @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(lifted[..., :2] / lifted[..., 2:])


def patch_quadrangles(corners_px: Floats, layout: ChartLayout = COLORCHECKER, inner: float = 0.5) -> Floats:
    """Return the inner part of each patch, (n, 4, 2) in pixels; ``inner`` is its side as a share of the patch's.

    Parameters
    ----------
    corners_px
        The chart's outer corners in the picture, x and y in pixels, shape (4, 2): its top left, top right, bottom right
        and bottom left.
    layout
        Rows, columns and gaps of the chart.
    inner
        Side of the inner part as a share of the patch's side, in 0..1.

    Returns
    -------
    ndarray
        The corners of each inner part in pixels, shape (n, 4, 2), patches row by row and corners in the order of
        ``corners_px``.

    Examples
    --------
    >>> corners_px = np.array([[100.0, 50.0], [775.0, 50.0], [775.0, 495.0], [100.0, 495.0]])
    >>> patches = patch_quadrangles(corners_px)
    >>> len(patches), patches[0].round(6).tolist()
    (24, [[125.0, 75.0], [175.0, 75.0], [175.0, 125.0], [125.0, 125.0]])
    """
    matrix = perspective(layout.outline(), corners_px)
    around = 0.5 * inner * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return project(matrix, layout.centres()[:, None, :] + around[None])
