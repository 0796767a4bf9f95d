"""A display as a colour device: device codes to XYZ and back.

XYZ = ambient + black + M · curve(code): an additive display with a black term (Fairchild & Wyble 1998; Day, Taplin &
Berns 2004; thesis Expressions 3.10 to 3.14) and the room's light that the screen reflects (Expression 3.1). The room's
light reaches both eyes by itself: it does not leak from one to the other, and no gain map dims it.

A curve need not run from 0 at code 0 to 1 at code 1: one with an offset gives light at code 0, and a fitted one may end
at 0.983. What the display can show is what lies between the two (`DisplayModel.limits`), and everything that asks
whether a colour can be shown asks that: "maximum code" in thesis Table 4.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from devices.display.curves import Curve
from devices.errors import DeviceError
from devices.eyes import EYES as EYES
from devices.eyes import Eye as Eye
from documents import Finding
from documents.arrays import Floats

# Linear light may leave its limits by this part of what is between them before it counts as out of gamut, or by more
# where rounding does.
GAMUT_TOLERANCE = 1e-6
# Pictures are stored in float32. Half a unit in the last place of each of X, Y and Z, and as much for their sums.
_ROUNDING = 2.0**-23
# Of a value held in half floats: half a unit in its last place, and half of their least step.
_HALF, _LEAST_HALF = 2.0**-11, 2.0**-25
# Ends of a curve that are 0 and 1 but for rounding.
_EXACT = 1e-12


@dataclass(frozen=True, eq=False)
class DisplayModel:
    """Black, primaries and one tone curve per channel, for one stereo mode and eye.

    ``black_XYZ_cd_m2``: shape (3,); ``primaries_XYZ_cd_m2``: shape (3, 3), its columns the red, green and
    blue channel at full drive minus black; ``ambient_XYZ_cd_m2``: shape (3,), what the eye gets of the room's light
    from the screen while it is off, through the glasses, none if not given. Raises DeviceError if the primaries cannot
    be inverted, a number is not finite, or the room's light is below 0.
    """

    black_XYZ_cd_m2: Floats
    primaries_XYZ_cd_m2: Floats
    curves: tuple[Curve, Curve, Curve]
    ambient_XYZ_cd_m2: Floats = field(default_factory=lambda: np.zeros(3), kw_only=True)

    def __post_init__(self) -> None:
        black = np.asarray(self.black_XYZ_cd_m2, dtype=np.float64)
        primaries = np.asarray(self.primaries_XYZ_cd_m2, dtype=np.float64)
        if black.shape != (3,) or primaries.shape != (3, 3):
            raise DeviceError(f"black is {black.shape} and primaries {primaries.shape}; expected (3,) and (3, 3)")
        if not (np.all(np.isfinite(black)) and np.all(np.isfinite(primaries))):
            raise DeviceError("black and primaries must be finite")
        if np.linalg.cond(primaries) > 1e6:
            raise DeviceError("the primaries are so nearly alike that they do not determine a colour")
        ambient = np.array(self.ambient_XYZ_cd_m2, dtype=np.float64)
        if ambient.shape != (3,) or not np.all(np.isfinite(ambient)) or np.any(ambient < 0.0):
            raise DeviceError(f"the room's light is {ambient.tolist()}; it must be three finite numbers of at least 0")
        for array in (black, primaries, ambient):
            array.flags.writeable = False
        object.__setattr__(self, "black_XYZ_cd_m2", black)
        object.__setattr__(self, "primaries_XYZ_cd_m2", primaries)
        object.__setattr__(self, "ambient_XYZ_cd_m2", ambient)

    def in_room(self, ambient_XYZ_cd_m2: ArrayLike) -> DisplayModel:
        """Return the same display in a room of which the eye gets so much light, (3,), from the screen while it is off.

        Raises
        ------
        DeviceError
            If it is not three finite numbers of at least 0.
        """
        return replace(self, ambient_XYZ_cd_m2=np.asarray(ambient_XYZ_cd_m2, dtype=np.float64))

    @property
    def in_the_dark(self) -> DisplayModel:
        """The same display without the room's light; the model itself where it has none."""
        return self.in_room(np.zeros(3)) if self.ambient_XYZ_cd_m2.any() else self

    @cached_property
    def dark_XYZ_cd_m2(self) -> Floats:
        """XYZ (3,) at linear light 0 in every channel: the room's light and the display's own black."""
        return np.asarray(self.ambient_XYZ_cd_m2 + self.black_XYZ_cd_m2)

    @cached_property
    def linear_from_XYZ(self) -> Floats:
        """The inverse primary matrix (3, 3), in 1/(cd/m²)."""
        return np.asarray(np.linalg.inv(self.primaries_XYZ_cd_m2), dtype=np.float64)

    @cached_property
    def white_XYZ_cd_m2(self) -> Floats:
        """XYZ (3,) at linear light 1 in every channel: the model's unit of white, which codes may not reach, or pass.

        `shown_white_XYZ_cd_m2` is the white that is shown.
        """
        return np.asarray(self.dark_XYZ_cd_m2 + self.primaries_XYZ_cd_m2.sum(axis=1))

    @cached_property
    def limits(self) -> tuple[Floats, Floats]:
        """The least and the most linear light that each channel can give, (3,) each: at code 0 and at code 1."""
        return curve_limits(self.curves)

    @cached_property
    def gamut_tolerance(self) -> Floats:
        """How far linear light, (3,), may leave `limits` before it counts: what a picture in float32 may err by.

        A colour asked for as exactly the light of code 0 or 1 then counts as inside, however it was computed.
        """
        return rounding_of(self.linear_from_XYZ, self.shown_white_XYZ_cd_m2, self.limits)

    def tolerance(self, xyz_cd_m2: ArrayLike, *, half: bool = False) -> Floats:
        """Return how far the linear light of XYZ in cd/m², (..., 3), may leave `limits`, held in half floats or not."""
        return np.maximum(self.gamut_tolerance, rounding_of_half(self.linear_from_XYZ, xyz_cd_m2) if half else 0.0)

    @cached_property
    def shown_white_XYZ_cd_m2(self) -> Floats:
        """XYZ (3,) at code 1 in every channel, the room's light included: the brightest white that is shown."""
        return self.xyz_of_linear(self.limits[1])

    @cached_property
    def shown_black_XYZ_cd_m2(self) -> Floats:
        """XYZ (3,) at code 0 in every channel, the room's light included: the darkest black that is shown."""
        return self.xyz_of_linear(self.limits[0])

    def contrast(self, *, in_the_room: bool = True) -> float:
        """Return white's luminance over black's, as shown, with the room's light or without; infinity for no black."""
        ambient = 0.0 if in_the_room else float(self.ambient_XYZ_cd_m2[1])
        white, black = (float(light[1]) - ambient for light in (self.shown_white_XYZ_cd_m2, self.shown_black_XYZ_cd_m2))
        return white / black if black > 0.0 else np.inf

    @cached_property
    def normalised(self) -> DisplayModel:
        """The same display in other units: its black is the light of code 0, its primaries what code 1 adds to it.

        Its curves run from 0 to 1, so that what can be shown is linear light in 0..1; colour passes need no other
        limits. It is the model itself where that is so already.
        """
        curves = normalised_curves(self.curves)
        if curves is self.curves:
            return self
        lowest, highest = self.limits
        return DisplayModel(
            self.shown_black_XYZ_cd_m2 - self.ambient_XYZ_cd_m2,
            self.primaries_XYZ_cd_m2 * (highest - lowest),
            curves,
            ambient_XYZ_cd_m2=self.ambient_XYZ_cd_m2,
        )

    def xyz(self, code: ArrayLike) -> Floats:
        """Return XYZ in cd/m², shape (..., 3), for device codes in 0..1, shape (..., 3)."""
        codes = np.asarray(code, dtype=np.float64)
        linear = np.stack([curve.linear(codes[..., i]) for i, curve in enumerate(self.curves)], axis=-1)
        return self.xyz_of_linear(linear)

    def xyz_of_linear(self, linear: ArrayLike) -> Floats:
        """Return XYZ in cd/m² of the channels' linear light, shape (..., 3) each."""
        return np.asarray(self.dark_XYZ_cd_m2 + self.light_of(linear) @ self.primaries_XYZ_cd_m2.T)

    def linear(self, xyz_cd_m2: ArrayLike) -> Floats:
        """Return each channel's linear light, unclipped, shape (..., 3), for XYZ in cd/m², shape (..., 3)."""
        return self.channels(self.in_primaries(xyz_cd_m2))

    def in_primaries(self, xyz_cd_m2: ArrayLike) -> Floats:
        """Return XYZ in cd/m², shape (..., 3), above black and the room's light, in units of the primaries."""
        light = np.asarray(xyz_cd_m2, dtype=np.float64) - self.dark_XYZ_cd_m2
        return np.asarray(light @ self.linear_from_XYZ.T)

    @property
    def additive(self) -> bool:
        """Whether channels add up, each along its primary, so that `channels` and `light_of` change nothing."""
        return True

    @property
    def steps(self) -> int:
        """How many of Newton's steps undo it: one, where channels add up."""
        return 1

    @property
    def numbers(self) -> list[Any]:
        """What decides its colours but for the room's light, as plain JSON: for digests."""
        curves = [curve.decides for curve in self.curves]
        return [self.black_XYZ_cd_m2.tolist(), self.primaries_XYZ_cd_m2.tolist(), curves]

    def channels(self, light: ArrayLike) -> Floats:
        """Return the channels' linear light, unclipped, for light in units of the primaries, shape (..., 3) each."""
        return np.asarray(light, dtype=np.float64)

    def light_of(self, linear: ArrayLike) -> Floats:
        """Return the light, in units of the primaries, of the channels' linear light: undoes `channels`."""
        return np.asarray(linear, dtype=np.float64)

    def code(self, xyz_cd_m2: ArrayLike) -> Floats:
        """Return device codes in 0..1, shape (..., 3), for XYZ in cd/m², shape (..., 3), clipping to the gamut."""
        linear = np.clip(self.linear(xyz_cd_m2), *self.limits)
        return np.stack([curve.code(linear[..., i]) for i, curve in enumerate(self.curves)], axis=-1)

    def clipping(self, xyz_cd_m2: ArrayLike, *, half: bool = False) -> Clipped:
        """Count the pixels of XYZ in cd/m², shape (..., 3), outside the gamut: below code 0 or above code 1.

        ``half`` says that they were held in half floats, coarser near black than single precision.
        """
        xyz = np.asarray(xyz_cd_m2).reshape(-1, 3)
        return outside_limits(self.linear(xyz), self.limits, self.tolerance(xyz, half=half))


