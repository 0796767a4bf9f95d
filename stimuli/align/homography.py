"""Pictures of one plane seen by two cameras: the homography or the shift between marked places.

scikit-image estimates the homography, by the direct linear transformation on normalised places [Hartley2003].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from devices.chart import project
from documents.arrays import Floats
from stimuli.align.planes import LEAST_SIDE_PX
from stimuli.errors import StimulusError

# The spread of places across their line, as a share of that along it.
_ON_A_LINE = 1e-5


def homography_from_points(reference_points: ArrayLike, moving_points: ArrayLike) -> Floats:
    """Return the homography that takes reference places (n, 2) to moving places (n, 2), n at least 4.

    Parameters
    ----------
    reference_points
        Places in one picture, (n, 2), x and y in pixels; n is at least 4.
    moving_points
        The same points in the other picture, (n, 2), in the same order.

    Returns
    -------
    ndarray
        Shape (3, 3), its last number 1: it takes places (x, y, 1) of one picture to the other's.

    Raises
    ------
    StimulusError
        If there are fewer than four pairs, a place is not finite, or three of every four lie on one line.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [100.0, 0.0], [0.0, 100.0], [100.0, 100.0]])
    >>> matrix = homography_from_points(square, 2.0 * square + 5.0)   # twice as large, and 5 pixels off
    >>> (np.abs(matrix).round(6) @ [1.0, 1.0, 1.0]).tolist()
    [7.0, 7.0, 1.0]
    """
    reference, moving = (np.asarray(points, dtype=np.float64) for points in (reference_points, moving_points))
    if reference.ndim != 2 or reference.shape != moving.shape or reference.shape[1] != 2 or len(reference) < 4:
        raise StimulusError.of(
            f"the corners have shapes {reference.shape} and {moving.shape}", "give four pairs of places (x, y) or more"
        )
    if not (np.isfinite(reference).all() and np.isfinite(moving).all()):
        raise StimulusError.of("a corner's place is NaN or infinite", "give places in pixels")
    on_a_line = _on_a_line_but_one(reference) or _on_a_line_but_one(moving)
    matrix = None if on_a_line else _estimated(reference, moving)
    if matrix is None:
        raise StimulusError.of(
            "the corners do not fix a homography", "give four places of which no three lie on one line"
        )
    return matrix


@dataclass(frozen=True, slots=True)
class MarkedShift:
    """The shift (across, down) that leaves marked pairs the least distance apart, by least squares.

    ``residual_px`` is the root of the mean squared distance left and ``worst_px`` the longest, of pair ``worst_pair``
    (counted from 1). One pair leaves nothing.
    """

    shift_px: tuple[float, float]
    residual_px: float
    worst_px: float
    worst_pair: int
    pairs: int


def shift_from_points(left_points: ArrayLike, right_points: ArrayLike, shape: tuple[int, ...]) -> MarkedShift:
    """Return the shift of the plane on which pairs of places (n, 2), x and y in pixels, were marked.

    Raises
    ------
    StimulusError
        If there is no pair, the two lists differ in length, or a place is not within a picture of ``shape``.
    """
    left, right = (np.asarray(points, dtype=np.float64) for points in (left_points, right_points))
    for points, name in ((left, "left"), (right, "right")):
        if points.ndim != 2 or points.shape[1] != 2 or len(points) == 0:
            raise StimulusError.of(
                f"the {name} points have shape {points.shape}", "give a list of places, x and y in pixels"
            )
        inside = np.all((points >= -0.5) & (points <= np.array([shape[1], shape[0]]) - 0.5), axis=1)
        if not inside.all():
            first = int(np.flatnonzero(~inside)[0])
            raise StimulusError.of(
                f"point {first + 1} of the {name} picture, {tuple(points[first].tolist())}, lies outside it",
                f"the picture is {shape[1]} × {shape[0]} pixels, counted from 0",
            )
    if len(left) != len(right):
        raise StimulusError.of(
            f"{len(left)} points are marked on the left and {len(right)} on the right", "mark the same points"
        )
    away = right - left
    shift = away.mean(axis=0)
    distance = np.hypot(*(away - shift).T)
    worst = int(distance.argmax())
    return MarkedShift(
        (float(shift[0]), float(shift[1])),
        float(np.sqrt(np.mean(distance**2))),
        float(distance[worst]),
        worst + 1,
        len(left),
    )


def mapped(matrix: ArrayLike, places: ArrayLike) -> Floats:
    """Return the places (..., 2) that the homography ``matrix`` (3, 3) takes ``places`` (..., 2) to."""
    return project(np.asarray(matrix, dtype=np.float64), np.asarray(places, dtype=np.float64))


def common_part(homographies: list[Floats], width: int, height: int, remedy: str) -> tuple[int, int, int, int]:
    """Return the part of pictures, ``width`` by ``height``, that both homographies (3, 3) take to within another.

    First column, first row, column and row after the last. StimulusError with ``remedy`` where that is too little.
    """
    right, bottom = width - 1.0, height - 1.0
    corners = np.array([[0.0, 0.0], [right, 0.0], [0.0, bottom], [right, bottom]])
    # Beyond a right angle from its axis nothing is before a camera.
    if any((np.linalg.inv(matrix)[2] @ (x, y, 1.0)) <= 0 for matrix in homographies for x, y in corners):
        raise StimulusError.of("no part of the plane is common to both turned views", remedy)
    quads = [mapped(np.linalg.inv(matrix), corners) for matrix in homographies]
    first_column = max(0, *(int(np.ceil(x - 1e-6)) for quad in quads for x in quad[[0, 2], 0]))
    first_row = max(0, *(int(np.ceil(y - 1e-6)) for quad in quads for y in quad[[0, 1], 1]))
    last_column = min(width - 1, *(int(np.floor(x + 1e-6)) for quad in quads for x in quad[[1, 3], 0]))
    last_row = min(height - 1, *(int(np.floor(y + 1e-6)) for quad in quads for y in quad[[2, 3], 1]))
    if min(last_column - first_column, last_row - first_row) + 1 < LEAST_SIDE_PX:
        raise StimulusError.of("no part of the plane is common to both turned views", remedy)
    return first_column, first_row, last_column + 1, last_row + 1


def _estimated(reference: Floats, moving: Floats) -> Floats | None:
    """Return the homography (3, 3) between places (n, 2), its last number 1; None if it has no inverse."""
    from skimage.transform import ProjectiveTransform

    transform: Any = ProjectiveTransform  # its methods have no types
    estimate = transform.from_estimate(reference, moving)
    if not estimate:
        return None
    matrix = np.asarray(estimate.params, dtype=np.float64)
    size = np.abs(matrix).max()
    if not np.isfinite(size) or abs(matrix[2, 2]) < 1e-12 * size or abs(np.linalg.det(matrix / size)) < 1e-15:
        return None
    return np.asarray(matrix / matrix[2, 2])


def _on_a_line_but_one(points: Floats) -> bool:
    """Return whether all ``points`` (n, 2), or all but one, lie on one line: they fix no homography then."""
    others = np.array([np.delete(points, left_out, axis=0) for left_out in range(len(points))])
    spread = np.linalg.svd(others - others.mean(axis=1, keepdims=True), compute_uv=False)
    return bool(np.any(spread[:, 1] <= _ON_A_LINE * spread[:, 0]))
