"""What two eyes see in a pair of views, measured on the photograph's and on the rendering's place by place.

Both pairs are divided into the same squares. In each square the left view is registered to the right one, which gives
its disparity; scene depth cancels in the difference of rendering and photograph at one place. Luminance, contrast and
agreement of the two views are compared at that disparity, and sparkles of one eye are paired with those of the other
about it. Standard errors are by the jackknife over squares, so that what both pictures have in common cancels in the
error too, and what they have not, as other flakes, does not.

The right view is taken where the disparity of each square puts it, so that depth is not counted twice. Agreement is the
interocular correlation [Cormack1991] of local contrasts. A sparkle of the left view and one of the right are one if
each is the nearest to where the disparity of its square puts the other, and nearer than `SAME_PX`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from documents import in_threads
from documents.arrays import Floats, Floats32
from stimuli.align.disparity import DisparityReport
from stimuli.comparison.disparities import (
    LEAST_SQUARES,
    EyesPair,
    Place,
    depth_measures,
    filled_in,
    jackknifed,
    kept_squares,
    register_views,
    squares_of,
)
from stimuli.comparison.eye_identity import LOCAL_MEAN_PX, ViewPair, local_contrast
from stimuli.errors import StimulusError
from stimuli.pictures.rows import Mask
from stimuli.sparkles.find import SparkleThreshold, find_peaks

# Squares have a fifth of the shorter side up to the usual, and a twentieth of larger pictures, within these bounds.
_SHARE, _USUAL_PX, _MOST_ACROSS, _SQUARE_PX = 5, 64, 20, (48, 96)


@dataclass(frozen=True, eq=False, slots=True)
class Binocular:
    """What two eyes see in both pairs; ``measures`` by name, those that are known.

    ``across`` and ``down`` are disparities of squares that both have, (n, 2): the photograph's and the rendering's, at
    ``middle_px`` (n, 2). ``same_views`` is true if the rendering's views are one and the photograph's are not.
    """

    photo: DisparityReport
    rendering: DisparityReport
    middle_px: Floats
    across: Floats
    down: Floats
    measures: Mapping[str, EyesPair]
    sparkles: tuple[SparkleDepth, SparkleDepth] | None
    same_views: bool


def measure_binocular(
    photo: ViewPair, rendering: ViewPair, counted: Mask, sparkling: Mask, least_relief_px: float = 0.5
) -> Binocular:
    """Return what two eyes see in both pairs, on one grid, where ``counted``; sparkles where ``sparkling``.

    Of a photograph with less relief than ``least_relief_px``, the scale of depth is not measured.
    """
    height, width = photo[0].shape
    shorter = min(height, width)
    side = min(int(np.clip(max(min(shorter // _SHARE, _USUAL_PX), shorter // _MOST_ACROSS), *_SQUARE_PX)), shorter)
    reports = in_threads(lambda views: register_views(views, side), (photo, rendering))
    fields = [kept_squares(report, counted) for report in reports]
    shared = sorted(set(fields[0]) & set(fields[1]))
    middle = np.array(shared, dtype=np.float64).reshape(-1, 2)
    across, down, noise = (
        np.array([[one[place][axis] for one in fields] for place in shared], dtype=np.float64).reshape(-1, 2)
        for axis in (0, 1, 2)
    )
    measures = depth_measures(
        middle, across, down, float(np.sum(noise)) / max(1, len(shared)), (width, height), least_relief_px
    )
    squares = squares_of(photo[0].shape, side, counted)
    places = [filled_in(fields[number], fields[1 - number], squares) for number in (0, 1)]
    measures |= rivalry_measures((photo, rendering), squares, side, places)
    of_sparkles, sparkles = sparkle_measures((photo, rendering), sparkling, squares, places)
    measures |= of_sparkles
    same = [bool(np.array_equal(*views)) for views in (photo, rendering)]
    return Binocular(reports[0], reports[1], middle, across, down, measures, sparkles, same[1] and not same[0])


def rivalry_measures(
    pairs: tuple[ViewPair, ViewPair], squares: list[Place], side: int, places: list[Floats]
) -> dict[str, EyesPair]:
    """Return how luminance and contrast of the right eye compare with the left's, and how the two agree."""
    if len(squares) < LEAST_SQUARES:
        return {}
    photo, rendering = in_threads(lambda number: _square_sums(pairs[number], squares, side, places[number]), (0, 1))
    return jackknifed(
        photo, rendering, {"eye luminance": _luminance, "eye contrast": _contrast, "eye agreement": _correlation}
    )


def _square_sums(views: ViewPair, squares: list[Place], side: int, places: Floats) -> Floats:
    """Return sums (squares, 7): luminance and contrast of either eye, products and squares of local contrast."""
    from scipy.ndimage import uniform_filter

    local = [local_contrast(plane) for plane in views]
    means = [uniform_filter(plane, min(LOCAL_MEAN_PX, *plane.shape), mode="nearest") for plane in views]
    away = [np.abs(plane - mean) for plane, mean in zip(views, means, strict=True)]
    height, width = views[0].shape
    sums = np.zeros((len(squares), 7))
    for number, ((x, y), (across, down)) in enumerate(zip(squares, np.round(places).astype(int).tolist(), strict=True)):
        left, top = round(x - (side - 1) / 2), round(y - (side - 1) / 2)
        first, last = max(left, -across, 0), min(left + side, width - across, width)
        upper, lower = max(top, -down, 0), min(top + side, height - down, height)
        if last <= first or lower <= upper:
            continue
        here = (slice(upper, lower), slice(first, last))
        there = (slice(upper + down, lower + down), slice(first + across, last + across))
        one, other = local[0][here], local[1][there]
        sums[number] = (
            means[0][here].sum(dtype=np.float64),
            means[1][there].sum(dtype=np.float64),
            away[0][here].sum(dtype=np.float64),
            away[1][there].sum(dtype=np.float64),
            np.vdot(one, other),
            np.vdot(one, one),
            np.vdot(other, other),
        )
    return sums


def _luminance(total: Floats) -> float:
    return float(np.log(total[1] / total[0])) if min(total[:2]) > 0 else float("nan")


def _contrast(total: Floats) -> float:
    if min(total[:4]) <= 0:
        return float("nan")
    return float(np.log((total[3] / total[1]) / (total[2] / total[0])))


def _correlation(total: Floats) -> float:
    return float(total[4] / np.sqrt(total[5] * total[6])) if min(total[5:]) > 0 else float("nan")


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
    pairs: tuple[ViewPair, ViewPair], sparkling: Mask, squares: list[Place], places: list[Floats]
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
    views: ViewPair, sparkling: Mask, squares: list[Place], places: Floats
) -> tuple[SparkleDepth, Floats] | None:
    """Return the sparkles of a pair, and sums by squares (n, 4): left, right, both, px off the surface."""
    from scipy.spatial import KDTree

    try:
        found = [find_peaks(plane, SparkleThreshold()) for plane in views]
    except StimulusError:
        return None  # half of the picture is brighter than a sparkle has to be
    at = []
    for plane, peaks in zip(views, found, strict=True):
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
