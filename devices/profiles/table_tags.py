"""A display model of any kind as tables of a profile: ``A2B0`` and ``B2A0``, curves, grid, curves and matrix.

In the grid stands only what the channels do to each other: its axes are the roots of the channels' own light, and it
gives the roots of the light in units of the primaries, which a matrix turns into XYZ. For an additive display the grid
changes nothing and any number of points is exact; for others it holds the little by which they differ, finest in the
dark. Near zero and below, where a colour takes away some of a primary, the root continues as a straight line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devices.display import DisplayModel
from devices.display.curves import Curve
from devices.profiles import tag_bytes
from devices.profiles.colour_table import XYZ_RANGE
from documents.arrays import Floats

ENTRIES = 4096
_NO_CURVE = b"curv\0\0\0\0\0\0\0\0"
# Below this light the root continues as its tangent: no kink where a colour takes away some of a primary.
_TOE = 0.002
_SLOPE = 2.0 * _TOE**0.5
_ROOT_0 = _TOE / _SLOPE
# Beyond its own ends a channel's root is kept this far, so that the edge of the gamut lies between points unbent.
_BELOW, _ABOVE = -0.2, 1.2
_PROBES = 17


@dataclass(frozen=True, slots=True, eq=False)
class _Range:
    """From the ``least`` to the ``most`` light (3,) in units of the primaries; ``low`` and ``high`` are their roots."""

    least: Floats
    most: Floats

    @property
    def low(self) -> Floats:
        return _root(self.least)

    @property
    def high(self) -> Floats:
        return _root(self.most)


@dataclass(frozen=True, slots=True, eq=False)
class _Units:
    """``dark`` (3,) at code 0 and ``primaries`` (3, 3) above it, in cd/m²: the units in which light is tabled."""

    dark: Floats
    primaries: Floats

    def light(self, XYZ: Floats) -> Floats:
        """Return light (n, 3) in units of the primaries, above black."""
        return np.asarray(np.linalg.solve(self.primaries, (XYZ - self.dark).T).T, dtype=np.float64)


def table_tags(model: DisplayModel, chad: Floats, luminance: float, points: int) -> tuple[bytes, bytes]:
    """Return ``A2B0`` and ``B2A0`` of ``model`` with a grid of ``points`` a side.

    ``chad`` (3, 3) and ``luminance`` in cd/m² lead from its light to the connection space.
    """
    dark = model.xyz(np.zeros(3))
    units = _Units(dark, (model.xyz(np.eye(3)) - dark).T)
    axis = np.linspace(0.0, 1.0, max(points, _PROBES))
    light = units.light(model.xyz(_codes(model, _cube(np.stack([axis] * 3)))))
    # What rounding alone leaves below 0 or above 1 is none.
    least, most = np.minimum(light.min(axis=0), 0.0), np.maximum(light.max(axis=0), 1.0)
    span = _Range(np.where(least > -1e-9, 0.0, least), np.where(most < 1.0 + 1e-9, 1.0, most))
    to_pcs = chad / luminance / XYZ_RANGE
    return _forward(model, units, span, to_pcs, points), _backward(model, units, span, to_pcs, points)


def _forward(model: DisplayModel, units: _Units, span: _Range, to_pcs: Floats, points: int) -> bytes:
    axis = np.linspace(0.0, 1.0, points)
    light = units.light(model.xyz(_codes(model, _cube(np.stack([axis] * 3)))))
    grid = (_root(light) - span.low) / (span.high - span.low)
    codes = np.linspace(0.0, 1.0, ENTRIES)
    first = b"".join(
        tag_bytes.padded(tag_bytes.sampled_curve(_share_of_root(_own(curve, codes)))) for curve in model.curves
    )
    rows = to_pcs @ units.primaries * (span.most - span.least)
    offset = to_pcs @ (units.dark + units.primaries @ span.least)
    middle = b"".join(_light_of_root(*ends) for ends in zip(span.least, span.most, span.low, span.high, strict=True))
    shaped = grid.reshape(points, points, points, 3)
    return tag_bytes.stages(b"mAB ", 3 * _NO_CURVE, rows, offset, middle, shaped, first)


def _backward(model: DisplayModel, units: _Units, span: _Range, to_pcs: Floats, points: int) -> bytes:
    axes = np.linspace(span.low, span.high, points, axis=1)
    own = model.linear(units.dark + _light(_cube(axes)) @ units.primaries.T)
    lowest, highest = model.limits
    shares = (own - lowest) / (highest - lowest)
    grid = (np.clip(_root(shares), _BELOW, _ABOVE) - _BELOW) / (_ABOVE - _BELOW)
    roots = np.linspace(_BELOW, _ABOVE, ENTRIES)
    wanted = lowest + (highest - lowest) * np.clip(_light(roots), 0.0, 1.0)[:, None]
    last = [curve.code(wanted[:, channel]) for channel, curve in enumerate(model.curves)]
    first = b"".join(tag_bytes.padded(tag_bytes.sampled_curve(code)) for code in last)
    from_pcs = np.linalg.inv(to_pcs @ units.primaries)
    scale = 1.0 / (span.most - span.least)
    rows = from_pcs * scale[:, None]
    offset = (-from_pcs @ to_pcs @ units.dark - span.least) * scale
    middle = b"".join(_root_of_light(*ends) for ends in zip(span.least, span.most, span.low, span.high, strict=True))
    shaped = grid.reshape(points, points, points, 3)
    return tag_bytes.stages(b"mBA ", 3 * _NO_CURVE, rows, offset, middle, shaped, first)


def _root(light: Floats) -> Floats:
    """Return √light, and below `_TOE` its tangent there, which goes on below zero."""
    return np.where(light >= _TOE, np.sqrt(np.maximum(light, 0.0)), (light + _TOE) / _SLOPE)


def _light(root: Floats) -> Floats:
    """Return the light of which ``root`` is the `_root`."""
    return np.where(root >= np.sqrt(_TOE), root**2, _SLOPE * root - _TOE)


def _light_of_root(least: float, most: float, low: float, high: float) -> bytes:
    """Return the curve from a root to light, both as shares of their ranges."""
    span, width = most - least, high - low
    power = [2.0, width / np.sqrt(span), low / np.sqrt(span)]
    return tag_bytes.parametric_curve(
        4, [*power, _SLOPE * width / span, (np.sqrt(_TOE) - low) / width, -least / span, 0.0]
    )


def _root_of_light(least: float, most: float, low: float, high: float) -> bytes:
    """Return the curve from light to its root, both as shares of their ranges."""
    span, width = most - least, high - low
    power = [0.5, span / width**2, least / width**2]
    return tag_bytes.parametric_curve(4, [*power, span / (_SLOPE * width), (_TOE - least) / span, -low / width, 0.0])


def _share_of_root(light: Floats) -> Floats:
    """Return the root of ``light`` in 0..1, from 0 to 1."""
    return np.asarray((_root(light) - _ROOT_0) / (1.0 - _ROOT_0))


def _own(curve: Curve, codes: Floats) -> Floats:
    """Return a channel's own light at ``codes`` from 0 to 1, as a share of what they span."""
    light = curve.linear(codes)
    return np.asarray(np.clip((light - light[0]) / (light[-1] - light[0]), 0.0, 1.0), dtype=np.float64)


def _codes(model: DisplayModel, shares: Floats) -> Floats:
    """Return the codes (n, 3) at which the roots of the channels' own light have ``shares`` (n, 3) of their range."""
    lowest, highest = model.limits
    light = lowest + (highest - lowest) * _light(_ROOT_0 + (1.0 - _ROOT_0) * shares)
    codes = np.stack([curve.code(light[:, channel]) for channel, curve in enumerate(model.curves)], axis=1)
    # At its ends a curve may be flat; the codes meant are 0 and 1.
    return np.where(shares == 0.0, 0.0, np.where(shares == 1.0, 1.0, codes))


def _cube(axes: Floats) -> Floats:
    """Return the points (n³, 3) of a grid with ``axes`` (3, n), the first channel slowest."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
