"""What two eyes see in a pair of views, measured on the photograph's and on the rendering's place by place.

Both pairs are divided into the same squares. In each square the left view is registered to the right one, which gives
its disparity; scene depth cancels in the difference of rendering and photograph at one place. Luminance, contrast and
agreement of the two views are compared at that disparity, and sparkles of one eye are paired with those of the other
about it. Standard errors are by the jackknife over squares, so that what both pictures have in common cancels in the
error too, and what they have not, as other flakes, does not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from documents import in_threads
from documents.arrays import Floats
from stimuli.align.disparity import DisparityReport
from stimuli.comparison.disparities import depth_measures, filled_in, kept_squares, register_views, squares_of
from stimuli.comparison.jackknife import EyesPair
from stimuli.comparison.luminance import Views
from stimuli.comparison.rivalry import rivalry_measures
from stimuli.comparison.sparkle_depth import SparkleDepth, sparkle_measures
from stimuli.pictures.rows import Mask

# Squares have a fifth of the shorter side up to the usual, and a twentieth of larger pictures, within these bounds.
_SHARE, _USUAL_PX, _MOST_ACROSS, _SQUARE_PX = 5, 64, 20, (48, 96)


@dataclass(frozen=True, eq=False, slots=True)
class TwoEyes:
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


def measure_two_eyes(
    photo: Views, rendering: Views, counted: Mask, sparkling: Mask, least_relief_px: float = 0.5
) -> TwoEyes:
    """Return what two eyes see in both pairs, on one grid, where ``counted``; sparkles where ``sparkling``.

    Of a photograph with less relief than ``least_relief_px``, the scale of depth is not measured.
    """
    height, width = photo.left.shape
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
    squares = squares_of(photo.left.shape, side, counted)
    places = [filled_in(fields[number], fields[1 - number], squares) for number in (0, 1)]
    measures |= rivalry_measures((photo, rendering), squares, side, places)
    of_sparkles, sparkles = sparkle_measures((photo, rendering), sparkling, squares, places)
    measures |= of_sparkles
    same = [bool(np.array_equal(views.left, views.right)) for views in (photo, rendering)]
    return TwoEyes(reports[0], reports[1], middle, across, down, measures, sparkles, same[1] and not same[0])
