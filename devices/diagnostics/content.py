"""How light depends on what else is in the picture: dynamic contrast, black, and the average picture level.

By patches that fill a part of the picture, on surrounds of other codes (`Measurements.area`, `Measurements.surround`).
Stray light, in the instrument and in the panel, adds the same light to every patch on a surround; a backlight that
follows the picture multiplies every patch's light: so a line through three patches tells one from the other.
"""

from __future__ import annotations

import numpy as np

from devices.colour.spaces import xyz_to_lab
from devices.diagnostics.diagnosis import Cell, Check, Colour, Diagnosis, PlotAxes, Readout, Trace, numbers
from devices.diagnostics.readings import tag, tagged
from devices.diagnostics.signal_path import NOT_MEASURED, pooled_deviation
from devices.readings import Measurements
from documents.arrays import Floats

Key = tuple[float, ...]
_DIGITS = 3
_COLOURS: tuple[Colour, ...] = ("ink", "accent", "blue", "red", "green", "grey")

DYNAMIC = Check(
    "dynamic_contrast",
    "Dynamic contrast",
    2.0,
    "% of a patch's own light",
    "this project: 2 % is ΔE00 0.4 at white; stray light, which adds to a patch and does not multiply it, is left out",
)


def dynamic_contrast(measurements: Measurements) -> Diagnosis:
    """Judge by what share a patch's own light changes with its surround: the slope of its light over that on black."""
    patches = _on_surrounds(measurements)
    found: dict[str, tuple[float, float]] = {}
    lines, rows = [], []
    for around in dict.fromkeys(name for lights in patches.values() for name in lights):
        both = [(lights["black"], lights[around]) for lights in patches.values() if {"black", around} <= set(lights)]
        if around == "black" or len(both) < 3:
            continue
        on_black, on_this = (np.array([light.mean() for light in side]) for side in zip(*both, strict=True))
        if np.any(on_black <= 0):
            continue
        slope, stray = _line(on_black, on_this)
        found[around] = slope, stray
        change = 100 * (on_this / on_black - 1)
        colour = _COLOURS[len(found) % len(_COLOURS)]
        lines.append(Trace(f"on {around}", numbers(on_black), numbers(change), colour, "points"))
        rows.append((around, f"{100 * (slope - 1):+.2f}", stray))
    if not found:
        return DYNAMIC.unjudged(NOT_MEASURED)
    worst = max(found, key=lambda name: abs(found[name][0] - 1))
    value = 100 * (found[worst][0] - 1)
    words = (
        f"On {worst}, a patch's own light changes by {value:+.2g} % of that on black. Stray light, which adds "
        f"{max(stray for _, stray in found.values()):.2g} cd/m², is left out."
    )
    if abs(value) > (DYNAMIC.limit or 0):
        words += (
            " A backlight follows the picture: switch off dynamic contrast, local dimming and energy saving in the "
            "monitor."
            if value > 0
            else " Light is limited by the picture's mean level (see there), or a backlight dims bright pictures."
        )
    panel = PlotAxes("", "luminance on black, cd/m²", "change from that on black, %", tuple(lines))
    table = Readout(("surround", "own light, %", "stray light, cd/m²"), tuple(rows))
    return DYNAMIC.judged(abs(value), words, series=(panel,), table=table)


def _line(x: Floats, y: Floats) -> tuple[float, float]:
    """Return slope and intercept of y over x by least squares of errors relative to x."""
    slope, level = np.linalg.lstsq(np.column_stack([np.ones_like(x), 1 / x]), y / x, rcond=None)[0]
    return float(slope), float(level)