@dataclass(frozen=True, slots=True)
class EyeModels:
    """What each eye sees of the display in one stereo mode; the same object where one model serves both."""

    left: DisplayModel
    right: DisplayModel

    def eye(self, eye: Eye) -> DisplayModel:
        """Return the model for ``eye``."""
        return self.left if eye == "left" else self.right

    def in_room(self, left_XYZ_cd_m2: ArrayLike, right_XYZ_cd_m2: ArrayLike) -> EyeModels:
        """Return the same display in a room of which each eye gets so much light, (3,), from the screen while off.

        Raises
        ------
        DeviceError
            If it is not three finite numbers of at least 0.
        """
        left = self.left.in_room(left_XYZ_cd_m2)
        same = self.left is self.right and np.array_equal(left_XYZ_cd_m2, right_XYZ_cd_m2)
        return EyeModels(left, left if same else self.right.in_room(right_XYZ_cd_m2))

    @property
    def normalised(self) -> EyeModels:
        """The same in units of what codes 0 and 1 give, see `DisplayModel.normalised`."""
        return EyeModels(self.left.normalised, self.right.normalised)


def curve_limits(curves: Sequence[Curve]) -> tuple[Floats, Floats]:
    """Return the linear light at code 0 and at code 1 of ``curves``, (n,) each."""
    lowest, highest = (np.array([float(curve.linear(code)) for curve in curves]) for code in (0.0, 1.0))
    return lowest, highest


