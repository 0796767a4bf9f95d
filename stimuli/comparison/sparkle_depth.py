"""The sparkles that both eyes see, and those that one eye sees alone.

A sparkle of the left view and one of the right are one if each is the nearest to where the disparity of its square puts
the other, and nearer than `SAME_PX`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from documents import in_threads
from documents.arrays import Floats, Floats32
from stimuli.comparison.disparities import Place
from stimuli.comparison.jackknife import EyesPair, jackknifed
from stimuli.comparison.luminance import Views
from stimuli.errors import StimulusError
from stimuli.pictures.rows import Mask
from stimuli.sparkle.measures.find import Threshold, find_peaks

# With fewer in both eyes together, nothing is known of them.
LEAST_SPARKLES = 60
SAME_PX = 1.5


@dataclass(frozen=True, eq=False, slots=True)
class SparkleDepth:
    """The sparkles of a pair of views: their number in either eye and both, and the disparities of those in both."""

    left: int
    right: int
    both: int
    disparity_px: Floats


def sparkle_measures(
    pairs: tuple[Views, Views], sparkling: Mask, squares: list[Place], places: list[Floats]
) -> tuple[dict[str, EyesPair], tuple[SparkleDepth, SparkleDepth] | None]:
    """Return the measures of the sparkles of both pairs within ``sparkling``, and their numbers; none of too few."""
    if not (squares and sparkling.any()):
        return {}, None
    first, second = in_threads(
        lambda number: _sparkles(pairs[number], sparkling, squares, places[number]), range(len(pairs))
    )
    if first is None or second is None:
        return {}, None
    (photo, photo_sums), (rendering, rendering_sums) = first, second
    if min(one.left + one.right for one in (photo, rendering)) < LEAST_SPARKLES:
        return {}, None
    measures = jackknifed(photo_sums, rendering_sums, {"one-eyed share": _one_eyed, "sparkle depth": _depth})
    return measures, (photo, rendering)


def _sparkles(
    views: Views, sparkling: Mask, squares: list[Place], places: Floats
) -> tuple[SparkleDepth, Floats] | None:
    """Return the sparkles of a pair, and sums by squares (n, 4): left, right, both, px off the surface."""
    from scipy.spatial import KDTree

    try:
        found = [find_peaks(plane, Threshold()) for plane in (views.left, views.right)]
    except StimulusError:
        return None  # half of the picture is brighter than a sparkle has to be
    at = []
    for plane, peaks in zip((views.left, views.right), found, strict=True):
        here = sparkling[peaks.row, peaks.column]
        at.append(_tops(plane, peaks.row[here], peaks.column[here]))
    left, right = at
    nearest = KDTree(np.array(squares))
    sums = np.zeros((len(squares), 4))
    if not (len(left) and len(right)):
        return SparkleDepth(len(left), len(right), 0, np.empty(0)), sums
    left_square, right_square = (np.asarray(nearest.query(eye)[1]) for eye in (left, right))
    expected = left + places[left_square]
    apart, there = KDTree(right).query(expected)
    _, back = KDTree(expected).query(right)
    both = (np.asarray(back)[there] == np.arange(len(left))) & (apart < SAME_PX)
    disparity = (right[there] - left)[both, 0]
    for column, (square, weight) in enumerate(
        (
            (left_square, None),
            (right_square, None),
            (left_square[both], None),
            (left_square[both], (right[there] - expected)[both, 0]),
        )
    ):
        sums[:, column] = np.bincount(square, weight, minlength=len(squares))
    return SparkleDepth(len(left), len(right), int(both.sum()), disparity), sums


def _tops(plane: Floats32, row: NDArray[np.int64], column: NDArray[np.int64]) -> Floats:
    """Return where parabolas through the brightest pixels and their neighbours are highest, (n, 2), x and y."""
    padded = np.pad(plane, 1, mode="edge").astype(np.float64)
    middle = padded[row + 1, column + 1]
    places = []
    for at, before, after in (
        (column, padded[row + 1, column], padded[row + 1, column + 2]),
        (row, padded[row, column + 1], padded[row + 2, column + 1]),
    ):
        bend = 2 * (2 * middle - before - after)
        top = np.divide(after - before, bend, out=np.zeros_like(bend), where=bend > 0)
        places.append(at + np.clip(top, -0.5, 0.5))
    return np.column_stack(places)


def _one_eyed(total: Floats) -> float:
    left, right, both, _ = total
    return float((left + right - 2 * both) / (left + right - both)) if left + right > 0 else float("nan")


def _depth(total: Floats) -> float:
    return float(total[3] / total[2]) if total[2] > 0 else float("nan")
