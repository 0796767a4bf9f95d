"""Whether codes reach the panel's own channels: white segments, and colours converted on the way.

A white segment or subpixel makes white brighter than red, green and blue together; saturated colours then lack light
beside it. A compositor or a monitor that converts colours gives other primaries than the panel's. Where it has to leave
out what the panel cannot show, a channel added to a grey has another colour than that channel alone; where it can show
all, the primaries become those of the space that it converts from.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from devices.colour.adaptation import bradford_matrix
from devices.colour.spaces import rgb_to_xyz_matrix
from devices.colour.srgb_encoding import D65_XY, SRGB_PRIMARIES_XY
from devices.diagnostics.content import dynamic_contrast
from devices.diagnostics.diagnosis import Cell, Check, Colour, Diagnosis, PlotAxes, Readout, Trace, numbers
from devices.diagnostics.readings import CHANNELS, cable_colours, means, primaries, uv, xy
from devices.diagnostics.signal_path import NOT_MEASURED
from devices.errors import DeviceError
from devices.readings import Measurements
from documents.arrays import Floats

Code = tuple[int, int, int]
_FULL = 255
# Codes of 8 bits.
_MIXTURES: Mapping[str, Code] = MappingProxyType(
    {
        "red": (255, 0, 0),
        "green": (0, 255, 0),
        "blue": (0, 0, 255),
        "yellow": (255, 255, 0),
        "cyan": (0, 255, 255),
        "magenta": (255, 0, 255),
        "white": (255, 255, 255),
    }
)
_NAMES: Mapping[Code, str] = MappingProxyType({code: name for name, code in _MIXTURES.items()} | {(0, 0, 0): "black"})

WHITE = Check(
    "white_segment",
    "White against its primaries",
    5.0,
    "% difference of white from red + green + blue",
    "this project: channels of panels without a white segment interact by up to 4 %; segments add 20 % and more",
)


def white_segment(measurements: Measurements) -> Diagnosis:
    """Judge by how many % white above black is brighter than the sum of red, green and blue above black.

    By patches in the middle of a black screen, where there are any, which no limit of the picture's level dims.
    """
    light = _mixtures(measurements)
    if light is None:
        return WHITE.unjudged(NOT_MEASURED)
    rows: list[tuple[Cell, ...]] = []
    excess: dict[str, float] = {}
    for name, code in _MIXTURES.items():
        if name not in light:
            continue
        together = sum(light[channel] for channel, lit in zip(CHANNELS, code, strict=True) if lit)
        if name in CHANNELS:
            rows.append((name, light[name], "", ""))
            continue
        excess[name] = 100 * (light[name] / together - 1)
        rows.append((name, light[name], together, f"{excess[name]:+.2f}"))
    value = excess["white"]
    words = f"White has {abs(value):.2g} % {'more' if value >= 0 else 'less'} light than red, green and blue together."
    if value > (WHITE.limit or 0):
        pairs = [abs(excess[name]) for name in ("yellow", "cyan", "magenta") if name in excess]
        whose = "a white one" if not pairs or max(pairs) <= (WHITE.limit or 0) else "one for white and other mixtures"
        words += (
            f" Beside the primaries, a segment or subpixel lights up: {whose}. Saturated colours have "
            f"{100 * (1 - 1 / (1 + value / 100)):.2g} % less light than they should have beside this white. Switch it "
            "off (BrilliantColor, a bright or vivid picture mode); if you cannot, trust a fitted model by its held-out "
            "error alone."
        )
    elif value < -(WHITE.limit or 0):
        words += " See Channel independence and Average picture level."
    names = list(excess)
    drawn = [excess[name] for name in names]
    panel = PlotAxes(
        "",
        "patch",
        "light, from the sum of its primaries, %",
        (Trace("", numbers(range(1, len(names) + 1)), numbers(drawn), "ink"),),
        (WHITE.limit or 0.0,),
        x_names=tuple(names),
    )
    table = Readout(("patch", "above black, cd/m²", "sum of its primaries", "from it, %"), tuple(rows))
    return WHITE.judged(value, words, series=(panel,), table=table)


def _mixtures(measurements: Measurements) -> dict[str, float] | None:
    """Return luminances above black by patch, None where white or a primary was not read or gives no light."""
    for readings in (cable_colours(measurements), measurements):
        light = {_called(code): float(XYZ[1]) for code, XYZ in _means_by_code(readings).items()}
        if {*CHANNELS, "white"} <= set(light):
            break
    if not {*CHANNELS, "white"} <= set(light):
        return None
    dark = light.get("black", 0.0)
    above = {name: light[name] - dark for name in _MIXTURES if name in light}
    return above if min(above.values()) > 0 else None


def _called(code: Code) -> str:
    return _NAMES.get(code, "")


def _means_by_code(measurements: Measurements) -> dict[Code, Floats]:
    """Return the mean XYZ, (3,), of each plain reading's colour, by codes of 8 bits."""
    return {_code_of(codes): light for codes, light in zip(*means(measurements), strict=True)}


def _code_of(codes: Floats) -> Code:
    red, green, blue = (round(_FULL * float(code)) for code in codes)
    return red, green, blue


ADDED = Check(
    "added_channels",
    "Channels added to grey",
    0.04,
    "Δu′v′",
    "this project: a conversion for a panel with two thirds of sRGB's gamut moves red by 0.05; channels that interact "
    "mildly move by up to 0.015",
)
_COLOURS: Mapping[str, Colour] = MappingProxyType({"red": "red", "green": "green", "blue": "blue"})


