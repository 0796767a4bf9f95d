"""What a model leaves over, as a smooth function of all three channels' light: compactly supported kernels at knots.

R = Σ a · (φ(|u − c| / w) − φ(|c| / w)), φ(ρ) = (1 − ρ)⁴ (4ρ + 1) where ρ < 1 and 0 beyond [Wendland1995]: as smooth
as a cubic spline, positive definite in three dimensions, and nothing but + − × ÷ √, so that the colour pass follows it.
u = √(T + 1/64) − 1/8 of each channel's light T is like its root, which the eye sees evenly, but with a finite slope in
the dark. R is 0 at black.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devices.errors import DeviceError
from documents.arrays import Floats

# 32-bit floats hold both exactly.
EDGE, ROOT = 1.0 / 64.0, 1.0 / 8.0
MOST_KNOTS = 48


@dataclass(frozen=True, slots=True, eq=False)
class Residual:
    """``knots``: c, shape (k, 3), in 0..1, 1 to 48 of them; ``width``: w, above 0; ``XYZ_cd_m2``: a, shape (k, 3).

    Raises DeviceError if these have other shapes, or a number is not finite or out of its range.
    """

    knots: Floats
    width: float
    XYZ_cd_m2: Floats

    def __post_init__(self) -> None:
        for name in ("knots", "XYZ_cd_m2"):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.ndim != 2 or array.shape[1] != 3 or not 1 <= len(array) <= MOST_KNOTS:
                raise DeviceError(f"a residual's {name} must be 1 to {MOST_KNOTS} rows of 3, not of {array.shape}")
            if not np.all(np.isfinite(array)):
                raise DeviceError(f"a residual's {name} must be finite")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if len(self.knots) != len(self.XYZ_cd_m2):
            raise DeviceError(f"a residual has {len(self.knots)} knots and {len(self.XYZ_cd_m2)} XYZ: one each")
        if self.knots.min() < 0 or self.knots.max() > 1 or not (np.isfinite(self.width) and 0.05 <= self.width <= 10):
            raise DeviceError("a residual's knots must lie in 0..1, and its width in 0.05..10")


def place_of(T: Floats) -> Floats:
    """Return u, in 0..0.88, of the channels' light in 0..1, of any shape."""
    return np.asarray(np.sqrt(T + EDGE) - ROOT)


def kernels(T: Floats, knots: Floats, width: float) -> Floats:
    """Return φ at the channels' light (n, 3) less φ at black, shape (n, k)."""
    off = np.linalg.norm(place_of(T)[:, None, :] - knots[None, :, :], axis=2)
    return _phi(off / width) - _phi(np.linalg.norm(knots, axis=1) / width)


def kernels_at_black(residual: Residual) -> Floats:
    """Return φ (k,) of each knot of ``residual`` at black.

    Parameters
    ----------
    residual
        What a display model leaves over.

    Returns
    -------
    ndarray
        The kernels there, shape (k,), in 0..1; a residual subtracts them, so that it is 0 at black.

    Examples
    --------
    >>> kernels_at_black(Residual(np.zeros((1, 3)), 1.0, np.ones((1, 3)))).tolist()
    [1.0]
    """
    return _phi(np.linalg.norm(residual.knots, axis=1) / residual.width)


def gram(knots: Floats, width: float) -> Floats:
    """Return φ between the knots, (k, k): the norm of a residual is aᵀ · gram · a in each coordinate."""
    return _phi(np.linalg.norm(knots[:, None, :] - knots[None, :, :], axis=2) / width)


def kernels_and_slopes(T: Floats, knots: Floats, width: float) -> tuple[Floats, list[Floats]]:
    """Return φ less φ at black, (k, n), and its slopes by each channel's light, for the channels' light (3, n)."""
    root = np.sqrt(T + EDGE)
    off = (root - ROOT)[None] - knots[:, :, None]
    rho = np.sqrt((off**2).sum(axis=1)) / width
    near = np.maximum(1.0 - rho, 0.0)
    cube = near**3
    made = cube * near * (4.0 * rho + 1.0) - _phi(np.linalg.norm(knots, axis=1) / width)[:, None]
    falls = -20.0 / width**2 * cube
    return made, [falls * off[:, c] * (0.5 / root[c]) for c in range(3)]


def _phi(rho: Floats) -> Floats:
    return np.asarray(np.maximum(1.0 - rho, 0.0) ** 4 * (4.0 * rho + 1.0))