def _on_surrounds(measurements: Measurements) -> dict[Key, dict[str, Floats]]:
    """Return luminances, shape (k,), of the same code and area by surround, above black."""
    rows: dict[Key, dict[str, list[float]]] = {}
    for row, name in enumerate(measurements.name):
        own = tag(name)
        if own is not None and own.kind == "surround":
            around = own.parts[0]
        elif measurements.filled[row] < 1 and (own is None or own.kind == "cable"):
            around = _called(measurements.around[row])
        else:
            continue
        codes, area = measurements.codes[row], float(measurements.filled[row])
        if codes.max() > 0:
            key = (*np.round(codes, _DIGITS).tolist(), round(area, _DIGITS))
            rows.setdefault(key, {}).setdefault(around, []).append(float(measurements.XYZ[row, 1]))
    return {key: {name: np.array(light) for name, light in lights.items()} for key, lights in rows.items()}


def _called(codes: Floats) -> str:
    if np.ptp(codes) == 0:
        return {0.0: "black", 1.0: "white"}.get(
            float(codes[0]), "grey" if abs(codes[0] - 0.5) < 0.01 else f"{codes[0]:.2f}"
        )
    return " ".join(f"{255 * code:.0f}" for code in codes)


BLACK = Check(
    "black_with_picture",
    "Black beside and after other pictures",
    0.3,
    "of lightness L*",
    "this project: 0.3 is 0.033 % of white's luminance; a backlight that goes out takes 0.9 off a black of 1000:1",
)
_SURE = 4.0


def black_with_picture(measurements: Measurements) -> Diagnosis:
    """Judge the largest difference in L*, against white, between black full-screen, beside grey, after white and black.

    Stray light of the grey is taken off, as far as patches on white show how much there is.
    """
    blacks, white = _blacks(measurements)
    if white is None or len(blacks) < 2:
        return BLACK.unjudged(NOT_MEASURED)
    if white <= 0:
        return BLACK.unjudged("White gives no light.")
    light = {name: float(readings.mean()) for name, readings in blacks.items()}
    if {"beside grey", "full-screen"} <= set(light):
        more = light["beside grey"] - light["full-screen"]
        light["beside grey"] -= min(max(more, 0.0), _stray_light(measurements, white))
    deviation = pooled_deviation(list(blacks.values()))
    lightness = {name: _lightness(value, white) for name, value in light.items()}
    lowest, highest = (choose(lightness, key=lambda name: lightness[name]) for choose in (min, max))
    value = lightness[highest] - lightness[lowest]
    count = min(len(readings) for readings in blacks.values())
    error = _lightness(_SURE * deviation * float(np.sqrt(2 / count)), white) if np.isfinite(deviation) else np.inf
    if error > (BLACK.limit or 0):
        return BLACK.unjudged(
            f"Black's readings differ too much from repeat to repeat to judge it to {BLACK.limit:g} of L*: let the "
            "instrument measure longer."
        )
    words = f"Black is {value:.2g} of L* lighter {highest} than {lowest}."
    if value > (BLACK.limit or 0):
        words += " A backlight follows the picture: switch off dynamic contrast and local dimming in the monitor."
    table = Readout(
        ("black", "luminance, cd/m²", "L*", "readings"),
        tuple((name, light[name], lightness[name], float(len(blacks[name]))) for name in light),
    )
    names = tuple(light)
    panel = PlotAxes(
        "",
        "black",
        "luminance, cd/m²",
        (Trace("", numbers(range(1, len(names) + 1)), numbers(light.values()), "ink"),),
        x_names=names,
    )
    return BLACK.judged(value, words, series=(panel,), table=table)


def _lightness(luminance: float, white: float) -> float:
    """Return L* of a neutral with a luminance, at least 0, against white's."""
    neutral = np.array([1.0, 1.0, 1.0])
    return float(xyz_to_lab(max(luminance, 0.0) / white * neutral, neutral)[0])


def _blacks(measurements: Measurements) -> tuple[dict[str, Floats], float | None]:
    """Return black's luminances, shape (k,), by how it was shown, and white's, None if it was not read."""
    found: dict[str, list[float]] = {}
    whites: list[float] = []
    for row, name in enumerate(measurements.name):
        own = tag(name)
        if own is None or own.kind != "cable":
            continue
        codes, luminance, how = measurements.codes[row], float(measurements.XYZ[row, 1]), own.parts[0]
        shown = how.replace("after-", "after ") if how.startswith("after-") else "full-screen"
        if measurements.filled[row] < 1 and measurements.around[row].max() > 0:
            shown = "beside grey"
        if codes.max() == 0:
            found.setdefault(shown, []).append(luminance)
        elif codes.min() == 1 and not how:
            whites.append(luminance)
    return {name: np.array(light) for name, light in found.items()}, float(np.mean(whites)) if whites else None


