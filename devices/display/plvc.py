"""A display whose channels change chromaticity with their level and act on each other (PLVC with pair terms).

XYZ = black + Σ T·H(√T) + what pairs of channels and all three make of each other, T being each channel's tabulated
light. H is XYZ per share of light, a polynomial of √T, so that the chromaticity varies along the channel ([Post1989]
joins straight pieces; polynomials have no kinks). A pair adds T·T′·(p + q·(1 − T) + q′·(1 − T′)): what a channel takes
from another, and how one's middle levels move while the other shines. What that leaves over may follow as smooth
kernels over all three; see `devices.display.residual`.

It is undone by Newton's method for T, in units of the primaries. Beyond its ends a channel continues along its primary,
so that every colour has an answer, below 0 or above 1 outside the gamut. There is but one where all principal minors
of the slopes are above 0 ([Gale1965]), which `Plvc.clashes` counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from devices.display.model import DisplayModel
from devices.display.residual import Residual, kernels_and_slopes
from devices.errors import DeviceError
from documents.arrays import Floats

# √light at which a channel's XYZ per share of light is given; at 1 it is the primary.
NODES = (0.0, 0.25, 0.5, 0.75)
PAIRS = ((0, 1), (0, 2), (1, 2))
# In the order of `mixtures_XYZ_cd_m2`: pairs, all three, then the middle levels of the first while the second shines.
CROSS = tuple((i, j) for i in range(3) for j in range(3) if i != j)
MIXTURES = len(PAIRS) + 1 + len(CROSS)
MOST_STEPS = 24
# The steps from the first to before the second are halved: what went round in circles until then finds its way.
HALVED = (8, 16)
# A step of this much, in shares of full light, is the last that Newton's method needs.
_CLOSE = 2e-14
# Less than this is what no light was rounded to, and a part of a code where a curve is flat.
_NO_LIGHT = 5.7e-14
# Colours undone at a time, which a processor's cache holds.
_BLOCK = 1 << 13
# Steps must end for colours of the gamut and this much beyond it, and are counted for colours this far from it.
_BEYOND, _FAR = 0.5, 1.5
_LIGHT_LIMIT = 1e6
# Of the primaries; beyond lie slips of the pen, and numbers that overflow.
_MOST_TIMES = 1e3


@dataclass(frozen=True, eq=False)
class Plvc(DisplayModel):
    """A display model whose primaries are the channels alone at full drive.

    ``XYZ_per_light_cd_m2``: shape (3, 4, 3), of each channel at √light 0, 1/4, 1/2 and 3/4. ``mixtures_XYZ_cd_m2``:
    shape (10, 3), red with green, red with blue, green with blue, all three, then middle levels: red while green
    shines, red while blue, green while red, green while blue, blue while red, blue while green. ``residual``: what
    all this leaves over, if any.

    Raises DeviceError as `DisplayModel`, or if these have other shapes, or hold a number that is not finite
    or beyond a thousand times the primaries.
    """

    XYZ_per_light_cd_m2: Floats
    mixtures_XYZ_cd_m2: Floats
    residual: Residual | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, shape in (("XYZ_per_light_cd_m2", (3, len(NODES), 3)), ("mixtures_XYZ_cd_m2", (MIXTURES, 3))):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.shape != shape or not np.all(np.isfinite(array)):
                raise DeviceError(f"{name} must be finite numbers of shape {shape}, not of {array.shape}")
            if np.abs(array).max() > _MOST_TIMES * np.abs(self.primaries_XYZ_cd_m2).max():
                raise DeviceError(f"{name} is beyond a thousand times the primaries, so that it cannot be undone")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if (
            self.residual is not None
            and np.abs(self.residual.XYZ_cd_m2).max() > _MOST_TIMES * np.abs(self.primaries_XYZ_cd_m2).max()
        ):
            raise DeviceError("the residual is beyond a thousand times the primaries, so that it cannot be undone")

    @property
    def additive(self) -> bool:
        """Whether channels add up, each along its primary: no."""
        return False

    @cached_property
    def white_XYZ_cd_m2(self) -> Floats:
        """XYZ (3,) at linear light 1 in every channel."""
        return self.xyz_of_linear(np.ones(3))

    @cached_property
    def powers(self) -> Floats:
        """Each channel's light per share, in units of the primaries: coefficients of √light⁰ to √light⁴, (3, 5, 3)."""
        at = np.vander(np.array([*NODES, 1.0]), increasing=True)
        own = np.concatenate([self.XYZ_per_light_cd_m2, self.primaries_XYZ_cd_m2.T[:, np.newaxis]], axis=1)
        return np.asarray(np.linalg.solve(at, own @ self.linear_from_XYZ.T))

    @cached_property
    def mixtures(self) -> Floats:
        """The ``mixtures_XYZ_cd_m2`` in units of the primaries, (10, 3)."""
        return np.asarray(self.mixtures_XYZ_cd_m2 @ self.linear_from_XYZ.T)

    @cached_property
    def residual_light(self) -> Floats:
        """The residual's ``XYZ_cd_m2`` in units of the primaries, (k, 3); no rows where there is none."""
        if self.residual is None:
            return np.zeros((0, 3))
        return np.asarray(self.residual.XYZ_cd_m2 @ self.linear_from_XYZ.T)

    @property
    def numbers(self) -> list[Any]:
        """What decides its colours but for the room's light, as plain JSON: for digests."""
        curves = [curve.model_dump(include={"codes", "light"}) for curve in self.curves]
        own = [self.XYZ_per_light_cd_m2.tolist(), self.mixtures_XYZ_cd_m2.tolist()]
        if left := self.residual:
            own += [left.width, left.knots.tolist(), left.XYZ_cd_m2.tolist()]
        return [self.black_XYZ_cd_m2.tolist(), self.primaries_XYZ_cd_m2.tolist(), curves, *own]

    def light_of(self, linear: ArrayLike) -> Floats:
        """Return the light, in units of the primaries, of the channels' own linear light, shape (..., 3) each."""
        asked = np.asarray(linear, dtype=np.float64)
        T = np.clip(asked, 0.0, 1.0)
        return np.asarray(self._light_and_slopes(T.reshape(-1, 3).T)[0].T.reshape(asked.shape) + (asked - T))

    def channels(self, light: ArrayLike) -> Floats:
        """Return the channels' linear light, unclipped, for light in units of the primaries, shape (..., 3) each."""
        wanted = np.clip(np.asarray(light, dtype=np.float64), -_LIGHT_LIMIT, _LIGHT_LIMIT)
        T = self.newton(wanted.reshape(-1, 3), MOST_STEPS)[0].reshape(wanted.shape)
        return np.where(np.abs(T) < _NO_LIGHT, 0.0, T)

    def newton(self, light: Floats, steps: int) -> tuple[Floats, Floats]:
        """Return the channels' light (n, 3) for ``light`` (n, 3) after ``steps`` at most, and the last step's size."""
        blocks = [self._newton(light[at : at + _BLOCK].T, steps) for at in range(0, len(light), _BLOCK)]
        if not blocks:
            return light.copy(), np.zeros(0)
        return np.concatenate([T for T, _ in blocks], axis=1).T, np.concatenate([size for _, size in blocks])

    def _newton(self, light: Floats, steps: int) -> tuple[Floats, Floats]:
        """Do as `newton`, each channel in a row."""
        T = light.copy()
        size = np.full(light.shape[1], np.inf)
        moving = np.arange(light.shape[1])
        for number in range(steps):
            now = T[:, moving]
            inside = np.clip(now, 0.0, 1.0)
            made, slopes = self._light_and_slopes(inside)
            for c in range(3):
                outside = now[c] != inside[c]
                for row in range(3):
                    slopes[row, c][outside] = row == c
            step = _solved(slopes, made + (now - inside) - light[:, moving])
            T[:, moving] = now - (0.5 if HALVED[0] <= number < HALVED[1] else 1.0) * step
            size[moving] = np.abs(step).max(axis=0)
            moving = moving[size[moving] > _CLOSE]
            if not len(moving):
                break
        return T, size

    def slopes(self, linear: Floats) -> Floats:
        """Return d light / d linear, both in units of the primaries, (n, 3, 3), at linear light (n, 3) in 0..1."""
        return np.moveaxis(self._light_and_slopes(linear.T)[1], 2, 0)

    def clashes(self, steps: int = 13) -> int:
        """Return at how many levels of a grid, ``steps`` a channel, the slopes have a principal minor of 0 or below.

        0 means that the model can be undone: more drive of a channel gives more of its own light, whatever the others
        do.
        """
        axis = np.linspace(0.0, 1.0, steps) ** 2
        grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
        J = self.slopes(grid)
        falls = np.diagonal(J, axis1=1, axis2=2).min(axis=1) <= 0.0
        for i, j in PAIRS:
            falls |= J[:, i, i] * J[:, j, j] - J[:, i, j] * J[:, j, i] <= 0.0
        return int((falls | (np.linalg.det(J) <= 0.0)).sum())

    @cached_property
    def steps(self) -> int:
        """How many of Newton's steps undo it, in the gamut and half of it beyond: one more than a grid needs.

        Raises
        ------
        DeviceError
            If `MOST_STEPS` do not, or it cannot be undone; see `clashes`.
        """
        if clashes := self.clashes():
            raise DeviceError(f"the model cannot be undone: at {clashes} of 2197 levels more drive gives less light")
        axis = np.linspace(0.0, 1.0, 14) ** 2
        grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
        around = np.linspace(-_FAR, 1.0 + _FAR, 13)
        outside = np.stack(np.meshgrid(around, around, around, indexing="ij"), axis=-1).reshape(-1, 3)
        near = np.concatenate([np.ones(len(grid), dtype=bool), np.abs(outside - 0.5).max(axis=1) <= 0.5 + _BEYOND])
        light = np.concatenate([self.light_of(grid), outside])
        known, size = self.newton(light, MOST_STEPS)
        ends = size <= 1e-12
        if not ends[near].all() or not np.allclose(known[: len(grid)], grid, rtol=0.0, atol=1e-9):
            raise DeviceError(f"the model cannot be undone: Newton's method does not end within {MOST_STEPS} steps")
        light, known = light[ends], known[ends]
        for steps in range(1, MOST_STEPS):
            # Of shares of light, relative in the dark, where codes follow the root of it.
            off = np.abs(self.newton(light, steps)[0] - known) / np.sqrt(np.abs(known) + 1e-14)
            if off.max() <= 1e-9:
                return steps + 1
        return MOST_STEPS

    def _light_and_slopes(self, T: Floats) -> tuple[Floats, Floats]:
        """Return light (3, n) in units of the primaries and its slopes (3, 3, n) for the channels' light (3, n)."""
        z = np.sqrt(T)
        light, slopes = np.zeros_like(T), np.empty((3, *T.shape))
        for c in range(3):
            powers = self.powers[c]
            for row in range(3):
                per_light: Floats | float = 0.0
                slope: Floats | float = 0.0
                for k in reversed(range(len(powers))):
                    per_light = per_light * z[c] + powers[k, row]
                    slope = slope * z[c] + (1.0 + 0.5 * k) * powers[k, row]
                light[row] += T[c] * per_light
                slopes[row, c] = slope
        by_name = dict(zip(CROSS, self.mixtures[4:], strict=True))
        for pair, (i, j) in enumerate(PAIRS):
            first, second = T[i], T[j]
            both = first * second
            for row in range(3):
                p, q, r = self.mixtures[pair, row], by_name[i, j][row], by_name[j, i][row]
                if not (p or q or r):
                    continue
                shared = p + q * (1.0 - first) + r * (1.0 - second)
                light[row] += both * shared
                slopes[row, i] += second * (shared - first * q)
                slopes[row, j] += first * (shared - second * r)
        for row in range(3):
            light[row] += T[0] * T[1] * T[2] * self.mixtures[3, row]
            for c in range(3):
                slopes[row, c] += T[(c + 1) % 3] * T[(c + 2) % 3] * self.mixtures[3, row]
        if self.residual is not None:
            made, by = kernels_and_slopes(T, self.residual.knots, self.residual.width)
            light += self.residual_light.T @ made
            for c in range(3):
                slopes[:, c] += self.residual_light.T @ by[c]
        return light, slopes


def _solved(A: Floats, b: Floats) -> Floats:
    """Return x of A · x = b for (3, 3, n) and (3, n), finite where A is singular too."""
    c = [A[(row + 1) % 3, 1] * A[(row + 2) % 3, 2] - A[(row + 2) % 3, 1] * A[(row + 1) % 3, 2] for row in range(3)]
    det = A[0, 0] * c[0] + A[1, 0] * c[1] + A[2, 0] * c[2]
    det = np.where(np.abs(det) < 1e-9, np.where(det < 0, -1e-9, 1e-9), det)
    x = (b[0] * c[0] + b[1] * c[1] + b[2] * c[2]) / det
    y, z = np.zeros_like(x), np.zeros_like(x)
    for row in range(3):
        following, last = (row + 1) % 3, (row + 2) % 3
        y += b[row] * (A[following, 2] * A[last, 0] - A[last, 2] * A[following, 0])
        z += b[row] * (A[following, 0] * A[last, 1] - A[last, 0] * A[following, 1])
    return np.stack([x, y / det, z / det])
