"""From light to the light of codes, in float64: looked up in the colour pass's tables or exactly, rounded, dithered.

The light of dithered codes is their mean over a period of the mask, computed: the share p of pixels that show the upper
code is a number of ranks of the mask over all of them. See `devices.compensation.dither`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devices.compensation.dither import adjacent_codes, code_lights
from devices.compensation.dither_mask import SIZE_PX
from devices.display.curves import Curve
from documents.arrays import Floats

_RANKS = SIZE_PX**2


@dataclass(frozen=True, slots=True)
class Encoding:
    """How light becomes codes 0..``levels``: by tables of ``entries``, dithered or rounded.

    Parameters
    ----------
    levels
        The highest code: 255 for 8 bits.
    entries
        Entries of the look-up table of each channel, see `devices.display.entries_for`.
    dithered
        Whether codes are dithered.

    Examples
    --------
    >>> from devices.display import ToneCurve
    >>> coarse = Encoding(levels=2, entries=1024, dithered=False)
    >>> coarse.light(ToneCurve(1.0, 0.0, 2.0), np.array([0.2, 0.3]), look_up=False, codes=True).tolist()
    [0.25, 0.25]
    """

    levels: int
    entries: int
    dithered: bool

    def light(self, curve: Curve, light: Floats, *, look_up: bool, codes: bool) -> Floats:
        """Return the light shown for ``light``, (n,) in 0..1, share of full of a curve that runs from 0 to 1.

        ``look_up`` takes the shader's tables in 32 bits instead of the exact curve, ``codes`` the codes that there are
        instead of any number.
        """
        if not (look_up or codes):
            return light
        return (
            self._dithered(curve, light, look_up, codes) if self.dithered else self._one(curve, light, look_up, codes)
        )

    def _one(self, curve: Curve, light: Floats, look_up: bool, codes: bool) -> Floats:
        code = curve.shader_codes(light, self.entries) if look_up else curve.code(light)
        return curve.linear(np.rint(code * self.levels) / self.levels if codes else code)

    def _dithered(self, curve: Curve, light: Floats, look_up: bool, codes: bool) -> Floats:
        lights = code_lights(curve, self.levels)
        known = np.maximum(lights - curve.lift, 0.0) / (1.0 - curve.lift)
        if look_up:
            known = known.astype(np.float32).astype(np.float64)
        lower, upper_share = adjacent_codes((light - curve.lift) / (1.0 - curve.lift), known)
        if codes:
            upper_share = np.clip(np.ceil(upper_share * _RANKS - 0.5), 0, _RANKS) / _RANKS
        return np.asarray(lights[lower] + upper_share * (lights[lower + 1] - lights[lower]))
