"""Crosstalk: how much of one eye's picture the other eye sees, from readings through each lens.

A reading named ``black@other=red`` through the left lens had the left picture black and the right one red; a plain
reading through one lens had the other picture black. The matrices are those of `devices.characterise.crosstalk_fit`.
"""

from __future__ import annotations

import numpy as np

from devices.characterise.crosstalk_fit import BLACK, CrosstalkFit, CrosstalkReading, fit_crosstalk
from devices.diagnostics.diagnosis import Cell, Check, Colour, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.tags import patch_name, tag, tagged
from devices.display.display_file import Eye
from devices.errors import DeviceError
from devices.measurements import Measurements

CHECK = Check(
    "crosstalk",
    "Crosstalk",
    5.0,
    "% of luminance",
    "Seuntiëns et al. [Seuntiens2005]: perceived distortion rises with leaks, and 5 % is the least that they tried; "
    "what was measured can be cancelled wherever the picture is not too dark",
)
_EYES: tuple[Eye, Eye] = ("left", "right")
_TINTS: tuple[tuple[Eye, Colour], ...] = (("left", "accent"), ("right", "ink"))


def crosstalk_readings(measurements: Measurements) -> tuple[CrosstalkReading, ...]:
    """Return what `fit_crosstalk` needs of ``measurements``; empty where no reading is named ``...@other=...``.

    Raises
    ------
    DeviceError
        If such a reading was through no single lens, or a name says black of another code, or black's code another
        colour.
    """
    if not tagged(measurements, "other"):
        return ()
    colours = {said.parts[0] for _, said in tagged(measurements, "other")}
    found = []
    for row, name in enumerate(measurements.name):
        said, eye = tag(name), measurements.eye[row]
        own = (said.base if said else patch_name(name)).strip().lower()
        other = said.parts[0] if said and said.kind == "other" else BLACK
        if said is None and (eye == "both" or own not in colours | {BLACK}):
            continue
        if said is not None and said.kind != "other":
            continue
        if eye == "both":
            raise DeviceError(f"the reading '{name}' tells of crosstalk, but not through which lens: eye is 'both'")
        if (own == BLACK) != bool(np.all(measurements.codes[row] == 0)):
            raise DeviceError(f"the reading '{name}' has the codes {measurements.codes[row].tolist()}: black is code 0")
        x, y, z = (float(value) for value in measurements.XYZ[row])
        left, right = (own, other) if eye == "left" else (other, own)
        found.append(CrosstalkReading(eye, left, right, (x, y, z)))
    return tuple(found)


def crosstalk(measurements: Measurements) -> Diagnosis:
    """Judge the largest share of luminance that leaks into an eye's black, in % of its own picture in that colour.

    White is judged where it was read, otherwise every colour that was. ``output`` is the `crosstalk:` of a display
    file.
    """
    try:
        readings = crosstalk_readings(measurements)
        if not readings:
            return CHECK.unjudged(
                "Read each colour through each lens, then black with that colour in the other eye's picture, and name "
                "that reading black@other=white."
            )
        fit = fit_crosstalk(readings)
    except DeviceError as error:
        return CHECK.unjudged(f"The crosstalk could not be fitted: {error.findings[0].message}.")
    leaks = _leaks(readings)
    judged = {key: leak for key, leak in leaks.items() if key[1] == "white"} or leaks
    if not judged:
        return CHECK.unjudged("Read each colour that leaks through the lens of its own eye too.")
    eye, colour = max(judged, key=lambda key: judged[key])
    value = max(0.0, judged[eye, colour])
    rows: list[tuple[Cell, ...]] = []
    for key, leak in leaks.items():
        one = fit.left if key[0] == "left" else fit.right
        rows.append(
            (key[0], key[1], f"{round(leak, 3) + 0.0:.3f}", one.kind, float(one.readings), one.residual_max_cd_m2)
        )
    names = list(dict.fromkeys(name for _, name in leaks))
    lines = tuple(
        Line(
            f"{side} eye",
            numbers(names.index(name) + 1 for one, name in leaks if one == side),
            numbers(leak for (one, _), leak in leaks.items() if one == side),
            tint,
        )
        for side, tint in _TINTS
    )
    panel = Panel("", "colour in the other eye's picture", "leak, % of luminance", lines, (5.0,), x_names=tuple(names))
    table = Table(("into the eye", "colour", "leak, %", "matrix", "readings", "largest residual, cd/m²"), tuple(rows))
    words = f"Most leaks into the {eye} eye: {round(value, 4):.2g} % of {colour}'s luminance."
    return CHECK.judged(value, words, series=(panel,), table=table, output=crosstalk_yaml(fit))


def crosstalk_yaml(fit: CrosstalkFit) -> str:
    """Return the `crosstalk:` part of a display file."""
    lines = ["crosstalk:"]
    for eye, matrix in (("left", fit.crosstalk.left), ("right", fit.crosstalk.right)):
        lines.append(f"  {eye}:")
        # Adding 0 makes of -0 what is left when next to nothing leaks: 0.
        lines += [f"    - [{', '.join(f'{value:.6f}' for value in np.round(row, 6) + 0.0)}]" for row in matrix]
    kinds = f"left {fit.left.kind}, right {fit.right.kind}"
    lines.append(f"  source: least squares over {fit.left.readings} and {fit.right.readings} readings ({kinds})")
    return "\n".join(lines) + "\n"


def _leaks(readings: tuple[CrosstalkReading, ...]) -> dict[tuple[Eye, str], float]:
    """Return for each eye and colour the luminance that leaks into black, in % of the eye's own light in it."""
    means: dict[tuple[Eye, str, str], float] = {}
    groups: dict[tuple[Eye, str, str], list[float]] = {}
    for reading in readings:
        groups.setdefault((reading.eye, reading.own, reading.other), []).append(reading.XYZ_cd_m2[1])
    means = {key: float(np.mean(values)) for key, values in groups.items()}
    leaks = {}
    for eye in _EYES:
        dark = means.get((eye, BLACK, BLACK))
        for (seen_by, own, other), leaked in means.items():
            alone = means.get((eye, other, BLACK))
            if seen_by == eye and own == BLACK and other != BLACK and dark is not None and alone and alone > dark:
                leaks[eye, other] = 100 * (leaked - dark) / (alone - dark)
    return leaks
