"""The tone curve of sRGB (IEC 61966-2-1): a straight start, then a power of 2.4 [IEC1999]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from devices.colour import srgb_decoded, srgb_encoded
from documents.arrays import Floats


@dataclass(frozen=True, slots=True)
class SrgbCurve:
    """One channel's curve as sRGB has it; the display's black is a term of its own."""

    @property
    def lift(self) -> float:
        """Light at code 0: none."""
        return 0.0

    def linear(self, code: ArrayLike) -> Floats:
        """Return linear light (share of full) for device codes in 0..1, of any shape."""
        return srgb_decoded(code)

    def code(self, linear: ArrayLike) -> Floats:
        """Return device codes in 0..1 for linear light of any shape; light beyond 0..1 is clipped."""
        return srgb_encoded(np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0))

    def unclipped_code(self, light_above_lift: ArrayLike) -> Floats:
        """Return device codes for light of any shape, at or above 0."""
        return srgb_encoded(light_above_lift)
