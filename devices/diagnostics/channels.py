"""What the channels do: the tone response, one chromaticity at every level, and light that adds up.

Tone response (thesis Section 3.2.1.6, Figure 3.11): normalised luminance of red, green, blue and grey with the best
simple gamma. The gamma is shown and not judged, because a model may hold any rising curve.

Channel constancy (Section 3.2.1.4, Figure 3.9): the figure shows x and y as measured, as the thesis does; the verdict
is on light above black, because black, which every LCD adds, pulls dark colours towards its own chromaticity without
any fault of the channel.

Additivity (Section 3.2.1.5, Figure 3.10): for X, Y and Z alike and for every mixture that was read, not greys alone;
each channel's reading holds the display's black, which counts once in a sum.
"""

from __future__ import annotations

import numpy as np

from devices.diagnostics.diagnosis import Check, Colour, Diagnosis, PlotAxes, Readout, Trace, numbers
from devices.diagnostics.readings import (
    CHANNELS,
    FLOOR_SHARE,
    SAME_DIGITS,
    black_or_none,
    cable_colours,
    channel_ramps,
    grey_ramp,
    means,
    uv,
    xy,
)
from devices.readings import Measurements
from documents.arrays import Floats

RISING = Check(
    "tone_response",
    "Tone response",
    0.5,
    "% of full light",
    "this project: a curve that falls cannot be undone; noise of 0.2 % lets a fine ramp fall by up to 0.5 % at its top",
)
HEADROOM = Check(
    "headroom",
    "Rise at the top",
    0.5,
    "% of full light, over the top 2 % of codes",
    "this project: a gamma of 1.8 rises by 3.6 % there and a straight line by 2 %; less is a clipped signal or reading",
    at_least=True,
)
_FEWEST_LEVELS = 4
_TOP = 0.98
_RAMPS: tuple[tuple[str, Colour], ...] = (("red", "red"), ("green", "green"), ("blue", "blue"), ("grey", "grey"))


def simple_gamma(levels: Floats, light: Floats) -> tuple[float, float]:
    """Return the gamma for which levels^gamma is nearest ``light``, both (k,) in 0..1, and its R²."""
    low, high = 0.2, 8.0
    for _ in range(11):  # each grid is ten times as fine as the one before
        grid = np.linspace(low, high, 21)
        left = ((levels ** grid[:, None] - light) ** 2).sum(axis=1)
        best = int(left.argmin())
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, 20)]
    spread = float(((light - light.mean()) ** 2).sum())
    return float(grid[best]), 1 - float(left[best]) / spread if spread > 0 else float("nan")


def tone_response(measurements: Measurements) -> Diagnosis:
    """Judge the largest fall of luminance from one level to the next, in % of the ramp's full light."""
    shares, why = _shares(measurements)
    if why:
        return RISING.unjudged(why)
    falls, rows, panels = [], [], []
    for name, colour in _RAMPS:
        if name not in shares:
            continue
        levels, light = shares[name]
        gamma, fit = simple_gamma(levels / levels[-1], light)
        fall = 100 * max(0.0, float(-np.diff(light, prepend=0.0).min()))
        falls.append(fall)
        rows.append((name, gamma, f"{fit:.4f}", fall, float(len(levels))))
        smooth = np.linspace(0, levels[-1], 120)
        lines = (
            Trace("read", numbers(255 * levels), numbers(light), colour, "points"),
            Trace(
                f"gamma {gamma:.2f}", numbers(255 * smooth), numbers((smooth / levels[-1]) ** gamma), colour, "dashed"
            ),
        )
        panels.append(PlotAxes(name, "code (0–255)", "luminance, share of full", lines))
    value = max(falls)
    worst = rows[int(np.argmax(falls))][0]
    words = (
        "Light rises with the code everywhere." if value == 0 else f"The largest fall, of {worst}, is {value:.2g} %."
    )
    table = Readout(("ramp", "best gamma", "R²", "largest fall, %", "levels"), tuple(rows))
    return RISING.judged(value, words + _dark(measurements), series=tuple(panels), table=table)


