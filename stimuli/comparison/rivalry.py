"""How the two views of a pair compare where they show the same: luminance, contrast, and how well they agree.

The right view is taken where the disparity of each square puts it, so that depth is not counted twice. Agreement is the
interocular correlation [Cormack1991] of local contrasts.
"""

from __future__ import annotations

import numpy as np

from documents import in_threads
from documents.arrays import Floats
from stimuli.comparison.disparities import LEAST_SQUARES, Place
from stimuli.comparison.eye_identity import LOCAL_MEAN_PX, local_contrast
from stimuli.comparison.jackknife import EyesPair, jackknifed
from stimuli.comparison.luminance import Views


def rivalry_measures(
    pairs: tuple[Views, Views], squares: list[Place], side: int, places: list[Floats]
) -> dict[str, EyesPair]:
    """Return how luminance and contrast of the right eye compare with the left's, and how the two agree."""
    if len(squares) < LEAST_SQUARES:
        return {}
    photo, rendering = in_threads(lambda number: _square_sums(pairs[number], squares, side, places[number]), (0, 1))
    return jackknifed(
        photo, rendering, {"eye luminance": _luminance, "eye contrast": _contrast, "eye agreement": _correlation}
    )


def _square_sums(views: Views, squares: list[Place], side: int, places: Floats) -> Floats:
    """Return sums (squares, 7): luminance and contrast of either eye, products and squares of local contrast."""
    from scipy.ndimage import uniform_filter

    local = [local_contrast(plane) for plane in (views.left, views.right)]
    means = [
        uniform_filter(plane, min(LOCAL_MEAN_PX, *plane.shape), mode="nearest") for plane in (views.left, views.right)
    ]
    away = [np.abs(plane - mean) for plane, mean in zip((views.left, views.right), means, strict=True)]
    height, width = views.left.shape
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
