"""Curves of a profile, over 0..1: sampled (``curv``) and parametric (``para``); [ICC2022], 10.6 and 10.18."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from devices.display import ToneCurve
from devices.profiles.tag_table import Tag
from documents.arrays import Floats

# How many numbers the functions 0 to 4 have.
_COUNTS = (1, 3, 4, 5, 7)
# Of light, a step of 16 bits, half for either number's rounding.
ROUNDING = 1.0 / 65535.0 + 1e-9
# So near 0 does a clipped curve's power begin that its light is none: three roundings of s15Fixed16.
_BEGINS = 5e-5


@dataclass(frozen=True, slots=True, eq=False)
class SampledCurve:
    """Equally spaced ``values`` (n,), two or more, joined by straight lines."""

    values: Floats
    sampled: ClassVar = True
    lift: ClassVar = 0.0
    rounding: ClassVar = 0.75 * ROUNDING

    @property
    def codes(self) -> Floats:
        """Where the values stand, (n,), from 0 to 1."""
        return np.linspace(0.0, 1.0, len(self.values))

    def exact(self) -> ToneCurve | None:
        """Return the gamma that the values are within their rounding, None if they are of another shape."""
        codes, values = self.codes, self.values
        inside = (values > 0.02) & (values < 0.98)
        if abs(values[0]) > ROUNDING or abs(values[-1] - 1.0) > ROUNDING or inside.sum() < 3:
            return None
        x, y = np.log(codes[inside]), np.log(values[inside])
        gamma = float(x @ y / (x @ x))
        near = round(gamma, 3)
        for candidate in (near, gamma):
            if candidate > 0 and np.abs(codes**candidate - values).max() <= self.rounding:
                return ToneCurve(1.0, 0.0, candidate)
        return None

    def __call__(self, code: ArrayLike) -> Floats:
        """Return the value at ``code``, of any shape; beyond 0..1 that at the end."""
        x = np.asarray(code, dtype=np.float64)
        return np.asarray(np.interp(x, np.linspace(0.0, 1.0, len(self.values)), self.values))


@dataclass(frozen=True, slots=True)
class ParametricCurve:
    """y = (a·x + b)^g + e from x = d on, c·x + f below it: the functions 0 to 4 of ``para``, with all seven numbers."""

    g: float
    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 0.0
    e: float = 0.0
    f: float = 0.0
    sampled: ClassVar = False
    rounding: ClassVar = _BEGINS

    @property
    def lift(self) -> float:
        """What the curve of the GOGO family that it is has as its lift."""
        return self.e

    @property
    def codes(self) -> Floats:
        """Codes from 0 to 1, close enough to tell the curve from another."""
        return np.linspace(0.0, 1.0, 1025)

    def exact(self) -> ToneCurve | None:
        """Return the curve of the GOGO family, without its lift, that it is; None if it is none."""
        upper = self.d <= 0.0
        clipped = self.c == 0 and self.f == self.e and abs(self.a * self.d + self.b) < _BEGINS
        if not (upper or clipped) or self.a <= 0 or self.a + self.b <= 0 or self.e < 0:
            return None
        # Beyond full light the profile's curve is clipped, but for what rounding adds.
        if (self.a + self.b) ** self.g + self.e > 1.0 + 1e-4:
            return None
        return ToneCurve(self.a, self.b, self.g)

    def __call__(self, code: ArrayLike) -> Floats:
        """Return the value at ``code``, of any shape; both are clipped to 0..1, as [ICC2022] asks."""
        x = np.clip(np.asarray(code, dtype=np.float64), 0.0, 1.0)
        with np.errstate(over="ignore"):
            power = np.maximum(self.a * x + self.b, 0.0) ** self.g + self.e
        return np.asarray(np.clip(np.where(x >= self.d, power, self.c * x + self.f), 0.0, 1.0))


TagCurve = SampledCurve | ParametricCurve


def curve_at(tag: Tag, at: int = 0) -> tuple[TagCurve, int]:
    """Return the curve that begins at byte ``at`` of ``tag``, and how many bytes it takes.

    Raises
    ------
    DeviceError
        If it is of another type, cut off, or no function of the code.
    """
    kind = tag.part(at, 4)
    if kind == b"curv":
        count = tag.whole(at + 8, "I")
        if count == 0:
            return ParametricCurve(1.0), 12
        values = tag.u16(at + 12, count)
        if count == 1:
            gamma = float(values[0]) / 256.0
            if gamma <= 0:
                raise tag.error("has a gamma of 0", "a gamma above 0 is needed")
            return ParametricCurve(gamma), 14
        return SampledCurve(values.astype(np.float64) / 65535.0), 12 + 2 * count
    if kind == b"para":
        return _parametric(tag, at)
    raise tag.error(f"holds a curve of the type '{kind.decode('latin-1')}'", "'curv' or 'para' is needed")


def curves_at(tag: Tag, at: int, count: int) -> tuple[TagCurve, ...]:
    """Return ``count`` curves, one after the other from ``at``, each begun at a multiple of four bytes."""
    curves = []
    for _ in range(count):
        curve, size = curve_at(tag, at)
        curves.append(curve)
        at += (size + 3) // 4 * 4
    return tuple(curves)


def _parametric(tag: Tag, at: int) -> tuple[ParametricCurve, int]:
    kind = tag.whole(at + 8, "H")
    if kind >= len(_COUNTS):
        raise tag.error(f"holds the parametric function {kind}", "0 to 4 are known")
    count = _COUNTS[kind]
    g, *rest = tag.fixed(at + 12, count).tolist()
    size = 12 + 4 * count
    a, b = rest[:2] or (1.0, 0.0)
    if g <= 0 or (kind in (1, 2) and a == 0):
        raise tag.error(f"holds a function with gamma {g:g} and a {a:g}", "gamma above 0 and a other than 0 are needed")
    if kind == 0:
        return ParametricCurve(g), size
    if kind in (1, 2):
        floor = rest[2] if kind == 2 else 0.0
        return ParametricCurve(g, a, b, 0.0, -b / a, floor, floor), size
    return ParametricCurve(g, *rest), size
