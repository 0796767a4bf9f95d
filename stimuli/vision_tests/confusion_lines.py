"""Colours that someone who lacks one kind of cones cannot tell apart.

In the CIE 1931 chromaticity diagram such colours lie on lines through one point, the chromaticity of light that the
missing cones alone would answer to. The three points are those of [Wyszecki1982], Section 5.14.2. In XYZ it is simpler:
two lights are the same to a dichromat if they differ by any amount k of the light P that has the missing point's
chromaticity, because no cone that is left answers to it. `confused` adds such light, and thereby moves a colour along
its confusion line without changing anything that the dichromat sees, brightness included.

The points hold for the average dichromat and for the 2° observer; a person's differ, and so do other tables'
[Smith1975] gives (1.400, -0.400) for deutan in Judd's revised space.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stimuli.errors import StimulusError

Floats = NDArray[np.float64]
Axis = Literal["protan", "deutan", "tritan"]
AXES: tuple[Axis, ...] = ("protan", "deutan", "tritan")
COPUNCTAL_XY: Mapping[Axis, tuple[float, float]] = MappingProxyType(
    {"protan": (0.747, 0.253), "deutan": (1.080, -0.080), "tritan": (0.171, 0.0)}
)


def uv_from_XYZ(xyz: ArrayLike) -> Floats:
    """Return CIE 1976 u', v', shape (..., 2), for XYZ, shape (..., 3)."""
    values = np.asarray(xyz, dtype=np.float64)
    total = values @ (1.0, 15.0, 3.0)
    return np.asarray(values[..., :2] * (4.0, 9.0) / total[..., None])


def missing_light(axis: Axis) -> Floats:
    """Return XYZ (3,) with X + Y + Z = 1 of the light to which only the cones that the dichromat lacks answer."""
    x, y = COPUNCTAL_XY[axis]
    return np.array([x, y, 1.0 - x - y])


def confused(axis: Axis, ground_XYZ: ArrayLike, delta_uv: float) -> Floats:
    """Return XYZ (3,) that the dichromat confuses with ``ground_XYZ`` and others see at a distance of it.

    ``delta_uv`` is the distance in CIE 1976 u', v': positive towards the missing point, negative away from it. The
    colour is the ground plus k times the missing light.

    Raises
    ------
    StimulusError
        If there is no such colour: the line ends before.
    """
    ground = np.asarray(ground_XYZ, dtype=np.float64)
    light = missing_light(axis)
    weights = np.array([1.0, 15.0, 3.0])
    # u'v' moves along a straight line by s(k) = |a| k / (D + d k), with D and d the denominators of ground and light.
    total, per_k = float(ground @ weights), float(light @ weights)
    start = uv_from_XYZ(ground)
    step = (light[:2] * (4.0, 9.0) - start * per_k) / total  # the derivative at k = 0
    speed = float(np.hypot(*step))
    # A colour at k has moved by speed · k / (1 + k per_k / total).
    denominator = speed - delta_uv * per_k / total
    if denominator <= 0:
        raise StimulusError(f"no colour lies {delta_uv} in u'v' along the {axis} line")
    k = delta_uv / denominator
    if k * per_k / total <= -1:
        raise StimulusError(f"no colour lies {delta_uv} in u'v' along the {axis} line")
    return np.asarray(ground + k * light)