def headroom(measurements: Measurements) -> Diagnosis:
    """Judge the smallest rise of any ramp over the top 2 % of codes, in % of its full light."""
    shares, why = _shares(measurements)
    if why:
        return HEADROOM.unjudged(why)
    full = {name: pair for name, pair in shares.items() if pair[0][-1] >= 1}
    if not full:
        return HEADROOM.unjudged("No ramp reaches full drive.")
    rise = {name: 100 * float(light[-1] - np.interp(_TOP, levels, light)) for name, (levels, light) in full.items()}
    least = min(rise, key=lambda name: rise[name])
    lines = tuple(
        Trace(name, numbers(255 * full[name][0]), numbers(full[name][1]), colour, "line")
        for name, colour in _RAMPS
        if name in full
    )
    panel = PlotAxes("", "code (0–255)", "luminance, share of full", lines)
    table = Readout(("ramp", "rise, %"), tuple(rise.items()))
    words = f"Over the top 2 % of codes {least} rises least, by {rise[least]:.2g} % of its light."
    return HEADROOM.judged(rise[least], words, series=(panel,), table=table)


def _dark(measurements: Measurements) -> str:
    return black_or_none(measurements)[1]


def _shares(measurements: Measurements) -> tuple[dict[str, tuple[Floats, Floats]], str]:
    """Return each ramp's levels (k,) and luminance above black as a share of the last level's, (k,)."""
    dark, _ = black_or_none(measurements)
    shares = {}
    for name, ramp in {**channel_ramps(measurements), "grey": grey_ramp(measurements)}.items():
        if len(ramp) < _FEWEST_LEVELS:
            continue
        light = ramp.XYZ[:, 1] - dark[1]
        if light[-1] <= 0:
            return {}, f"The channel {name} gives no light at its highest level."
        shares[name] = (ramp.levels, np.asarray(light / light[-1]))
    return shares, "" if shares else "No ramp has four levels or more."


