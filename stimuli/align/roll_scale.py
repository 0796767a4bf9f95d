"""How far one view is turned, or larger, than the other, from the vertical disparities of a pair.

Parallel cameras see every point at one height, whatever its depth: depth and slant make horizontal disparities alone. A
camera that is rolled about its axis, or whose picture is a little larger, shifts places by d = t + s·p + θ·Jp about the
middle, so that the vertical disparity rises by θ from left to right and by s from top to bottom. Both slopes are fitted
at once with Huber's weights [Huber1964], so that a few blocks that were registered wrongly have little weight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from documents.arrays import Floats
from documents.text import JsonResult

LEAST_BLOCKS = 8
_HUBER = 1.345
_MAD_PER_SD = 0.6745
_ROUNDS = 50
# Pictures that are moved by whole pixels agree to the last bit: no block is then an outlier by its rounding.
_LEAST_SD_PX = 1e-9
# Blocks in one row do not determine scale, blocks in one column do not determine roll.
_LEAST_SPREAD = 0.05


@dataclass(frozen=True, slots=True)
class RollScale(JsonResult):
    """The right view beside the left one: ``roll_deg``, turned clockwise, and ``scale``, how many times as large.

    ``roll_se_deg`` and ``scale_se`` are standard errors, ``middle_px`` the vertical disparity in the middle of the
    picture, ``corner_px`` what roll and scale add to it at the worst corner, and ``residual_px`` the scatter of the
    blocks about the fit.
    """

    roll_deg: float
    roll_se_deg: float
    scale: float
    scale_se: float
    middle_px: float
    corner_px: float
    residual_px: float
    blocks: int

    @property
    def certain(self) -> bool:
        """Whether roll or scale is more than three standard errors from none."""
        return bool(abs(self.roll_deg) > 3 * self.roll_se_deg or abs(self.scale - 1) > 3 * self.scale_se)


def fit_roll_scale(places_px: Floats, vertical_px: Floats, size_px: tuple[int, int]) -> RollScale | None:
    """Return roll and scale from the vertical disparities (n,) at places (n, 2) of a picture of ``size_px``.

    None where fewer than eight blocks are there, or they lie along one line.
    """
    width, height = size_px
    from_middle = places_px - (np.array([width, height]) - 1) / 2
    if len(vertical_px) < LEAST_BLOCKS:
        return None
    spread = np.linalg.svd(from_middle - from_middle.mean(axis=0), compute_uv=False)[1]
    if spread < _LEAST_SPREAD * min(size_px) * len(vertical_px) ** 0.5:
        return None
    design = np.column_stack([np.ones(len(vertical_px)), from_middle])
    weight = np.ones(len(vertical_px))
    coefficients = np.zeros(3)
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)
        before, coefficients = coefficients, np.linalg.lstsq(design * root[:, None], vertical_px * root, rcond=None)[0]
        off = vertical_px - design @ coefficients
        sd = max(float(np.median(np.abs(off))) / _MAD_PER_SD, _LEAST_SD_PX)
        weight = _HUBER * sd / np.maximum(np.abs(off), _HUBER * sd)
        if np.abs(coefficients - before).max() < 1e-12:
            break
    freedom = max(1, len(vertical_px) - 3)
    variance = float((weight * off**2).sum()) / freedom
    errors = np.sqrt(variance * np.diag(np.linalg.inv((design * weight[:, None]).T @ design)))
    middle, roll, growth = (float(value) for value in coefficients)
    return RollScale(
        float(np.degrees(np.arctan2(roll, 1 + growth))),
        float(np.degrees(errors[1])),
        float(np.hypot(1 + growth, roll)),
        float(errors[2]),
        middle,
        (abs(roll) * (width - 1) + abs(growth) * (height - 1)) / 2,
        float(np.sqrt(variance)),
        len(vertical_px),
    )
