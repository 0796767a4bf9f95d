"""Tone response: whether light rises with the code all the way, and still rises at the top.

Thesis Section 3.2.1.6 and Figure 3.11: normalised luminance of red, green, blue and grey with the best simple gamma.
The gamma is shown and not judged, since a model may hold any rising curve.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.diagnostics.diagnosis import Check, Colour, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.ramps import black_or_none, channel_ramps, grey_ramp
from devices.measurements import Measurements

Floats = NDArray[np.float64]

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
_FEWEST = 4
_TOP = 0.98
_COLOURS: tuple[tuple[str, Colour], ...] = (("red", "red"), ("green", "green"), ("blue", "blue"), ("grey", "grey"))


def simple_gamma(levels: Floats, light: Floats) -> tuple[float, float]:
    """Return the gamma for which levels^gamma is nearest ``light``, both (k,) in 0..1, and its R²."""
    from scipy.optimize import minimize_scalar

    def left(gamma: float) -> float:
        return float(((levels**gamma - light) ** 2).sum())

    gamma = float(minimize_scalar(left, bounds=(0.2, 8.0), method="bounded", options={"xatol": 1e-10}).x)
    spread = float(((light - light.mean()) ** 2).sum())
    return gamma, 1 - left(gamma) / spread if spread > 0 else float("nan")


def tone_response(measurements: Measurements) -> Diagnosis:
    """Judge the largest fall of luminance from one level to the next, in % of the ramp's full light."""
    found, why = _shares(measurements)
    if why:
        return RISING.unjudged(why)
    falls, rows, panels = [], [], []
    for name, colour in _COLOURS:
        if name not in found:
            continue
        levels, light = found[name]
        gamma, fit = simple_gamma(levels / levels[-1], light)
        fall = 100 * max(0.0, float(-np.diff(light, prepend=0.0).min()))
        falls.append(fall)
        rows.append((name, gamma, f"{fit:.4f}", fall, float(len(levels))))
        smooth = np.linspace(0, levels[-1], 120)
        lines = (
            Line("read", numbers(255 * levels), numbers(light), colour, "points"),
            Line(
                f"gamma {gamma:.2f}", numbers(255 * smooth), numbers((smooth / levels[-1]) ** gamma), colour, "dashed"
            ),
        )
        panels.append(Panel(name, "code (0–255)", "luminance, share of full", lines))
    value = max(falls)
    worst = rows[int(np.argmax(falls))][0]
    words = (
        "Light rises with the code everywhere." if value == 0 else f"The largest fall, of {worst}, is {value:.2g} %."
    )
    table = Table(("ramp", "best gamma", "R²", "largest fall, %", "levels"), tuple(rows))
    return RISING.judged(value, words + _dark(measurements), series=tuple(panels), table=table)


def headroom(measurements: Measurements) -> Diagnosis:
    """Judge the smallest rise of any ramp over the top 2 % of codes, in % of its full light."""
    found, why = _shares(measurements)
    if why:
        return HEADROOM.unjudged(why)
    full = {name: pair for name, pair in found.items() if pair[0][-1] >= 1}
    if not full:
        return HEADROOM.unjudged("No ramp reaches full drive.")
    rise = {name: 100 * float(light[-1] - np.interp(_TOP, levels, light)) for name, (levels, light) in full.items()}
    least = min(rise, key=lambda name: rise[name])
    lines = tuple(
        Line(name, numbers(255 * full[name][0]), numbers(full[name][1]), colour, "line")
        for name, colour in _COLOURS
        if name in full
    )
    panel = Panel("", "code (0–255)", "luminance, share of full", lines)
    table = Table(("ramp", "rise, %"), tuple(rise.items()))
    words = f"Over the top 2 % of codes {least} rises least, by {rise[least]:.2g} % of its light."
    return HEADROOM.judged(rise[least], words, series=(panel,), table=table)


def _dark(measurements: Measurements) -> str:
    return black_or_none(measurements)[1]


def _shares(measurements: Measurements) -> tuple[dict[str, tuple[Floats, Floats]], str]:
    """Return each ramp's levels (k,) and luminance above black as a share of the last level's, (k,)."""
    dark, _ = black_or_none(measurements)
    found = {}
    for name, ramp in {**channel_ramps(measurements), "grey": grey_ramp(measurements)}.items():
        if len(ramp) < _FEWEST:
            continue
        light = ramp.XYZ[:, 1] - dark[1]
        if light[-1] <= 0:
            return {}, f"The channel {name} gives no light at its highest level."
        found[name] = (ramp.levels, np.asarray(light / light[-1]))
    return found, "" if found else "No ramp has four levels or more."
