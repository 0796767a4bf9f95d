"""Readings at other places, from other angles and on other surrounds: uniformity, angles, pixel independence.

Uniformity (thesis Section 3.2.1.3, Figure 3.7, whose "percent" are differences in cd/m² times 100): here deviations are
relative to the centre, so that the same nine readings give −56 % to +12 %. Pixel independence: Section 3.2.1.1.
"""

from __future__ import annotations

import numpy as np

from devices.diagnostics.diagnosis import Cell, Check, Colour, Diagnosis, PlotAxes, Readout, Trace, numbers
from devices.diagnostics.readings import tagged, uv
from devices.display.gain_map import GainMap
from devices.readings import Measurements
from documents.arrays import Floats
from documents.yaml import yaml_lines

PIXEL_INDEPENDENCE = Check(
    "pixel_independence",
    "Pixel independence",
    2.0,
    "% of luminance",
    "this project: 2 % is ΔE00 0.4 at white; stray light in the instrument counts too, so shade its view",
)


def pixel_independence(measurements: Measurements) -> Diagnosis:
    """Judge the largest luminance difference, in %, between one patch's readings in different surrounds.

    The readings are named ``gray120@on-black``, ``gray120@on-white`` and so on, all of the same patch size.
    """
    patches: dict[str, dict[str, list[float]]] = {}
    for row, own in tagged(measurements, "surround"):
        patches.setdefault(own.base, {}).setdefault(own.parts[0], []).append(float(measurements.XYZ[row, 1]))
    lines, rows, worst = [], [], -1.0
    names = list(dict.fromkeys(around for surrounds in patches.values() for around in surrounds))
    for patch, surrounds in patches.items():
        light = {around: float(np.mean(values)) for around, values in surrounds.items()}
        centre = float(np.mean(list(light.values())))
        if len(light) < 2 or centre <= 0:
            continue
        first = light.get("black", next(iter(light.values())))
        if first <= 0:
            continue
        change = [100 * (value / first - 1) for value in light.values()]
        worst = max(worst, max(change) - min(change))
        lines.append(Trace(patch, numbers(names.index(around) + 1 for around in light), numbers(change), "ink"))
        rows += [(patch, around, light[around], f"{c:+.2f}") for around, c in zip(light, change, strict=True)]
    if worst < 0:
        return PIXEL_INDEPENDENCE.unjudged(
            "Read a patch in the middle of a black screen and of a white one, and name the readings gray120@on-black "
            "and gray120@on-white."
        )
    panel = PlotAxes("", "surround", "luminance from that on black, %", tuple(lines), (-2.0, 2.0), x_names=tuple(names))
    cells: tuple[tuple[Cell, ...], ...] = tuple(rows)
    table = Readout(("patch", "surround", "luminance, cd/m²", "from black, %"), cells)
    return PIXEL_INDEPENDENCE.judged(
        worst, f"A patch's luminance changes by {worst:.2g} % with what surrounds it.", series=(panel,), table=table
    )


UNIFORMITY = Check(
    "uniformity",
    "Spatial uniformity",
    10.0,
    "% from the centre",
    "ISO 12646 [ISO12646]: every place within 10 % of the centre's luminance (5 % is recommended)",
)
_COLOURS: tuple[Colour, ...] = ("ink", "accent", "soft", "grey", "red", "green", "blue")


