"""Displays that were never measured, drawn at random within what displays are."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from devices.colour import rgb_to_xyz_matrix
from devices.display import Curve, DisplayModel, Plvc, TableCurve, ToneCurve

STEPS = tuple(np.linspace(0, 1, 18).tolist())


def _table(gamma: float, bend: float) -> TableCurve:
    codes = np.asarray(STEPS)
    light = codes**gamma * (1 + bend * np.sin(np.pi * codes) * (1 - codes))
    light = 0.998 * np.maximum.accumulate(light / light[-1]) + 0.002 * codes**2
    return TableCurve(STEPS, tuple(light.tolist()))


@st.composite
def displays(draw: st.DrawFn) -> DisplayModel:
    """Draw an additive display: primaries, white, luminance, black, and curves of the GOG family or tables."""
    move = st.floats(-0.02, 0.02)
    corners = [(x + draw(move), y + draw(move)) for x, y in ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.31, 0.33))]
    luminance = draw(st.floats(5.0, 1000.0))
    primaries = luminance * rgb_to_xyz_matrix(*corners)
    black = primaries @ np.array([draw(st.floats(0.0, 0.01)) for _ in range(3)])
    curves: list[Curve] = []
    tabled = draw(st.booleans())
    for _ in range(3):
        gamma = draw(st.floats(1.6, 2.6))
        offset = draw(st.floats(-0.05, 0.05))
        curve = _table(gamma, draw(st.floats(-0.2, 0.2))) if tabled else ToneCurve(1.0 - offset, offset, gamma)
        curves.append(curve)
    return DisplayModel(black, primaries, (curves[0], curves[1], curves[2]))


def plvc_display(strength: float) -> Plvc:
    """Return a display whose primaries vary with their level, and whose channels take from each other, by a share."""
    primaries = 100.0 * rgb_to_xyz_matrix((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.31, 0.33))
    rng = np.random.default_rng(4)
    share = strength * (1 - np.array([0.0, 0.25, 0.5, 0.75]))[None, :, None] * rng.uniform(-1, 1, (3, 1, 3))
    mixtures = strength * rng.uniform(-1, 1, (10, 3)) * 8.0
    curves = (_table(2.2, 0.0), _table(2.1, 0.1), _table(2.3, -0.1))
    return Plvc(np.array([0.08, 0.08, 0.1]), primaries, curves, primaries.T[:, None] * (1 + share), mixtures)
