"""A display whose channels change chromaticity with their level and act on each other (PLVC with pair terms).

XYZ = black + Φ(codes) · C. The functions Φ are, for each channel, its tabulated light T and five polynomials of √T that
vanish at both ends, which let the chromaticity vary along the channel (Post & Calhoun 1989 join straight pieces;
polynomials have no kinks, at which an inversion could stick); and, for each pair of channels, the product of their
light and the share by which one's middle levels move while the other shines, and the product of all three, which carry
what channels take from each other.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.display import DisplayModel
from devices.table_curve import TableCurve

Floats = NDArray[np.float64]

# Bernstein's polynomials of this degree, without the first and the last.
_DEGREE = 6
_INNER = _DEGREE - 1
PAIRS = ((0, 1), (0, 2), (1, 2))
_CROSS = tuple((i, j) for i in range(3) for j in range(3) if i != j)
FUNCTIONS = 3 + 3 * _INNER + len(PAIRS) + 1 + len(_CROSS)
_MOST_STEPS = 60
# A channel at code 0 has no slope to go by, so that none starts there; what sticks in the dark starts again higher.
_FLOORS = (1e-3, 0.08, 0.2, 0.4)
_CLOSE = 1e-11


@dataclass(frozen=True, eq=False)
class Plvc:
    """``black_XYZ_cd_m2`` (3,), a table for each channel, and ``coefficients`` (FUNCTIONS, 3) in cd/m²."""

    black_XYZ_cd_m2: Floats
    curves: tuple[TableCurve, TableCurve, TableCurve]
    coefficients: Floats

    @cached_property
    def additive(self) -> DisplayModel:
        """The display model with the same curves and the primaries at full drive alone; where an inversion starts."""
        return DisplayModel(self.black_XYZ_cd_m2, self.coefficients[:3].T, self.curves)

    def xyz(self, code: ArrayLike) -> Floats:
        """Return XYZ in cd/m², shape (..., 3), for device codes, shape (..., 3); codes are clipped to 0..1."""
        codes = np.clip(np.asarray(code, dtype=np.float64), 0.0, 1.0)
        functions, _ = functions_of(self.curves, codes.reshape(-1, 3), slopes=False)
        return np.asarray(self.black_XYZ_cd_m2 + functions @ self.coefficients).reshape(codes.shape)

    def xyz_and_slopes(self, codes: Floats) -> tuple[Floats, Floats]:
        """Return XYZ (n, 3) for codes (n, 3) in 0..1, and dXYZ/dcode (n, 3, 3)."""
        functions, by_code = functions_of(self.curves, codes)
        XYZ = self.black_XYZ_cd_m2 + functions @ self.coefficients
        return XYZ, np.einsum("nfc,fx->nxc", by_code, self.coefficients)

    def code(self, xyz_cd_m2: ArrayLike) -> Floats:
        """Return device codes in 0..1, shape (..., 3), whose light is ``xyz_cd_m2`` or, outside the gamut, near it.

        Gauss and Newton's method from the additive model's answer, with steps halved until they help, in units of the
        primaries.
        """
        wanted = np.asarray(xyz_cd_m2, dtype=np.float64).reshape(-1, 3)
        white = float(self.additive.white_XYZ_cd_m2.max())
        wanted = np.clip(wanted, -10.0 * white, 10.0 * white)
        first = self.additive.code(wanted)
        codes, size = self._descend(wanted, np.clip(first, _FLOORS[0], 1.0))
        for floor in _FLOORS[1:]:
            stuck = np.flatnonzero(size > _CLOSE)
            if not len(stuck):
                break
            again, left = self._descend(wanted[stuck], np.clip(first[stuck], floor, 1.0))
            better = left < size[stuck]
            codes[stuck[better]], size[stuck[better]] = again[better], left[better]
        return codes.reshape(np.shape(xyz_cd_m2))

    def _descend(self, wanted: Floats, codes: Floats) -> tuple[Floats, Floats]:
        """Return codes (n, 3) from ``codes`` on, and how far their light is from ``wanted``, (n,), in primaries."""
        to_light = self.additive.linear_from_XYZ
        XYZ, slopes = self.xyz_and_slopes(codes)
        miss = (XYZ - wanted) @ to_light.T
        size = np.linalg.norm(miss, axis=1)
        for _ in range(_MOST_STEPS):
            by_code = np.einsum("lx,nxc->nlc", to_light, slopes)
            step = _step(by_code, miss, np.ones_like(codes))
            # A channel at an end of its codes that would leave them stays, and the others make the best of it.
            leaving = np.asarray(((codes <= 0.0) & (step > 0.0)) | ((codes >= 1.0) & (step < 0.0)))
            step = np.where(
                np.any(leaving, axis=1, keepdims=True), _step(by_code, miss, np.where(leaving, 0.0, 1.0)), step
            )
            share = np.ones(len(codes))
            moving = np.ones(len(codes), dtype=bool)
            new, new_miss, new_size, new_slopes = codes, miss, size, slopes
            for _ in range(12):
                trial = np.clip(codes - share[:, None] * step, 0.0, 1.0)
                XYZ, trial_slopes = self.xyz_and_slopes(trial)
                trial_miss = (XYZ - wanted) @ to_light.T
                trial_size = np.linalg.norm(trial_miss, axis=1)
                better = moving & (trial_size < size)
                new = np.where(better[:, None], trial, new)
                new_miss = np.where(better[:, None], trial_miss, new_miss)
                new_size = np.where(better, trial_size, new_size)
                new_slopes = np.where(better[:, None, None], trial_slopes, new_slopes)
                moving &= ~better
                if not moving.any():
                    break
                share = np.where(moving, 0.5 * share, share)
            moved = float(np.max(np.abs(new - codes), initial=0.0))
            codes, miss, size, slopes = new, new_miss, new_size, new_slopes
            if moved < 1e-13:
                break
        return codes, size

    def clashes(self, steps: int = 9) -> int:
        """Return at how many codes of a grid, ``steps`` a channel, more drive of a channel gives less of its own light.

        0 means that the model can be undone: its light, in units of the primaries, rises with the codes.
        """
        axis = np.linspace(0.02, 1.0, steps)
        grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
        _, slopes = self.xyz_and_slopes(grid)
        by_code = np.einsum("lx,nxc->nlc", self.additive.linear_from_XYZ, slopes)
        minor = by_code[:, 0, 0] * by_code[:, 1, 1] - by_code[:, 0, 1] * by_code[:, 1, 0]
        falls = (by_code[:, (0, 1, 2), (0, 1, 2)] <= 0).any(axis=1) | (minor <= 0) | (np.linalg.det(by_code) <= 0)
        return int(falls.sum())


def _step(by_code: Floats, miss: Floats, free: Floats) -> Floats:
    """Gauss and Newton's step (n, 3) of the channels that are ``free`` (1, else 0)."""
    J = by_code * free[:, None, :]
    H = np.einsum("nlc,nld->ncd", J, J)
    H = H + np.eye(3) * (1.0 - free + 1e-18)[:, None, :]
    return np.asarray(np.linalg.solve(H, np.einsum("nlc,nl->nc", J, miss)[:, :, None])[:, :, 0])


