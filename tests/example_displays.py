"""A liquid-crystal display that departs from every simple model, and noise, to try the fits on."""

from __future__ import annotations

import numpy as np

from devices.display import TableCurve
from documents.arrays import Floats


def liquid_crystal_XYZ(codes: Floats) -> Floats:
    """Return XYZ in cd/m² of ``codes`` (n, 3) on a display far from GOG.

    Its curve is S-shaped, its black 0.1 % of white, and its channels act on each other: the others at full drive move a
    middle code by 0.01, and take 2 % of white's light.
    """
    matrix = np.array([[41.2, 35.8, 18.0], [21.3, 71.5, 7.2], [1.9, 11.9, 95.0]])
    x = np.linspace(0.0, 1.0, 65)
    light = x**2.3 * 1.3 / (1.0 + 0.3 * x**3)
    curve = TableCurve(tuple(x.tolist()), tuple((light / light[-1]).tolist()))
    others = (codes.sum(axis=1, keepdims=True) - codes) / 2.0
    moved = np.clip(codes + 0.01 * others * 4.0 * codes * (1.0 - codes), 0.0, 1.0)
    linear = curve.linear(moved)
    together = (linear.sum(axis=1) - linear.max(axis=1)) / 2.0
    above = linear @ matrix.T * (1.0 - 0.02 * together)[:, None]
    return np.asarray(above + 0.001 * matrix.sum(axis=1) * np.array([0.9, 1.0, 1.3]))


def noisy(XYZ: Floats, share: float, seed: int) -> Floats:
    """Return XYZ with each number off by ``share`` of it, in standard deviations."""
    return np.asarray(XYZ * (1.0 + share * np.random.default_rng(seed).standard_normal(XYZ.shape)))
