"""Channel constancy: whether a channel keeps its chromaticity at every level (thesis Section 3.2.1.4, Figure 3.9).

The figure shows x and y as measured, like the thesis's; the verdict is on light above black, because black, which
every LCD adds, pulls dark colours towards its own chromaticity without any fault of the channel.
"""

from __future__ import annotations

import numpy as np

from devices.diagnostics.diagnosis import Check, Colour, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.ramps import CHANNELS, FLOOR_SHARE, black_or_none, channel_ramps, uv, xy
from devices.measurements import Measurements

CHECK = Check(
    "channel_constancy",
    "Channel constancy",
    0.01,
    "Δu′v′",
    "ISO 12646 [ISO12646] and TCO'03 [TCO03] for one colour over the panel: within 0.01; here for one over its levels",
)
_COLOURS: dict[str, Colour] = {"red": "red", "green": "green", "blue": "blue"}
_FEWEST = 3


def channel_constancy(measurements: Measurements) -> Diagnosis:
    """Judge the largest Δu′v′ of any channel's light above black from that at its highest level.

    Levels with less than 2 % of the channel's light are drawn but not judged.
    """
    dark, remark = black_or_none(measurements)
    as_read: tuple[list[Line], list[Line]] = ([], [])
    shifts, rows = [], []
    for name in CHANNELS:
        ramp = channel_ramps(measurements)[name]
        if len(ramp) < _FEWEST:
            return CHECK.unjudged(f"The ramp of {name} has fewer than three levels.")
        light = ramp.XYZ - dark
        if light[-1, 1] <= 0:
            return CHECK.unjudged(f"The channel {name} gives no light.")
        bright = light[:, 1] >= FLOOR_SHARE * light[-1, 1]
        distance = np.linalg.norm(uv(light[bright]) - uv(light[-1]), axis=1)
        worst = int(np.argmax(distance))
        rows.append((name, float(255 * ramp.levels[bright][worst]), float(distance[worst])))
        shifts.append(float(distance[worst]))
        coordinates = xy(ramp.XYZ)
        lit = np.all(np.isfinite(coordinates), axis=1)
        for axis in (0, 1):
            level = 255 * ramp.levels[lit]
            as_read[axis].append(Line(name, numbers(level), numbers(coordinates[lit, axis]), _COLOURS[name], "points"))
            full = numbers([coordinates[lit][-1, axis]] * 2)
            as_read[axis].append(Line("", numbers([0, 255]), full, _COLOURS[name], "dashed"))
    panels = tuple(
        Panel(f"{axis} as read, black included", "code (0–255)", axis, tuple(lines))
        for axis, lines in zip("xy", as_read, strict=True)
    )
    least = rows[int(np.argmax(shifts))]
    words = f"Above black, {least[0]} moves most: {least[2]:.2g} in u′v′, at code {least[1]:.0f}.{remark}"
    table = Table(("channel", "at code (0–255)", "largest Δu′v′"), tuple(rows))
    if not np.all(np.isfinite(shifts)):
        return CHECK.unjudged(f"A channel's light has no chromaticity.{remark}", series=panels)
    return CHECK.judged(max(shifts), words, series=panels, table=table)
