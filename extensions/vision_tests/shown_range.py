"""The range of greys that both eyes can be shown, from which the pictures of vision tests are mixed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from devices.display import EyeModels
from documents.arrays import Floats

# Room that is left below each channel's light at code 1, and what is let pass at either end: float32 pictures round.
_MARGIN, _ROUNDING = 1e-5, 5e-7
_GRID = 4096


@dataclass(frozen=True)
class ShownRange:
    """Greys that each eye's display model can make, from ``black_XYZ_cd_m2`` to ``white_XYZ_cd_m2``, shape (3,) each.

    White has the chromaticity of the left eye's white, and black is a grey between the left eye's black and white; both
    lie within the gamut of either eye.
    """

    models: EyeModels

    @cached_property
    def white_XYZ_cd_m2(self) -> Floats:
        """The brightest of the greys."""
        return self._between(self._reach()[1])

    @cached_property
    def black_XYZ_cd_m2(self) -> Floats:
        """The darkest of the greys."""
        return self._between(self._reach()[0])

    def grey(self, share: ArrayLike) -> Floats:
        """Return XYZ in cd/m², shape (..., 3), of greys that are ``share`` (...) of the way from black to white."""
        part = np.asarray(share, dtype=np.float64)[..., None]
        return np.asarray(self.black_XYZ_cd_m2 + part * (self.white_XYZ_cd_m2 - self.black_XYZ_cd_m2))

    def holds(self, xyz_cd_m2: ArrayLike) -> bool:
        """Return whether XYZ in cd/m², shape (..., 3), lies within the gamut of both eyes."""
        return all(
            bool(np.all((linear >= model.limits[0] - _ROUNDING) & (linear <= model.limits[1] + _ROUNDING)))
            for model, linear in ((model, model.linear(xyz_cd_m2)) for model in (self.models.left, self.models.right))
        )

    def _between(self, share: float) -> Floats:
        left = self.models.left
        return np.asarray(left.dark_XYZ_cd_m2 + share * (left.white_XYZ_cd_m2 - left.dark_XYZ_cd_m2))

    def _reach(self) -> tuple[float, float]:
        """Return from which share of the left eye's range to which both eyes have it."""
        lowest, highest = 0.0, 1.0
        models = (self.models.left, self.models.right)
        if not all(model.additive for model in models):
            return self._longest_run()
        for model in models:
            start = model.linear(self._between(0.0))
            slope = model.linear(self._between(1.0)) - start
            lowest = max(lowest, float(np.max((model.limits[0] - start) / slope)))
            highest = min(highest, float(np.min((model.limits[1] - _MARGIN - start) / slope)))
        return lowest, highest

    def _longest_run(self) -> tuple[float, float]:
        """Do as `_reach` where channels do not add up: the longest run of a grid's greys that both eyes have."""
        shares = np.linspace(0.0, 1.0, _GRID + 1)
        left = self.models.left
        greys = left.dark_XYZ_cd_m2 + shares[:, None] * (left.white_XYZ_cd_m2 - left.dark_XYZ_cd_m2)
        inside = np.ones(len(shares), dtype=bool)
        for model in (left, self.models.right):
            light, (lowest, highest) = model.linear(greys), model.limits
            inside &= np.all((light >= lowest - _ROUNDING) & (light <= highest - _MARGIN), axis=1)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
        starts, ends = edges[::2], edges[1::2]
        if not len(starts):
            return 0.0, 0.0
        longest = int(np.argmax(ends - starts))
        return float(shares[starts[longest]]), float(shares[ends[longest] - 1])