def uniformity(measurements: Measurements) -> Diagnosis:
    """Judge the largest deviation from the centre, in %, over readings named ``...@r1c1`` and so on.

    ``output`` is the `gain_map:` of a display file.
    """
    grids: dict[str, dict[tuple[int, int], list[float]]] = {}
    for row, own in tagged(measurements, "place"):
        place = (int(own.parts[0]), int(own.parts[1]))
        grids.setdefault(own.base, {}).setdefault(place, []).append(float(measurements.XYZ[row, 1]))
    if not grids:
        return UNIFORMITY.unjudged(
            "Read one patch at several places, and name the readings gray120@r1c1, gray120@r1c2, ..."
        )
    base, places = max(grids.items(), key=lambda item: (len(item[1]), max(item[1].values())))
    rows, columns = max(r for r, _ in places), max(c for _, c in places)
    wanted = [(r, c) for r in range(1, rows + 1) for c in range(1, columns + 1)]
    missing = [f"r{r}c{c}" for r, c in wanted if (r, c) not in places]
    if missing or len(wanted) < 2:
        lacks = (
            f"{base}@{', '.join(missing[:6])} {'are' if len(missing) > 1 else 'is'} missing" if missing else "one place"
        )
        return UNIFORMITY.unjudged(f"The grid is not complete: {lacks}.")
    luminance = np.array([np.mean(places[place]) for place in wanted]).reshape(rows, columns)
    if np.any(luminance <= 0):
        return UNIFORMITY.unjudged(f"{base} was read with no light at some place; take a brighter patch.")
    deviation = 100 * (GainMap(luminance, (columns, rows), "cells", "centre").gains - 1)
    value = float(np.abs(deviation).max())
    lines = tuple(
        Trace(
            f"row {r + 1}", numbers(range(1, columns + 1)), numbers(deviation[r]), _COLOURS[r % len(_COLOURS)], "line"
        )
        for r in range(rows)
    )
    names = tuple(str(c + 1) for c in range(columns))
    panel = PlotAxes("", "column", "luminance from the centre's, %", lines, (-10.0, 10.0), x_names=names)
    cells: tuple[tuple[Cell, ...], ...] = tuple(
        (f"row {r + 1}", *(f"{luminance[r, c]:.4g} ({deviation[r, c]:+.1f} %)" for c in range(columns)))
        for r in range(rows)
    )
    table = Readout(("", *(f"column {c + 1}" for c in range(columns))), cells)
    words = (
        f"{base} at {rows} × {columns} places is between {deviation.min():+.3g} % and {deviation.max():+.3g} % of the "
        "centre. A gain map in the display file makes it even."
    )
    return UNIFORMITY.judged(value, words, series=(panel,), table=table, output=gain_map_yaml(luminance, base))


def gain_map_yaml(luminance: np.ndarray[tuple[int, ...], np.dtype[np.float64]], patch: str) -> str:
    """Return the `gain_map:` part of a display file for readings (rows, columns), the top row first."""
    rows = [[float(f"{value:.6g}") for value in row] for row in luminance]
    source = f"{len(luminance)} x {luminance.shape[1]} readings of one patch"
    part = {"luminance": rows, "positions": "cells", "normalise": "minimum", "source": source}
    lines = "\n".join(["gain_map:", *(f"  {line}" for line in yaml_lines(part))]) + "\n"
    return lines.replace("minimum\n", "minimum      # or centre: what each costs is in docs/display.md\n")


