"""Angular dependence: how luminance and colour change away from straight ahead, where that was measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.diagnostics.diagnosis import Cell, Check, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.ramps import uv
from devices.diagnostics.tags import tagged
from devices.measurements import Measurements

Floats = NDArray[np.float64]

COLOUR = Check(
    "angular_colour",
    "Colour off the normal",
    0.025,
    "Δu′v′ within 30°",
    "TCO'03 [TCO03]: at most 0.025 at ±30° from the normal, there between the two sides, here from straight ahead",
)
LUMINANCE = Check(
    "angular_luminance",
    "Luminance off the normal",
    10.0,
    "° to which luminance is within 10 %",
    "this project: 10 % as for uniformity [ISO12646], over 10° to each side, a picture 25 cm wide seen from 70 cm",
    at_least=True,
)
_WITHIN_DEG = 30.0
_ASK = "Read one patch from several angles, and name the readings white@0deg, white@10deg, white@v-10deg, ..."
_SHARE = 0.10
_WAYS = {"": "horizontal", "h": "horizontal", "v": "vertical"}


def angular_colour(measurements: Measurements) -> Diagnosis:
    """Judge the largest Δu′v′ from straight ahead, within 30°, over readings named ``...@10deg`` and so on."""
    found = _curves(measurements)
    if not found:
        return COLOUR.unjudged(_ASK)
    lines, rows, shifts = [], [], []
    for way, (angle, light, ahead) in found.items():
        shift = np.linalg.norm(uv(light) - uv(ahead), axis=1)
        lines.append(Line(way, numbers(angle), numbers(shift), "accent" if way == "vertical" else "ink", "line"))
        rows += [(way, float(a), float(s)) for a, s in zip(angle, shift, strict=True)]
        shifts += [float(s) for a, s in zip(angle, shift, strict=True) if 0 < abs(a) <= _WITHIN_DEG]
    if not shifts or not np.all(np.isfinite(shifts)):
        return COLOUR.unjudged("Nothing with light was read between straight ahead and 30°.")
    panel = Panel("", "angle from the normal, °", "Δu′v′ from straight ahead", tuple(lines), (0.025,))
    table = Table(("direction", "angle, °", "Δu′v′"), tuple(rows))
    words = f"Colour changes by up to {max(shifts):.2g} in u′v′ within {_WITHIN_DEG:g}° of the normal."
    return COLOUR.judged(max(shifts), words, series=(panel,), table=table)


def angular_luminance(measurements: Measurements) -> Diagnosis:
    """Judge to what angle, on every side that was read, luminance stays within 10 % of straight ahead."""
    found = _curves(measurements)
    if not found:
        return LUMINANCE.unjudged(_ASK)
    lines, rows = [], []
    reach, ended = np.inf, True
    for way, (angle, light, ahead) in found.items():
        change = light[:, 1] / ahead[1] - 1
        lines.append(Line(way, numbers(angle), numbers(100 * change), "accent" if way == "vertical" else "ink", "line"))
        rows += [(way, float(a), f"{100 * c:+.1f}") for a, c in zip(angle, change, strict=True)]
        for side in (-1, 1):
            outward = np.flatnonzero(angle * side >= 0)
            if len(outward) < 2:
                continue
            order = outward[np.argsort(np.abs(angle[outward]))]
            at, left = _reach(np.abs(angle[order]), np.abs(change[order]))
            if at < reach:
                reach, ended = at, left
    if not np.isfinite(reach):
        return LUMINANCE.unjudged(_ASK)
    panel = Panel("", "angle from the normal, °", "luminance from straight ahead, %", tuple(lines), (-10.0, 10.0))
    cells: tuple[tuple[Cell, ...], ...] = tuple(rows)
    table = Table(("direction", "angle, °", "luminance, %"), cells)
    if not ended and reach < (LUMINANCE.limit or 0):
        return LUMINANCE.unjudged(f"Nothing was read beyond {reach:g}°.", series=(panel,), table=table)
    words = (
        f"Luminance stays within 10 % of straight ahead up to {reach:.3g}°{'.' if ended else ', the last angle read.'}"
    )
    return LUMINANCE.judged(reach, words, series=(panel,), table=table)


def _reach(angle: Floats, change: Floats) -> tuple[float, bool]:
    """Return the angle at which ``change`` first exceeds 10 %, and True; or the last angle, and False."""
    for before, after in zip(range(len(angle) - 1), range(1, len(angle)), strict=True):
        if change[after] > _SHARE:
            step = (_SHARE - change[before]) / (change[after] - change[before])
            return float(angle[before] + step * (angle[after] - angle[before])), True
    return float(angle[-1]), False


def _curves(measurements: Measurements) -> dict[str, tuple[Floats, Floats, Floats]]:
    """Return for each direction the angles (n,), rising, their XYZ (n, 3), and XYZ (3,) straight ahead."""
    found: dict[str, dict[float, list[Floats]]] = {}
    readings = tagged(measurements, "angle")
    bases = [said.base for _, said in readings]
    if not bases:
        return {}
    base = max(dict.fromkeys(bases), key=bases.count)
    for row, said in readings:
        if said.base == base:
            angles = found.setdefault(_WAYS[said.parts[0]], {})
            angles.setdefault(float(said.parts[1]), []).append(measurements.XYZ[row])
    ahead = [light for angles in found.values() for light in angles.get(0.0, [])]
    if not ahead or np.mean(ahead, axis=0)[1] <= 0:
        return {}
    centre = np.asarray(np.mean(ahead, axis=0))
    curves = {}
    for way, angles in found.items():
        order = sorted({*angles, 0.0})
        light = np.array([np.mean(angles.get(angle, [centre]), axis=0) for angle in order])
        if len(order) > 1:
            curves[way] = (np.array(order), light, centre)
    return curves