def normalised_curves(curves: tuple[Curve, Curve, Curve]) -> tuple[Curve, Curve, Curve]:
    """Return ``curves`` scaled to run from 0 at code 0 to 1 at code 1; the very same where they do."""
    lowest, highest = curve_limits(curves)
    if np.all(np.abs(lowest) <= _EXACT) and np.all(np.abs(highest - 1.0) <= _EXACT):
        return curves
    red, green, blue = (curve.normalised() for curve in curves)
    return red, green, blue


def rounding_of(linear_from_XYZ: Floats, white_XYZ_cd_m2: Floats, limits: tuple[Floats, Floats]) -> Floats:
    """Return by how much linear light, (3,), may err of XYZ up to ``white_XYZ_cd_m2`` stored in float32.

    At least `GAMUT_TOLERANCE` of what is between ``limits``, so that it is the same light in whatever unit.
    """
    stored = _ROUNDING * (np.abs(linear_from_XYZ) @ np.abs(white_XYZ_cd_m2))
    return np.maximum(GAMUT_TOLERANCE * (limits[1] - limits[0]), stored)


def rounding_of_half(linear_from_XYZ: Floats, xyz_cd_m2: ArrayLike) -> Floats:
    """Return by how much linear light, (..., 3), may err of XYZ in cd/m², (..., 3), that half floats held."""
    err = np.abs(np.asarray(xyz_cd_m2, dtype=np.float64)) * _HALF + _LEAST_HALF
    return np.asarray(err @ np.abs(linear_from_XYZ).T)


def outside_limits(linear: ArrayLike, limits: tuple[Floats, Floats], tolerance: Floats | float) -> Clipped:
    """Count the pixels of linear light, shape (..., 3), that leave ``limits`` by more than ``tolerance``.

    What is no number is light that no code gives, and counts as outside.
    """
    channels = np.asarray(linear, dtype=np.float64).reshape(-1, 3)
    above = channels > limits[1] + tolerance
    outside = ~((channels >= limits[0] - tolerance) & (channels <= limits[1] + tolerance))
    red, green, blue = (int(count) for count in outside.sum(axis=0))
    return Clipped(
        pixels=len(channels),
        red=red,
        green=green,
        blue=blue,
        any_channel=int(outside.any(axis=1).sum()),
        above_full=int(above.any(axis=1).sum()),
    )


@dataclass(frozen=True, slots=True)
class Clipped:
    """How many of a picture's ``pixels`` ask a channel for less light than at code 0, or for more than at code 1."""

    pixels: int
    red: int
    green: int
    blue: int
    any_channel: int
    above_full: int

    def percent(self, count: int) -> float:
        """Return ``count`` as a percentage of all pixels."""
        return 100.0 * count / self.pixels if self.pixels else 0.0


def refuse_lift(models: EyeModels) -> None:
    """Raise DeviceError where a share of white is not the same share of each channel's light."""
    if not (models.left.additive and models.right.additive):
        raise DeviceError(
            Finding(
                "the black level cannot be lifted on a display whose channels act on each other (curve of kind 'plvc')",
                remedy="leave out lift_black, or fit the display again with --model table",
            )
        )
