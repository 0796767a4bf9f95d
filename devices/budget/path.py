"""A picture's way from XYZ in a file to what each eye sees, in float64, each step of which can be switched on alone.

It is the reference of the colour passes with a switch at each step: with none on, an eye sees what was asked.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, TypeAlias

import numpy as np

from devices.budget.encoding import Encoding
from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.compensation.compensate import Correction
from devices.compensation.crosstalk_cancel import cancel_crosstalk
from devices.display.model import EYES, DisplayModel, Eye, EyeModels
from documents.arrays import Floats

Pair: TypeAlias = Mapping[Eye, Floats]
"""Each eye's colours, XYZ in cd/m², shape (n, 3)."""


_NOTHING = Correction()


class PathStep(StrEnum):
    """A step on the way, by its name in JSON; `CHARACTERISATION` is not computed but stated by the display file."""

    HALF_FLOATS = "half_floats"
    RESAMPLING = "resampling"
    GAMUT_CLIP = "gamut_clip"
    AMBIENT_LIGHT = "ambient_light"
    FILTERS = "filters"
    CROSSTALK = "crosstalk_left"
    GAIN_MAP = "gain_map"
    LOOK_UP_TABLE = "look_up_table"
    CODES = "codes"
    CHARACTERISATION = "characterisation"
    TOGETHER = "all_together"


class BudgetPath(Protocol):
    """A way from asked colours to what the eyes see."""

    def differences(self, asked: Pair, stored: Pair | None = None) -> Mapping[PathStep, Mapping[Eye, Floats]]:
        """Return the ΔE00 (n,) of each step alone, and of all together, for each eye.

        Each step alone is applied to colours that the display can show, and compared with them; the clip to those
        colours is a step too. ``stored`` is what was resampled of ``asked``, None if nothing was.
        """


def half_floats(asked: Pair) -> Pair:
    """Return colours as half floats keep them."""
    return {eye: asked[eye].astype(np.float16).astype(np.float64) for eye in EYES}


def delta_e(reference: Floats, reference_white: Floats, seen: Floats, white: Floats) -> Floats:
    """Return the ΔE00 (n,) of XYZ (n, 3), each relative to its white; below no light all is black."""
    return delta_e_2000(
        xyz_to_lab(np.maximum(reference, 0.0), reference_white), xyz_to_lab(np.maximum(seen, 0.0), white)
    )


def joined_differences(parts: Sequence[Mapping[PathStep, Mapping[Eye, Floats]]]) -> dict[PathStep, dict[Eye, Floats]]:
    """Return the differences of several pictures as those of one.

    Parameters
    ----------
    parts
        What `BudgetPath.differences` gave for each; all have the same steps.

    Returns
    -------
    dict
        The ΔE00 of all colours, by step and eye.

    Examples
    --------
    >>> part = {PathStep.CODES: {"left": np.array([0.1]), "right": np.array([0.3])}}
    >>> joined_differences([part, part])[PathStep.CODES]["right"].tolist()
    [0.3, 0.3]
    """
    return {step: {eye: np.concatenate([part[step][eye] for part in parts]) for eye in EYES} for step in parts[0]}


