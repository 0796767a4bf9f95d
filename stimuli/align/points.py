"""A shift from places that a person marked in both pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from documents import Finding
from stimuli.errors import StimulusError

Floats = NDArray[np.float64]


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
            raise _error(f"the {name} points have shape {points.shape}", "give a list of places, x and y in pixels")
        inside = np.all((points >= -0.5) & (points <= np.array([shape[1], shape[0]]) - 0.5), axis=1)
        if not inside.all():
            first = int(np.flatnonzero(~inside)[0])
            raise _error(
                f"point {first + 1} of the {name} picture, {tuple(points[first].tolist())}, lies outside it",
                f"the picture is {shape[1]} × {shape[0]} pixels, counted from 0",
            )
    if len(left) != len(right):
        raise _error(f"{len(left)} points are marked on the left and {len(right)} on the right", "mark the same points")
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


def _error(message: str, remedy: str) -> StimulusError:
    return StimulusError(Finding(message, remedy=remedy))
