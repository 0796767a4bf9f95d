"""Pixel independence: whether a patch gives the same light whatever surrounds it (thesis Section 3.2.1.1)."""

from __future__ import annotations

import numpy as np

from devices.diagnostics.diagnosis import Cell, Check, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.tags import tagged
from devices.measurements import Measurements

CHECK = Check(
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
    for row, said in tagged(measurements, "surround"):
        patches.setdefault(said.base, {}).setdefault(said.parts[0], []).append(float(measurements.XYZ[row, 1]))
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
        lines.append(Line(patch, numbers(names.index(around) + 1 for around in light), numbers(change), "ink"))
        rows += [(patch, around, light[around], f"{c:+.2f}") for around, c in zip(light, change, strict=True)]
    if worst < 0:
        return CHECK.unjudged(
            "Read a patch in the middle of a black screen and of a white one, and name the readings gray120@on-black "
            "and gray120@on-white."
        )
    panel = Panel("", "surround", "luminance from that on black, %", tuple(lines), (-2.0, 2.0), x_names=tuple(names))
    cells: tuple[tuple[Cell, ...], ...] = tuple(rows)
    table = Table(("patch", "surround", "luminance, cd/m²", "from black, %"), cells)
    return CHECK.judged(
        worst, f"A patch's luminance changes by {worst:.2g} % with what surrounds it.", series=(panel,), table=table
    )
