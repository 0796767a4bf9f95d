"""The way of a picture that is mixed of both views and seen through colour filters: `devices.compensation.mixture`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from devices.budget.encoding import Encoding
from devices.budget.path import Pair, PathStep, delta_e, half_floats
from devices.compensation.mixture import Mixture
from devices.display.model import EYES, Eye, EyeModels
from documents.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Mixed:
    """The path where both views are mixed into one picture.

    What an eye sees is compared relative to white through its filter, as if it had adapted to it. The room's light is
    part of the gamut clip, and no crosstalk is cancelled.

    Parameters
    ----------
    models
        What each eye sees of the display.
    mixture
        How both views make one picture.
    encoding
        How light becomes codes.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.compensation import channel_split
    >>> from devices.display import read_display
    >>> models = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("side-by-side")
    >>> filters = channel_split(models, (True, False, False), (1, 0, 0), (0, 1, 1))
    >>> path = Mixed(models, filters, Encoding(levels=255, entries=1024, dithered=False))
    >>> grey = np.outer([0.1, 0.2], models.left.white_XYZ_cd_m2)
    >>> sorted(path.differences({"left": grey, "right": grey}))[-2:]
    [<PathStep.HALF_FLOATS: 'half_floats'>, <PathStep.LOOK_UP_TABLE: 'look_up_table'>]
    """

    models: EyeModels
    mixture: Mixture
    encoding: Encoding

    def differences(self, asked: Pair, stored: Pair | None = None) -> Mapping[PathStep, Mapping[Eye, Floats]]:
        """As `devices.budget.path.BudgetPath.differences`."""
        light = self._light(asked)
        shown = np.clip(light, 0.0, 1.0)
        found = {PathStep.HALF_FLOATS: self._asked(asked, half_floats(asked))}
        if stored is not None:
            found[PathStep.RESAMPLING] = self._asked(asked, stored)
        found[PathStep.FILTERS] = self._through(asked, light)
        found[PathStep.GAMUT_CLIP] = self._seen(light, shown)
        found[PathStep.LOOK_UP_TABLE] = self._seen(shown, self._encoded(shown, look_up=True, codes=False))
        found[PathStep.CODES] = self._seen(shown, self._encoded(shown, look_up=False, codes=True))
        kept = np.clip(self._light(half_floats(stored or asked)), 0.0, 1.0)
        found[PathStep.TOGETHER] = self._through(asked, self._encoded(kept, look_up=True, codes=True))
        return found

    def _light(self, asked: Pair) -> Floats:
        return self.mixture.normalised.light(asked["left"], asked["right"])

    def _encoded(self, light: Floats, *, look_up: bool, codes: bool) -> Floats:
        channels = zip(self.mixture.normalised.curves, light.T, strict=True)
        return np.stack([self.encoding.light(c, channel, look_up=look_up, codes=codes) for c, channel in channels], 1)

    def _display(self, eye: Eye, light: Floats) -> Floats:
        """Return what the eye gets of the channels' light in 0..1 through its filter."""
        lowest, highest = self.mixture.limits
        model = self.models.eye(eye)
        linear = lowest + (highest - lowest) * light
        return np.asarray((model.dark_XYZ_cd_m2 + linear @ model.primaries_XYZ_cd_m2.T) @ self.mixture.through(eye).T)

    def _white(self, eye: Eye) -> Floats:
        white = self.models.eye(eye).white_XYZ_cd_m2
        through = white @ self.mixture.through(eye).T
        # A component that the filter stops wholly is the same in all that is seen: any white gives no difference.
        return np.where(through > 0.0, through, white)

    def _asked(self, reference: Pair, seen: Pair) -> dict[Eye, Floats]:
        whites = {eye: self.models.eye(eye).white_XYZ_cd_m2 for eye in EYES}
        return {eye: delta_e(reference[eye], whites[eye], seen[eye], whites[eye]) for eye in EYES}

    def _seen(self, reference: Floats, light: Floats) -> dict[Eye, Floats]:
        whites = {eye: self._white(eye) for eye in EYES}
        return {
            eye: delta_e(self._display(eye, reference), whites[eye], self._display(eye, light), whites[eye])
            for eye in EYES
        }

    def _through(self, asked: Pair, light: Floats) -> dict[Eye, Floats]:
        return {
            eye: delta_e(asked[eye], self.models.eye(eye).white_XYZ_cd_m2, self._display(eye, light), self._white(eye))
            for eye in EYES
        }
