"""Displays to try the fits on: the thesis's, and a liquid-crystal one that departs from every simple model."""

from __future__ import annotations

import numpy as np

from devices.display.model import DisplayModel
from devices.display.table_curve import TableCurve
from devices.display.tone_curve import ToneCurve
from documents.arrays import Floats

# Table 3.6, gains for codes in 0..1.
THESIS_CURVES = ((0.9690, 0.0218, 1.8132), (1.0455, 0.0, 1.7649), (0.9945, 0.0, 1.7156))


def thesis_display() -> DisplayModel:
    """Return the display of thesis Expression 3.12 and Table 3.6.

    Returns
    -------
    DisplayModel
        The model: GOG curves, primaries in cd/m², and no black.

    Examples
    --------
    >>> thesis_display().primaries_XYZ_cd_m2[1].tolist()
    [5.62, 18.65, 2.2]
    """
    red, green, blue = (ToneCurve(*curve) for curve in THESIS_CURVES)
    matrix = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
    return DisplayModel(np.zeros(3), matrix, (red, green, blue))


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


def table_c1_codes() -> Floats:
    """Return the codes (120, 3), in 0..1, of the thesis's Table C.1, in its order.

    Returns
    -------
    ndarray
        Device codes of red, green and blue, shape (120, 3), in 0..1: black, ramps of each channel, pairs of channels,
        and greys.

    Examples
    --------
    >>> (255.0 * table_c1_codes()).round().tolist()[:3]
    [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [20.0, 0.0, 0.0]]
    """
    levels = [*range(10, 251, 10), 255]
    rows = [[0, 0, 0]]
    for channel in range(3):
        rows += [[level if c == channel else 0 for c in range(3)] for level in levels]
    for pair in ((0, 1), (1, 2), (0, 2)):
        rows += [[level if c in pair else 0 for c in range(3)] for level in (50, 100, 150, 200, 255)]
    rows += [[level] * 3 for level in levels]
    return np.array(rows, dtype=np.float64) / 255.0


def noisy(XYZ: Floats, share: float, seed: int) -> Floats:
    """Return XYZ with each number off by ``share`` of it, in standard deviations."""
    return np.asarray(XYZ * (1.0 + share * np.random.default_rng(seed).standard_normal(XYZ.shape)))