ANGULAR_COLOUR = Check(
    "angular_colour",
    "Colour off the normal",
    0.025,
    "Δu′v′ within 30°",
    "TCO'03 [TCO03]: at most 0.025 at ±30° from the normal, there between the two sides, here from straight ahead",
)
ANGULAR_LUMINANCE = Check(
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
_DARK = 1e-9  # straight ahead, a share of the brightest direction's luminance that is no light
_WAYS = {"": "horizontal", "h": "horizontal", "v": "vertical"}


def angular_colour(measurements: Measurements) -> Diagnosis:
    """Judge the largest Δu′v′ from straight ahead, within 30°, over readings named ``...@10deg`` and so on."""
    curves = _curves(measurements)
    if not curves:
        return ANGULAR_COLOUR.unjudged(_ASK)
    lines, rows, shifts = [], [], []
    for way, (angle, light, ahead) in curves.items():
        shift = np.linalg.norm(uv(light) - uv(ahead), axis=1)
        lines.append(Trace(way, numbers(angle), numbers(shift), "accent" if way == "vertical" else "ink", "line"))
        rows += [(way, float(a), float(s)) for a, s in zip(angle, shift, strict=True)]
        shifts += [float(s) for a, s in zip(angle, shift, strict=True) if 0 < abs(a) <= _WITHIN_DEG]
    if not shifts or not np.all(np.isfinite(shifts)):
        return ANGULAR_COLOUR.unjudged("Nothing with light was read between straight ahead and 30°.")
    panel = PlotAxes("", "angle from the normal, °", "Δu′v′ from straight ahead", tuple(lines), (0.025,))
    table = Readout(("direction", "angle, °", "Δu′v′"), tuple(rows))
    words = f"Colour changes by up to {max(shifts):.2g} in u′v′ within {_WITHIN_DEG:g}° of the normal."
    return ANGULAR_COLOUR.judged(max(shifts), words, series=(panel,), table=table)


def angular_luminance(measurements: Measurements) -> Diagnosis:
    """Judge to what angle, on every side that was read, luminance stays within 10 % of straight ahead."""
    curves = _curves(measurements)
    if not curves:
        return ANGULAR_LUMINANCE.unjudged(_ASK)
    lines, rows = [], []
    reach, ended = np.inf, True
    for way, (angle, light, ahead) in curves.items():
        change = light[:, 1] / ahead[1] - 1
        lines.append(
            Trace(way, numbers(angle), numbers(100 * change), "accent" if way == "vertical" else "ink", "line")
        )
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
        return ANGULAR_LUMINANCE.unjudged(_ASK)
    panel = PlotAxes("", "angle from the normal, °", "luminance from straight ahead, %", tuple(lines), (-10.0, 10.0))
    cells: tuple[tuple[Cell, ...], ...] = tuple(rows)
    table = Readout(("direction", "angle, °", "luminance, %"), cells)
    if not ended and reach < (ANGULAR_LUMINANCE.limit or 0):
        return ANGULAR_LUMINANCE.unjudged(f"Nothing was read beyond {reach:g}°.", series=(panel,), table=table)
    words = (
        f"Luminance stays within 10 % of straight ahead up to {reach:.3g}°{'.' if ended else ', the last angle read.'}"
    )
    return ANGULAR_LUMINANCE.judged(reach, words, series=(panel,), table=table)


def _reach(angle: Floats, change: Floats) -> tuple[float, bool]:
    """Return the angle at which ``change`` first exceeds 10 %, and True; or the last angle, and False."""
    for before, after in zip(range(len(angle) - 1), range(1, len(angle)), strict=True):
        if change[after] > _SHARE:
            step = (_SHARE - change[before]) / (change[after] - change[before])
            return float(angle[before] + step * (angle[after] - angle[before])), True
    return float(angle[-1]), False


def _curves(measurements: Measurements) -> dict[str, tuple[Floats, Floats, Floats]]:
    """Return for each direction the angles (n,), rising, their XYZ (n, 3), and XYZ (3,) straight ahead."""
    by_direction: dict[str, dict[float, list[Floats]]] = {}
    readings = tagged(measurements, "angle")
    bases = [own.base for _, own in readings]
    if not bases:
        return {}
    base = max(dict.fromkeys(bases), key=bases.count)
    for row, own in readings:
        if own.base == base:
            angles = by_direction.setdefault(_WAYS[own.parts[0]], {})
            angles.setdefault(float(own.parts[1]), []).append(measurements.XYZ[row])
    ahead = [light for angles in by_direction.values() for light in angles.get(0.0, [])]
    largest = max(
        abs(float(light[1])) for angles in by_direction.values() for lights in angles.values() for light in lights
    )
    if not ahead or np.mean(ahead, axis=0)[1] <= _DARK * largest:
        return {}
    centre = np.asarray(np.mean(ahead, axis=0))
    curves = {}
    for way, angles in by_direction.items():
        order = sorted({*angles, 0.0})
        light = np.array([np.mean(angles.get(angle, [centre]), axis=0) for angle in order])
        if len(order) > 1:
            curves[way] = (np.array(order), light, centre)
    return curves
