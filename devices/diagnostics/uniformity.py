"""Spatial uniformity: how much dimmer or brighter the panel is away from its centre.

Thesis Section 3.2.1.3 and Figure 3.7, whose "percent" are differences in cd/m² times 100; here deviations are relative
to the centre, so that the same nine readings give −56 % to +12 %.
"""

from __future__ import annotations

import numpy as np

from devices.compensation.gain_map import GainMap
from devices.diagnostics.diagnosis import Cell, Check, Colour, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.tags import tagged
from devices.measurements import Measurements

CHECK = Check(
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
    for row, said in tagged(measurements, "place"):
        place = (int(said.parts[0]), int(said.parts[1]))
        grids.setdefault(said.base, {}).setdefault(place, []).append(float(measurements.XYZ[row, 1]))
    if not grids:
        return CHECK.unjudged("Read one patch at several places, and name the readings gray120@r1c1, gray120@r1c2, ...")
    base, places = max(grids.items(), key=lambda item: (len(item[1]), max(item[1].values())))
    rows, columns = max(r for r, _ in places), max(c for _, c in places)
    wanted = [(r, c) for r in range(1, rows + 1) for c in range(1, columns + 1)]
    missing = [f"r{r}c{c}" for r, c in wanted if (r, c) not in places]
    if missing or len(wanted) < 2:
        lacks = (
            f"{base}@{', '.join(missing[:6])} {'are' if len(missing) > 1 else 'is'} missing" if missing else "one place"
        )
        return CHECK.unjudged(f"The grid is not complete: {lacks}.")
    luminance = np.array([np.mean(places[place]) for place in wanted]).reshape(rows, columns)
    if np.any(luminance <= 0):
        return CHECK.unjudged(f"{base} was read with no light at some place; take a brighter patch.")
    deviation = 100 * (GainMap(luminance, (columns, rows), "cells", "centre").gains - 1)
    value = float(np.abs(deviation).max())
    lines = tuple(
        Line(f"row {r + 1}", numbers(range(1, columns + 1)), numbers(deviation[r]), _COLOURS[r % len(_COLOURS)], "line")
        for r in range(rows)
    )
    names = tuple(str(c + 1) for c in range(columns))
    panel = Panel("", "column", "luminance from the centre's, %", lines, (-10.0, 10.0), x_names=names)
    cells: tuple[tuple[Cell, ...], ...] = tuple(
        (f"row {r + 1}", *(f"{luminance[r, c]:.4g} ({deviation[r, c]:+.1f} %)" for c in range(columns)))
        for r in range(rows)
    )
    table = Table(("", *(f"column {c + 1}" for c in range(columns))), cells)
    words = (
        f"{base} at {rows} × {columns} places is between {deviation.min():+.3g} % and {deviation.max():+.3g} % of the "
        "centre. A gain map in the display file makes it even."
    )
    return CHECK.judged(value, words, series=(panel,), table=table, output=gain_map_yaml(luminance, base))


def gain_map_yaml(luminance: np.ndarray[tuple[int, ...], np.dtype[np.float64]], patch: str) -> str:
    """Return the `gain_map:` part of a display file for readings (rows, columns), the top row first."""
    rows = "\n".join(f"    - [{', '.join(f'{value:.6g}' for value in row)}]" for row in luminance)
    return (
        f"gain_map:\n  luminance:\n{rows}\n  positions: cells\n"
        "  normalise: minimum      # or centre: what each costs is in docs/display.md\n"
        f"  source: {len(luminance)} x {luminance.shape[1]} readings of one patch\n"
    )
