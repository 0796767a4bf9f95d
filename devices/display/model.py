"""A display as a colour device: device codes to XYZ and back.

XYZ = black + M · curve(code): an additive display with a black term (Fairchild & Wyble 1998; Day, Taplin &
Berns 2004; thesis Expressions 3.10 to 3.14).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.display.tone_curve import Curve
from devices.errors import DeviceError

Floats = NDArray[np.float64]

# Linear light may leave 0..1 by this much before it counts as out of gamut: float32 arithmetic alone does.
GAMUT_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class DisplayModel:
    """Black, primaries and one tone curve per channel, for one stereo mode and eye.

    ``black_XYZ_cd_m2``: shape (3,); ``primaries_XYZ_cd_m2``: shape (3, 3), its columns the red, green and
    blue channel at full drive minus black. Raises DeviceError if the primaries cannot be inverted.
    """

    black_XYZ_cd_m2: Floats
    primaries_XYZ_cd_m2: Floats
    curves: tuple[Curve, Curve, Curve]

    def __post_init__(self) -> None:
        black = np.asarray(self.black_XYZ_cd_m2, dtype=np.float64)
        primaries = np.asarray(self.primaries_XYZ_cd_m2, dtype=np.float64)
        if black.shape != (3,) or primaries.shape != (3, 3):
            raise DeviceError(f"black is {black.shape} and primaries {primaries.shape}; expected (3,) and (3, 3)")
        if not (np.all(np.isfinite(black)) and np.all(np.isfinite(primaries))):
            raise DeviceError("black and primaries must be finite")
        if np.linalg.cond(primaries) > 1e6:
            raise DeviceError("the primaries are so nearly alike that they do not determine a colour")
        for array in (black, primaries):
            array.flags.writeable = False
        object.__setattr__(self, "black_XYZ_cd_m2", black)
        object.__setattr__(self, "primaries_XYZ_cd_m2", primaries)

    @cached_property
    def linear_from_XYZ(self) -> Floats:
        """The inverse primary matrix (3, 3), in 1/(cd/m²)."""
        return np.asarray(np.linalg.inv(self.primaries_XYZ_cd_m2), dtype=np.float64)

    @cached_property
    def white_XYZ_cd_m2(self) -> Floats:
        """XYZ (3,) at linear light 1 in every channel."""
        return np.asarray(self.black_XYZ_cd_m2 + self.primaries_XYZ_cd_m2.sum(axis=1))

    def xyz(self, code: ArrayLike) -> Floats:
        """Return XYZ in cd/m², shape (..., 3), for device codes in 0..1, shape (..., 3)."""
        codes = np.asarray(code, dtype=np.float64)
        linear = np.stack([curve.linear(codes[..., i]) for i, curve in enumerate(self.curves)], axis=-1)
        return self.xyz_of_linear(linear)

    def xyz_of_linear(self, linear: ArrayLike) -> Floats:
        """Return XYZ in cd/m² of the channels' linear light, shape (..., 3) each."""
        return np.asarray(self.black_XYZ_cd_m2 + self.light_of(linear) @ self.primaries_XYZ_cd_m2.T)

    def linear(self, xyz_cd_m2: ArrayLike) -> Floats:
        """Return each channel's linear light, unclipped, shape (..., 3), for XYZ in cd/m², shape (..., 3)."""
        return self.channels(self.in_primaries(xyz_cd_m2))

    def in_primaries(self, xyz_cd_m2: ArrayLike) -> Floats:
        """Return XYZ in cd/m², shape (..., 3), above black, in units of the primaries: light that adds up."""
        light = np.asarray(xyz_cd_m2, dtype=np.float64) - self.black_XYZ_cd_m2
        return np.asarray(light @ self.linear_from_XYZ.T)

    @property
    def additive(self) -> bool:
        """Whether channels add up, each along its primary, so that `channels` and `light_of` change nothing."""
        return True

    def channels(self, light: ArrayLike) -> Floats:
        """Return the channels' linear light, unclipped, for light in units of the primaries, shape (..., 3) each."""
        return np.asarray(light, dtype=np.float64)

    def light_of(self, linear: ArrayLike) -> Floats:
        """Return the light, in units of the primaries, of the channels' linear light: undoes `channels`."""
        return np.asarray(linear, dtype=np.float64)

    def code(self, xyz_cd_m2: ArrayLike) -> Floats:
        """Return device codes in 0..1, shape (..., 3), for XYZ in cd/m², shape (..., 3), clipping to the gamut."""
        linear = np.clip(self.linear(xyz_cd_m2), 0.0, 1.0)
        return np.stack([curve.code(linear[..., i]) for i, curve in enumerate(self.curves)], axis=-1)

    def clipping(self, xyz_cd_m2: ArrayLike) -> Clipping:
        """Count the pixels of XYZ in cd/m², shape (..., 3), that lie outside the gamut."""
        linear = self.linear(xyz_cd_m2).reshape(-1, 3)
        below = linear < -GAMUT_TOLERANCE
        above = linear > 1.0 + GAMUT_TOLERANCE
        outside = below | above
        red, green, blue = (int(count) for count in outside.sum(axis=0))
        return Clipping(
            pixels=len(linear),
            red=red,
            green=green,
            blue=blue,
            any_channel=int(outside.any(axis=1).sum()),
            above_full=int(above.any(axis=1).sum()),
        )


@dataclass(frozen=True, slots=True)
class Clipping:
    """How many of a picture's ``pixels`` ask a channel for light it has not got (below 0 or above full)."""

    pixels: int
    red: int
    green: int
    blue: int
    any_channel: int
    above_full: int

    def percent(self, count: int) -> float:
        """Return ``count`` as a percentage of all pixels."""
        return 100.0 * count / self.pixels if self.pixels else 0.0
