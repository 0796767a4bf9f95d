"""Which sparkles both eyes see at one place, and which only one of them does."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stimuli.errors import StimulusError
from stimuli.sparkle.measures.background import Floats
from stimuli.sparkle.measures.measure import Estimate, SparkleMeasures


@dataclass(frozen=True, slots=True)
class SharedSparkles:
    """Of ``left`` and ``right`` sparkles, ``both`` lie within the tolerance of one another.

    ``by_chance`` is how many of random places would.
    """

    left: int
    right: int
    both: int
    by_chance: float
    tolerance_px: float

    @property
    def share(self) -> Estimate:
        """Share of all sparkles, of either eye, that both see; binomial standard error."""
        either = self.left + self.right - self.both
        if either == 0:
            return Estimate(math.nan, math.nan)
        share = self.both / either
        return Estimate(share, math.sqrt(share * (1 - share) / either))

    def to_json(self) -> dict[str, object]:
        """Return the numbers for a manifest."""
        return {
            "left": self.left,
            "right": self.right,
            "both": self.both,
            "by_chance": self.by_chance,
            "share": self.share.to_json(),
            "tolerance_px": self.tolerance_px,
        }


def shared_sparkles(
    left: SparkleMeasures, right: SparkleMeasures, *, tolerance_px: float = 1.0, parallax_px: float = 0.0
) -> SharedSparkles:
    """Pair each sparkle with the nearest of the other eye, if that one's nearest is it, within ``tolerance_px``.

    ``parallax_px`` is the right picture's horizontal position minus the left one's on the plane of the sparkles.

    Raises
    ------
    StimulusError
        If the pictures differ in size, or the tolerance is not above 0.
    """
    if left.pixels != right.pixels:
        raise StimulusError(f"the left picture has {left.pixels} pixels and the right one {right.pixels}")
    if not (math.isfinite(tolerance_px) and tolerance_px > 0 and math.isfinite(parallax_px)):
        raise StimulusError(f"tolerance_px is {tolerance_px} and parallax_px {parallax_px}; expected finite, above 0")
    one, other = _places(left, 0.0), _places(right, -parallax_px)
    both = 0
    if len(one) and len(other):
        from scipy.spatial import cKDTree

        near, there = cKDTree(other).query(one, distance_upper_bound=tolerance_px)
        _, back = cKDTree(one).query(other, distance_upper_bound=tolerance_px)
        met = np.flatnonzero(np.isfinite(near))
        both = int((np.asarray(back)[np.asarray(there)[met]] == met).sum())
    per_px = len(other) / right.pixels
    by_chance = len(one) * -math.expm1(-per_px * math.pi * tolerance_px**2)
    return SharedSparkles(len(one), len(other), both, by_chance, tolerance_px)


def _places(measures: SparkleMeasures, shift_px: float) -> Floats:
    found = measures.moments
    return np.stack([found.row_px, found.column_px + shift_px], axis=-1)