def functions_of(
    curves: tuple[TableCurve, TableCurve, TableCurve], codes: Floats, *, slopes: bool = True
) -> tuple[Floats, Floats]:
    """Return Φ, shape (n, FUNCTIONS), at codes (n, 3) in 0..1, and dΦ/dcode, shape (n, FUNCTIONS, 3), or empty."""
    roots = [curve.root(codes[:, i]) for i, curve in enumerate(curves)]
    z, dz = np.stack([r for r, _ in roots], axis=1), np.stack([s for _, s in roots], axis=1)
    T, dT = z**2, 2.0 * z * dz
    n = len(codes)
    out = np.zeros((n, FUNCTIONS))
    by = np.zeros((n, FUNCTIONS, 3)) if slopes else np.zeros((0, FUNCTIONS, 3))
    out[:, :3] = T
    for c in range(3):
        if slopes:
            by[:, c, c] = dT[:, c]
        for k in range(1, _DEGREE):
            column = 2 + c * _INNER + k
            often, u = comb(_DEGREE, k), z[:, c]
            out[:, column] = often * u**k * (1.0 - u) ** (_DEGREE - k)
            if slopes:
                rise = often * u ** (k - 1) * (1.0 - u) ** (_DEGREE - k - 1) * (k - _DEGREE * u)
                by[:, column, c] = rise * dz[:, c]
    at = 3 + 3 * _INNER
    for i, j in PAIRS:
        out[:, at] = T[:, i] * T[:, j]
        if slopes:
            by[:, at, i], by[:, at, j] = dT[:, i] * T[:, j], T[:, i] * dT[:, j]
        at += 1
    out[:, at] = T.prod(axis=1)
    if slopes:
        for c in range(3):
            rest = T[:, (c + 1) % 3] * T[:, (c + 2) % 3]
            by[:, at, c] = dT[:, c] * rest
    at += 1
    for i, j in _CROSS:
        # A channel's middle levels while another shines: T(1 − T)·z of the other.
        out[:, at] = T[:, i] * (1.0 - T[:, i]) * z[:, j]
        if slopes:
            by[:, at, i] = (1.0 - 2.0 * T[:, i]) * dT[:, i] * z[:, j]
            by[:, at, j] = T[:, i] * (1.0 - T[:, i]) * dz[:, j]
        at += 1
    return out, by
