"""What the gamut clip costs each eye of a picture, also where one picture for both eyes is seen through filters.

Where one picture is made for both eyes, there are three steps from what an eye should see to what it sees: the
mixture, which has three channels for two eyes' six numbers and would cost this much on a display without limits
(``projection_*``); the clip of its light to what the channels have (``delta_e_00_*``); and the rounding to codes, which
is not part of it. Percentages of pixels out of the gamut are of the one picture, and so alike for both eyes; how many
pixels' clip an eye can notice through its filter is counted for each.

An eye behind a filter F sees F · XYZ of the display. Lab is relative to the white that the eye is given: the display's
for what was asked, the display's through the filter for what is seen, as if the eye had wholly adapted to its filter.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.compensation.clipping import ClipCost, check_finite, clip_cost, counted_together, over_blocks
from devices.compensation.mixture import Mixture
from devices.display.display_file import EYES, Eye, EyeModels
from devices.display.model import Clipped, outside_limits, rounding_of, rounding_of_half
from documents.arrays import Floats

Pixels = NDArray[np.floating]
# About the least difference between two colours side by side that is seen.
NOTICED_DELTA_E_00 = 1.0


def eye_clip_costs(
    models: EyeModels, mixture: Mixture | None, left_XYZ: Pixels, right_XYZ: Pixels, *, half: bool = False
) -> Mapping[Eye, dict[str, float]]:
    """Return what the gamut clip costs each eye of a picture, under the keys of `ClipCost.to_json`.

    The views are XYZ in cd/m² as they are asked of the display, shape (height, width, 3), one array where the picture
    is flat. With ``mixture``, see `mixed_costs`.

    Parameters
    ----------
    models
        What each eye sees of the display.
    mixture
        How both views make one picture; None where each eye has its own.
    left_XYZ, right_XYZ
        Each eye's view, XYZ in cd/m², shape (height, width, 3).
    half
        Whether half floats held them, whose rounding is not counted as out of the gamut.

    Returns
    -------
    Mapping
        For each eye, percentages of pixels out of the gamut, and the mean and largest ΔE00 of the clip; more with a
        mixture.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_display
    >>> models = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("side-by-side")
    >>> picture = np.outer([0.5, 2.0], models.left.white_XYZ_cd_m2).reshape(1, 2, 3)
    >>> costs = eye_clip_costs(models, None, picture, 0.25 * picture)
    >>> costs["left"]["percent_any"], costs["right"]["percent_any"]
    (50.0, 0.0)
    """
    if mixture is not None:
        return mixed_costs(mixture, models, left_XYZ, right_XYZ, half=half)
    left = clip_cost(models.left, left_XYZ, half=half).to_json()
    same = left_XYZ is right_XYZ and models.left is models.right
    return {"left": left, "right": left if same else clip_cost(models.right, right_XYZ, half=half).to_json()}


def mixed_costs(
    mixture: Mixture, models: EyeModels, left_XYZ: Pixels, right_XYZ: Pixels, *, half: bool = False
) -> Mapping[Eye, dict[str, float]]:
    """Return, for each eye, the keys of `ClipCost.to_json` with the clip's cost through that eye's filter, and more.

    ``percent_noticed``: pixels that the clip changes by ΔE00 of 1 or more; ``projection_delta_e_00_mean`` and
    ``projection_delta_e_00_max``: what was asked of the eye against what it would see if nothing were clipped.
    """
    limits = mixture.limits
    views: dict[Eye, Pixels] = {"left": left_XYZ.reshape(-1, 3), "right": right_XYZ.reshape(-1, 3)}

    def work(part: slice) -> tuple[Clipped, Mapping[Eye, _CostSums]]:
        asked = {eye: views[eye][part].astype(np.float64) for eye in EYES}
        for view in asked.values():
            check_finite(view)
        light = mixture.light(asked["left"], asked["right"])
        clipped = np.clip(light, *limits)
        shown = np.stack([curve.linear(curve.code(clipped[:, i])) for i, curve in enumerate(mixture.curves)], axis=1)
        # A difference by rounding is none.
        changed = (np.abs(shown - light) > 1e-12).any(axis=1)
        costs: dict[Eye, _CostSums] = {}
        for eye in EYES:
            through = mixture.through(eye)
            white = _display(models, eye, np.ones(3)) @ through.T
            # A component that the filter stops wholly is the same in all that is seen: any white gives no difference.
            white = np.where(white > 0.0, white, models.eye(eye).white_XYZ_cd_m2)
            seen = _lab(_display(models, eye, light) @ through.T, white)
            clip = delta_e_2000(seen[changed], _lab(_display(models, eye, shown[changed]) @ through.T, white))
            projection = delta_e_2000(_lab(asked[eye], models.eye(eye).white_XYZ_cd_m2), seen)
            costs[eye] = _CostSums.of(clip, projection)
        tolerance = mixed_tolerance(mixture, models, asked["left"], asked["right"], half=half)
        return outside_limits(light, limits, tolerance), costs

    parts = list(over_blocks(work, len(views["left"])))
    sums = {eye: _CostSums() for eye in EYES}
    for _, costs in parts:
        for eye in EYES:
            sums[eye].add(costs[eye])
    counted = counted_together([outside for outside, _ in parts])
    return {eye: sums[eye].costs(counted) for eye in EYES}


def mixed_tolerance(
    mixture: Mixture, models: EyeModels, left_XYZ: Pixels, right_XYZ: Pixels, *, half: bool = False
) -> Floats:
    """Return how far the one picture's linear light, (..., 3), may leave its limits before it counts as outside.

    That is by how much it errs of views in single precision, or with ``half`` of views that half floats held.
    """
    stored = np.maximum(
        rounding_of(mixture.left, models.left.shown_white_XYZ_cd_m2, mixture.limits),
        rounding_of(mixture.right, models.right.shown_white_XYZ_cd_m2, mixture.limits),
    )
    held = rounding_of_half(mixture.left, left_XYZ) + rounding_of_half(mixture.right, right_XYZ) if half else 0.0
    return np.maximum(stored, held)


@dataclass(slots=True)
class _CostSums:
    """What the blocks of a picture came to so far."""

    noticed: int = 0
    clip: float = 0.0
    clip_max: float = 0.0
    projection: float = 0.0
    projection_max: float = 0.0

    @classmethod
    def of(cls, clip: Floats, projection: Floats) -> _CostSums:
        """Return those of one block, from its ΔE00."""
        return cls(
            int((clip >= NOTICED_DELTA_E_00).sum()),
            float(clip.sum()),
            float(clip.max(initial=0.0)),
            float(projection.sum()),
            float(projection.max(initial=0.0)),
        )

    def add(self, block: _CostSums) -> None:
        self.noticed += block.noticed
        self.clip += block.clip
        self.clip_max = max(self.clip_max, block.clip_max)
        self.projection += block.projection
        self.projection_max = max(self.projection_max, block.projection_max)

    def costs(self, counted: Clipped) -> dict[str, float]:
        pixels = max(counted.pixels, 1)
        return ClipCost(counted, self.clip / pixels, self.clip_max).to_json() | {
            "percent_noticed": round(100.0 * self.noticed / pixels, 4),
            "projection_delta_e_00_mean": round(self.projection / pixels, 5),
            "projection_delta_e_00_max": round(self.projection_max, 4),
        }


def _display(models: EyeModels, eye: Eye, light: Floats) -> Floats:
    """Return the XYZ of channels' linear ``light``, (..., 3), clipped or not, before the eye's filter."""
    model = models.eye(eye)
    return np.asarray(model.dark_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T)


def _lab(xyz_cd_m2: NDArray[np.floating], white: Floats) -> Floats:
    # Lab is defined for light only: what lies below no light at all is as black as black.
    return xyz_to_lab(np.maximum(xyz_cd_m2, 0.0), white)