@dataclass(frozen=True, slots=True, eq=False)
class OwnPixels:
    """The path where each eye has pixels of its own.

    Parameters
    ----------
    models
        What each eye sees of the display.
    encoding
        How light becomes codes.
    correction
        Crosstalk, black lift and gain map, where they were measured.
    gains
        The panel's gain where each colour is shown, shape (n,), relative to its centre; with a gain map only.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_display
    >>> models = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("side-by-side")
    >>> path = OwnPixels(models, Encoding(levels=255, entries=1024, dithered=False))
    >>> grey = np.outer([0.1, 0.2], models.left.white_XYZ_cd_m2)
    >>> bool(path.differences({"left": grey, "right": grey})[PathStep.CODES]["left"].max() < 1.0)
    True
    """

    models: EyeModels
    encoding: Encoding
    correction: Correction = _NOTHING
    gains: Floats | None = None

    def differences(self, asked: Pair, stored: Pair | None = None) -> Mapping[PathStep, Mapping[Eye, Floats]]:
        """As `BudgetPath.differences`; without a step where it was not measured what the step undoes."""
        in_the_dark = self.seen(asked, {PathStep.GAMUT_CLIP})
        shown = self.seen(asked, {PathStep.GAMUT_CLIP, PathStep.AMBIENT_LIGHT})
        found = {PathStep.HALF_FLOATS: self._compared(asked, half_floats(asked))}
        if stored is not None:
            found[PathStep.RESAMPLING] = self._compared(asked, stored)
        found[PathStep.GAMUT_CLIP] = self._compared(asked, in_the_dark)
        if any(self.models.eye(eye).ambient_XYZ_cd_m2.any() for eye in EYES):
            found[PathStep.AMBIENT_LIGHT] = self._compared(in_the_dark, shown)
        for step in self._alone():
            found[step] = self._compared(shown, self.seen(shown, {step}), {step})
        every = {PathStep.HALF_FLOATS, PathStep.GAMUT_CLIP, PathStep.AMBIENT_LIGHT, *self._alone()}
        found[PathStep.TOGETHER] = self._compared(asked, self.seen(stored or asked, every), every)
        return found

    def seen(self, asked: Pair, steps: Collection[PathStep]) -> Pair:
        """Return what each eye sees of ``asked`` with only ``steps`` on, exact in all others."""
        if PathStep.HALF_FLOATS in steps:
            asked = half_floats(asked)
        models = self.models.normalised
        linear = {eye: self._linear(models.eye(eye), asked[eye], steps) for eye in EYES}
        leaks = self.correction.crosstalk if PathStep.CROSSTALK in steps else None
        if leaks is not None:
            left, right = (models.eye(eye).xyz_of_linear(linear[eye]) for eye in EYES)
            done = cancel_crosstalk(models, leaks, left, right, self.correction.lift_share)
            linear = {"left": models.left.channels(done.left_linear), "right": models.right.channels(done.right_linear)}
        gains, gain_map = self.gains, self.correction.gain_map
        if gain_map is None or PathStep.GAIN_MAP not in steps:
            gains = None
        sent = {}
        for eye in EYES:
            model = models.eye(eye)
            light = linear[eye]
            if gain_map is not None and gains is not None:
                evened = gain_map.corrected(model.xyz_of_linear(light), gains, model.ambient_XYZ_cd_m2)
                light = np.clip(model.linear(evened), 0.0, 1.0)
            look_up, codes = PathStep.LOOK_UP_TABLE in steps, PathStep.CODES in steps
            if look_up or codes:
                light = np.clip(light, 0.0, 1.0)
                channels = zip(model.curves, light.T, strict=True)
                shown = [
                    self.encoding.light(curve, channel, look_up=look_up, codes=codes) for curve, channel in channels
                ]
                light = np.stack(shown, axis=1)
            sent[eye] = model.light_of(light) @ model.primaries_XYZ_cd_m2.T
        seen = dict(sent)
        if leaks is not None:
            seen["left"], seen["right"] = leaks.seen(sent["left"], sent["right"])
        for eye in EYES:
            model = models.eye(eye)
            panel = seen[eye] + model.black_XYZ_cd_m2
            seen[eye] = model.ambient_XYZ_cd_m2 + (panel if gains is None else panel * gains[:, np.newaxis])
        return seen

    def _alone(self) -> list[PathStep]:
        """Return the steps that are applied to colours that can be shown."""
        measured = {
            PathStep.CROSSTALK: self.correction.crosstalk is not None,
            PathStep.GAIN_MAP: self.correction.gain_map is not None and self.gains is not None,
        }
        return [*(step for step, there in measured.items() if there), PathStep.LOOK_UP_TABLE, PathStep.CODES]

    def _linear(self, model: DisplayModel, asked: Floats, steps: Collection[PathStep]) -> Floats:
        """Return the channels' light of ``asked``: in the gamut of the display in the dark, and in the room's light."""
        if PathStep.GAMUT_CLIP in steps:
            dark = model.in_the_dark
            asked = dark.xyz_of_linear(np.clip(dark.linear(asked), 0.0, 1.0))
        linear = model.linear(asked)
        return np.clip(linear, 0.0, 1.0) if PathStep.AMBIENT_LIGHT in steps else linear

    def _compared(self, reference: Pair, seen: Pair, steps: Collection[PathStep] = ()) -> dict[Eye, Floats]:
        """Return the ΔE00 of each eye; evened out by the dimmest place, all of a picture and its white are darker."""
        gain_map = self.correction.gain_map if PathStep.GAIN_MAP in steps else None
        share = 1.0 if gain_map is None else gain_map.delivered_share
        found = {}
        for eye in EYES:
            ambient, white = self.models.eye(eye).ambient_XYZ_cd_m2, self.models.eye(eye).white_XYZ_cd_m2
            asked, white = (ambient + share * (xyz - ambient) for xyz in (reference[eye], white))
            found[eye] = delta_e(asked, white, seen[eye], white)
        return found