def added_channels(measurements: Measurements) -> Diagnosis:
    """Judge the largest Δu′v′ between what a channel adds to a grey and that channel alone, above black.

    Not judged where light depends on the picture or white has a segment of its own: both change what a channel adds.
    """
    light = _means_by_code(cable_colours(measurements))
    changes: dict[str, float] = {}
    rows: list[tuple[Cell, ...]] = []
    lines: list[Trace] = []
    for index, name in enumerate(CHANNELS):
        alone = light.get(_code(index, _FULL, 0))
        raised = [code for code in light if code[index] > code[index - 1] == code[index - 2] > 0]
        if alone is None or (0, 0, 0) not in light or not raised:
            return ADDED.unjudged(NOT_MEASURED)
        code = max(raised, key=lambda code: code[index] - code[index - 1])
        grey = light.get((code[index - 1],) * 3)
        if grey is None:
            return ADDED.unjudged(NOT_MEASURED)
        own, added = alone - light[0, 0, 0], light[code] - grey
        corners = uv([own, added])
        changes[name] = float(np.linalg.norm(corners[1] - corners[0]))
        rows.append((name, *(f"{part:.4f}" for part in corners.ravel()), changes[name]))
        drawn = xy(np.array([own, added]))
        lines.append(Trace(name, numbers(drawn[:1, 0]), numbers(drawn[:1, 1]), _COLOURS[name], "points"))
        lines.append(Trace("", numbers(drawn[:, 0]), numbers(drawn[:, 1]), _COLOURS[name], "line"))
    if not np.all(np.isfinite(list(changes.values()))):
        return ADDED.unjudged("A channel's light has no chromaticity.")
    for other in (dynamic_contrast(measurements), white_segment(measurements)):
        if other.passed is False:
            return ADDED.unjudged(f"{other.title} comes first: it changes what a channel adds.")
    worst = max(changes, key=lambda name: changes[name])
    words = f"Added to a grey, {worst} differs most from {worst} alone: by {changes[worst]:.2g} in u′v′."
    if changes[worst] > (ADDED.limit or 0):
        words += (
            " Codes are converted on their way, as by a compositor with the monitor's profile, and what the panel "
            "cannot show is cut off; or the channels interact strongly (see Channel independence). Switch colour "
            "management off for this window or in the desktop's settings, and measure again."
        )
    table = Readout(("channel", "u′ alone", "v′ alone", "u′ added", "v′ added", "Δu′v′"), tuple(rows))
    panel = PlotAxes("alone, and as added to grey (line)", "x", "y", tuple(lines), equal=True)
    return ADDED.judged(changes[worst], words, series=(panel,), table=table)


def _code(channel: int, code: int, others: int) -> Code:
    red, green, blue = (code if index == channel else others for index in range(3))
    return red, green, blue


STANDARD = Check(
    "standard_primaries",
    "Primaries of a standard",
    None,
    "Δu′v′ of the primary that is farthest from its standard's",
    "No limit: codes that a monitor converts by its own mode are as good as others, and readings cannot tell who "
    "converts them; what a wrong conversion does is judged by Channel constancy and Channels added to grey",
)
# Panels made for a standard differ from it by about 0.01, and seldom by less in all three primaries; a conversion
# meets it.
_CONVERTED = 0.004
_SPACES: Mapping[str, tuple[tuple[float, float], tuple[float, float], tuple[float, float]]] = MappingProxyType(
    {
        "sRGB": SRGB_PRIMARIES_XY,
        "Display P3": ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060)),
        "Adobe RGB (1998)": ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06)),
        "BT.2020": ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046)),
    }
)


def standard_primaries(measurements: Measurements) -> Diagnosis:
    """Say how far the primaries lie from those of the nearest standard space, adapted to the display's white."""
    matrix = _primaries(measurements)
    if matrix is None:
        return STANDARD.unjudged(NOT_MEASURED)
    white = matrix.sum(axis=1)
    corners = uv(matrix.T)
    if white[1] <= 0 or not np.all(np.isfinite(corners)):
        return STANDARD.unjudged("A channel's light has no chromaticity.")
    distances: dict[str, float] = {}
    of: dict[str, Floats] = {}
    for name, space in _SPACES.items():
        standard = rgb_to_xyz_matrix(*space, D65_XY)
        try:
            of[name] = bradford_matrix(standard.sum(axis=1), white / white[1]) @ standard
        except DeviceError:
            return STANDARD.unjudged("What red, green and blue add up to is no white: it is too saturated.")
        distances[name] = float(np.linalg.norm(uv(of[name].T) - corners, axis=1).max())
    nearest = min(distances, key=lambda name: distances[name])
    value = distances[nearest]
    words = f"The primaries are nearest those of {nearest}: the farthest differs by {value:.2g} in u′v′."
    if value < _CONVERTED:
        words += (
            f" Codes are converted from {nearest} on their way to the panel: by a compositor, or by the monitor's own "
            f"{nearest} mode. In the monitor it does no harm as long as the mode stays; in the compositor, switch it "
            "off for this window or in the desktop's settings, and measure again."
        )
    drawn, standard = xy(matrix.T), xy(of[nearest].T)
    panel = PlotAxes(
        "CIE 1931",
        "x",
        "y",
        (
            Trace(nearest, numbers(standard[:, 0]), numbers(standard[:, 1]), "soft", "outline"),
            Trace("primaries", numbers(drawn[:, 0]), numbers(drawn[:, 1]), "accent", "points"),
        ),
        equal=True,
    )
    table = Readout(("space, adapted to this white", "largest Δu′v′"), tuple(distances.items()))
    return STANDARD.described(value, words, series=(panel,), table=table)


def _primaries(measurements: Measurements) -> Floats | None:
    """Return the primaries' XYZ above black as columns (3, 3), of the set ``cable`` or else of plain readings."""
    of_cable = primaries(cable_colours(measurements))[0]
    return primaries(measurements)[0] if of_cable is None else of_cable