CONSTANCY = Check(
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

    Levels with less than 2 % of the channel's light are drawn but not judged. Where there are no ramps, the channels'
    codes of the set ``cable`` count.
    """
    if min(len(ramp) for ramp in channel_ramps(measurements).values()) < _FEWEST:
        measurements = cable_colours(measurements)
    dark, remark = black_or_none(measurements)
    as_read: tuple[list[Trace], list[Trace]] = ([], [])
    shifts, rows = [], []
    for name in CHANNELS:
        ramp = channel_ramps(measurements)[name]
        if len(ramp) < _FEWEST:
            return CONSTANCY.unjudged(f"The ramp of {name} has fewer than three levels.")
        light = ramp.XYZ - dark
        if light[-1, 1] <= 0:
            return CONSTANCY.unjudged(f"The channel {name} gives no light.")
        bright = light[:, 1] >= FLOOR_SHARE * light[-1, 1]
        distance = np.linalg.norm(uv(light[bright]) - uv(light[-1]), axis=1)
        worst = int(np.argmax(distance))
        rows.append((name, float(255 * ramp.levels[bright][worst]), float(distance[worst])))
        shifts.append(float(distance[worst]))
        coordinates = xy(ramp.XYZ)
        lit = np.all(np.isfinite(coordinates), axis=1)
        for axis in (0, 1):
            level = 255 * ramp.levels[lit]
            as_read[axis].append(Trace(name, numbers(level), numbers(coordinates[lit, axis]), _COLOURS[name], "points"))
            full = numbers([coordinates[lit][-1, axis]] * 2)
            as_read[axis].append(Trace("", numbers([0, 255]), full, _COLOURS[name], "dashed"))
    panels = tuple(
        PlotAxes(f"{axis} as read, black included", "code (0–255)", axis, tuple(lines))
        for axis, lines in zip("xy", as_read, strict=True)
    )
    least = rows[int(np.argmax(shifts))]
    words = f"Above black, {least[0]} moves most: {least[2]:.2g} in u′v′, at code {least[1]:.0f}.{remark}"
    if least[2] > (CONSTANCY.limit or 0):
        words += (
            " Liquid crystals do this, and so do codes that are converted for a display of another tone response on "
            "their way (colour management of the desktop): see Primaries of a standard."
        )
    table = Readout(("channel", "at code (0–255)", "largest Δu′v′"), tuple(rows))
    if not np.all(np.isfinite(shifts)):
        return CONSTANCY.unjudged(f"A channel's light has no chromaticity.{remark}", series=panels)
    return CONSTANCY.judged(max(shifts), words, series=panels, table=table)


ADDITIVITY = Check(
    "additivity",
    "Channel independence",
    2.0,
    "% of X, Y or Z",
    "this project: a matrix cannot follow what does not add up; 2 % is ΔE00 0.4 at white and ten times the noise of a "
    "good reading",
)
_AXES: tuple[tuple[str, Colour], ...] = (("X", "red"), ("Y", "green"), ("Z", "blue"))


def additivity(measurements: Measurements) -> Diagnosis:
    """Judge the largest difference, in % of what was read, between a mixture and the sum of its channels.

    Mixtures are the readings with two or three channels lit, each of which was read alone at that code. Those with
    less than 2 % of the light of the brightest are drawn but not judged.
    """
    dark, remark = black_or_none(measurements)
    alone = {
        (channel, round(float(level), SAME_DIGITS)): light
        for channel, name in enumerate(CHANNELS)
        for level, light in _levels(measurements, name)
    }
    mixtures: list[Floats] = []
    read: list[Floats] = []
    sums: list[Floats] = []
    for code, light in zip(*means(measurements), strict=True):
        parts = [
            alone.get((channel, round(float(code[channel]), SAME_DIGITS))) for channel in range(3) if code[channel] > 0
        ]
        if len(parts) >= 2 and all(part is not None for part in parts):
            mixtures.append(code)
            read.append(light)
            sums.append(np.sum([part for part in parts if part is not None], axis=0) - (len(parts) - 1) * dark)
    if len(mixtures) < _FEWEST:
        return ADDITIVITY.unjudged("Read greys or other mixtures at codes at which each channel was read alone.")
    codes, together, apart = np.array(mixtures), np.array(read), np.array(sums)
    bright = np.all(together > FLOOR_SHARE * together.max(axis=0), axis=1)
    grey = np.all(codes == codes[:, :1], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = 100 * (together / apart - 1)
    if not bright.any() or not np.all(np.isfinite(relative[bright])):
        return ADDITIVITY.unjudged(f"No mixture has light enough in X, Y and Z to judge by.{remark}")
    judged = np.flatnonzero(bright)
    worst = int(judged[np.argmax(np.abs(relative[judged]).max(axis=1))])
    value = float(np.abs(relative[worst]).max())
    order = np.flatnonzero(grey)[np.argsort(codes[grey, 0])]
    level = 255 * codes[order, 0]
    panels = [
        PlotAxes(
            "greys",
            "code (0–255)",
            "luminance, cd/m²",
            (
                Trace("read", numbers(level), numbers(together[order, 1]), "red", "dashed"),
                Trace("sum of the channels", numbers(level), numbers(apart[order, 1]), "blue", "line"),
            ),
        )
    ]
    panels.append(
        PlotAxes(
            "every mixture",
            "luminance, cd/m²",
            "read, from the sum, %",
            tuple(
                Trace(axis, numbers(together[judged, i]), numbers(relative[judged, i]), colour, "points")
                for i, (axis, colour) in enumerate(_AXES)
            ),
            (-2.0, 2.0),
        )
    )
    ranked = judged[np.argsort(-np.abs(relative[judged]).max(axis=1))][:8]
    rows = tuple(
        (" ".join(f"{255 * part:.0f}" for part in codes[i]), *(f"{value:+.2f}" for value in relative[i]))
        for i in ranked
    )
    words = (
        f"Of {len(judged)} mixtures, {' '.join(f'{255 * part:.0f}' for part in codes[worst])} differs most from the "
        f"sum of its channels, by {value:.2g} %.{remark}"
    )
    table = Readout(("code (0–255)", "X, %", "Y, %", "Z, %"), rows)
    return ADDITIVITY.judged(value, words, series=tuple(panels), table=table)


def _levels(measurements: Measurements, name: str) -> list[tuple[float, Floats]]:
    ramp = channel_ramps(measurements)[name]
    return [(float(level), light) for level, light in zip(ramp.levels, ramp.XYZ, strict=True)]