def _stray_light(measurements: Measurements, white: float) -> float:
    """Return the stray light that a black beside grey may hold, in cd/m²; 0 where patches on white do not show it."""
    patches = _on_surrounds(measurements)
    both = [
        (light["black"].mean(), light["white"].mean(), 1 - key[-1])
        for key, light in patches.items()
        if "white" in light and "black" in light
    ]
    beside = [
        (1 - measurements.filled[row]) * float(light["black"].mean())
        for row in range(len(measurements))
        for key, light in patches.items()
        if measurements.codes[row].max() == 0
        and measurements.filled[row] < 1
        and "black" in light
        and np.allclose(key[:3], measurements.around[row], atol=10.0**-_DIGITS)
    ]
    if len(both) < 3 or min(both)[0] <= 0 or not beside:
        return 0.0
    on_black, on_white, around = np.array(both).T
    return max(_line(on_black, on_white)[1], 0.0) / float(white * np.mean(around)) * float(np.mean(beside))


LEVEL = Check(
    "picture_level",
    "Average picture level",
    2.0,
    "% of luminance lost by white that fills the screen",
    "this project: 2 % is ΔE00 0.4 at white; stray light makes large patches brighter, never dimmer",
)
_FEWEST_AREAS = 3


def picture_level(measurements: Measurements) -> Diagnosis:
    """Judge how much dimmer white is when it fills the screen than as the patch, on black, that is brightest."""
    rows: dict[float, list[float]] = {}
    of_cable = len(tagged(measurements, "cable")) > 0
    for row, name in enumerate(measurements.name):
        own, area = tag(name), float(measurements.filled[row])
        counts = own.kind == "cable" if own is not None else not of_cable
        on_black = area == 1 or measurements.around[row].max() == 0
        if measurements.codes[row].min() == 1 and on_black and counts:
            rows.setdefault(round(area, 4), []).append(float(measurements.XYZ[row, 1]))
    light = {area: float(np.mean(rows[area])) for area in sorted(rows)}
    if len(light) < _FEWEST_AREAS or 1.0 not in light or min(light.values()) <= 0:
        return LEVEL.unjudged(NOT_MEASURED)
    brightest = max(light.values())
    value = 100 * (1 - light[1.0] / brightest)
    first = next(iter(light.values()))
    kept = [
        area for area in light if all(abs(light[a] / first - 1) <= (LEVEL.limit or 0) / 100 for a in light if a <= area)
    ]
    words = (
        f"White keeps its luminance within {LEVEL.limit:g} % up to {100 * max(kept):.3g} % of the screen, and is "
        f"{value:.2g} % dimmer on all of it than as its brightest patch."
    )
    if value > (LEVEL.limit or 0):
        words += (
            " What a colour gives depends on the picture's mean level: lower the monitor's brightness until the limit "
            "is out of reach, or switch the limiter off; else measure with an area and a surround whose mean level is "
            "that of the session's pictures."
        )
    areas = np.array(list(light))
    panel = PlotAxes(
        "",
        "area of white, % of the screen",
        "luminance, cd/m²",
        (Trace("", numbers(100 * areas), numbers(light.values()), "ink", "line"),),
        (brightest * (1 - (LEVEL.limit or 0) / 100),),
    )
    cells: tuple[tuple[Cell, ...], ...] = tuple(
        (100 * area, y, f"{100 * (y / brightest - 1):+.2f}") for area, y in light.items()
    )
    table = Readout(("area, %", "luminance, cd/m²", "from the brightest, %"), cells)
    return LEVEL.judged(value, words, series=(panel,), table=table)
