"""Two families of checks: the gamut of the primaries, and how well a display model describes the readings.

The gamut is the triangle of the primaries, drawn in xy and u′v′ (thesis Figures 3.1, 3.3 and 3.4), its area that in
u′v′. The model is judged by real
against estimated codes (thesis Figure 3.17) and by read against predicted XYZ. On readings that the model was fitted to
both flatter it; `cyclopean display verify` shows new colours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.colour.srgb_encoding import SRGB_PRIMARIES_XY
from devices.diagnostics.chromaticity_diagrams import diagrams, srgb_triangle, uv_from_xy
from devices.diagnostics.chromaticity_diagrams import triangle as gamut_lines
from devices.diagnostics.diagnosis import Cell, Check, Colour, Diagnosis, PlotAxes, Readout, Trace, numbers
from devices.diagnostics.readings import CHANNELS, FLOOR_SHARE, black_or_none, means, primaries, uv, xy
from devices.display.model import DisplayModel
from devices.readings import Measurements
from documents.arrays import Floats

AREA = Check(
    "gamut",
    "Gamut",
    None,
    "% of sRGB's area in u′v′",
    "No limit: what is enough depends on the stimuli, and every trial records what it clips",
)
TOGETHER = Check(
    "gamuts",
    "Gamuts of all readings",
    None,
    "% of the largest area",
    "No limit: the changes from the first set to each other one are judged by themselves",
)
CHANGE = Check(
    "gamut_change",
    "Change of gamut",
    10.0,
    "% of area in u′v′",
    "this project: the thesis finds by eye that glasses and settings hardly change the gamut (Figures 3.3 and 3.4); "
    "10 % of area is 5 % of each side",
)
CODES = Check(
    "estimated_codes",
    "Real against estimated codes",
    0.995,
    "R², the least channel's",
    "thesis Table 3.6, whose least R² is 0.9976, less 0.002 for the noise of a reading; channels with less than 2 % of "
    "their full light, really and by the estimate, are drawn and not judged, because readings cannot resolve them",
    at_least=True,
)
DIFFERENCE = Check(
    "model_difference",
    "Read against predicted colours",
    0.65,
    "mean ΔE00",
    "this project: 0.5 for a model of a well-behaved panel, and 0.15 for readings with 0.2 % of noise",
)
_FEWEST = 8
_COLOURS: tuple[Colour, ...] = ("red", "green", "blue")


@dataclass(frozen=True, slots=True, eq=False)
class Gamut:
    """Corners in u′v′ and xy, red, green and blue, shape (3, 2) each, and the white of all at full drive, (2,)."""

    corners_uv: Floats
    corners_xy: Floats
    white_uv: Floats
    white_xy: Floats
    white_cd_m2: float

    @property
    def area(self) -> float:
        """The triangle's area in u′v′."""
        return _area(self.corners_uv)


def gamut_of(measurements: Measurements) -> tuple[Gamut | None, str]:
    """Return the gamut of light above black, or None and why it is not known."""
    matrix, why = primaries(measurements)
    if matrix is None:
        return None, why
    corners = uv(matrix.T)
    if not np.all(np.isfinite(corners)) or _area(corners) < 1e-6:
        return None, "the primaries have no triangle: a channel gives no light, or all are alike"
    white = matrix.sum(axis=1) + black_or_none(measurements)[0]
    return Gamut(corners, xy(matrix.T), uv(white), xy(white), float(white[1])), ""


def gamut(measurements: Measurements) -> Diagnosis:
    """Return the gamut's area in % of that of sRGB; nothing is judged by it."""
    triangle, why = gamut_of(measurements)
    if triangle is None:
        return AREA.unjudged(f"The gamut is not known: {why}.")
    value = 100 * triangle.area / _area(uv_from_xy(np.array(SRGB_PRIMARIES_XY)))
    words = f"The triangle's area in u′v′ is {triangle.area:.4g}, {value:.3g} % of that of sRGB."
    lines = (srgb_triangle(), *gamut_lines("primaries and white", triangle.corners_xy, triangle.white_xy))
    return AREA.described(value, words, series=diagrams(lines), table=_rows(triangle))


def gamuts(sets: Sequence[tuple[str, Measurements]]) -> Diagnosis:
    """Return the gamuts of several sets, such as both eyes' or those of several modes, in one diagram; none is judged.

    The value is the smallest area in % of the largest; sets without primaries are left out.
    """
    known = [(name, found) for name, found in ((name, gamut_of(own)[0]) for name, own in sets) if found is not None]
    if len(known) < 2:
        return TOGETHER.unjudged("Fewer than two sets of readings have primaries.")
    areas = [found.area for _, found in known]
    words = f"The smallest of {len(known)} gamuts has {100 * min(areas) / max(areas):.3g} % of the largest one's area."
    lines = [
        line
        for number, (name, found) in enumerate(known)
        for line in gamut_lines(name, found.corners_xy, found.white_xy, number)
    ]
    table = Readout(
        ("", "area in u′v′", "white x", "white y", "white, cd/m²"),
        tuple((name, each.area, *(f"{part:.4f}" for part in each.white_xy), each.white_cd_m2) for name, each in known),
    )
    return TOGETHER.described(100 * min(areas) / max(areas), words, series=diagrams(lines), table=table)


def gamut_change(measurements: Measurements, other: Measurements, label: str, other_label: str) -> Diagnosis:
    """Judge how much the area of ``measurements`` differs from that of ``other``, in % of the latter."""
    triangle, why = gamut_of(measurements)
    before, why_not = gamut_of(other)
    if triangle is None or before is None:
        return CHANGE.unjudged(f"A gamut is not known: {why or why_not}.")
    value = 100 * (triangle.area / before.area - 1)
    shift = triangle.white_uv - before.white_uv
    lines = (
        *gamut_lines(label, triangle.corners_xy, triangle.white_xy),
        *gamut_lines(other_label, before.corners_xy, before.white_xy, 1),
    )
    words = (
        f"The area is {abs(value):.2g} % {'larger' if value > 0 else 'smaller'} than that of {other_label}; white "
        f"moves by {np.linalg.norm(shift):.2g} in u′v′ ({shift[0]:+.4f}, {shift[1]:+.4f})."
    )
    rows: list[tuple[Cell, ...]] = []
    for name, each in ((other_label, before), (label, triangle)):
        rows.append((name, each.area, *(f"{part:.4f}" for part in each.white_xy), each.white_cd_m2))
    table = Readout(("", "area in u′v′", "white x", "white y", "white, cd/m²"), tuple(rows))
    return CHANGE.judged(abs(value), words, series=diagrams(lines), table=table)


def _rows(gamut: Gamut) -> Readout:
    rows = tuple(
        (name, *(f"{value:.4f}" for value in (*plane, *even)))
        for name, plane, even in (
            *zip(("red", "green", "blue"), gamut.corners_xy, gamut.corners_uv, strict=True),
            ("white", gamut.white_xy, gamut.white_uv),
        )
    )
    return Readout(("", "x", "y", "u′", "v′"), rows)


def _area(corners: Floats) -> float:
    first, second = corners[1] - corners[0], corners[2] - corners[0]
    return abs(float(first[0] * second[1] - first[1] * second[0])) / 2


def estimated_codes(measurements: Measurements, model: DisplayModel) -> Diagnosis:
    """Judge the least R² over channels between codes as sent and as `model.code` estimates them from readings.

    A channel that gives less than 2 % of its full light by either code is left out of it: beside brighter channels, and
    below a display's cut-off, its code is a matter of noise.
    """
    codes, light = means(measurements)
    if len(codes) < _FEWEST:
        return CODES.unjudged("Fewer than eight colours were read.")
    estimated = model.code(light)
    panels, rows, shares = [], [], []
    for channel, name in enumerate(CHANNELS):
        real, estimate = codes[:, channel], estimated[:, channel]
        lit = np.maximum(model.curves[channel].linear(real), model.curves[channel].linear(estimate)) >= FLOOR_SHARE
        spread = float(((real[lit] - real[lit].mean()) ** 2).sum()) if lit.any() else 0.0
        if spread == 0:
            return CODES.unjudged(f"All readings in which {name} gives 2 % of its light have one code of it.")
        shares.append(1 - float(((real - estimate)[lit] ** 2).sum()) / spread)
        error = 255 * (estimate - real)[lit]
        rows.append((name, f"{shares[-1]:.5f}", float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())))
        lines = (
            Trace("", (0.0, 255.0), (0.0, 255.0), "soft", "line"),
            Trace(name, numbers(255 * real), numbers(255 * estimate), _COLOURS[channel], "points"),
        )
        panels.append(PlotAxes(name, "real code (0–255)", "estimated code (0–255)", lines, equal=True))
    words = f"Estimated codes explain {100 * min(shares):.4g} % of the real ones' variance in the worst channel."
    if min(shares) < 0:
        words = (
            "In the worst channel the estimated codes are farther from the real ones than their mean is, so that R² is "
            "below 0: the model is not this display's, or the readings are of another mode or range of codes."
        )
    table = Readout(("channel", "R²", "root mean square, codes of 8 bits", "largest"), tuple(rows))
    return CODES.judged(min(shares), words, series=tuple(panels), table=table)


def model_difference(measurements: Measurements, model: DisplayModel) -> Diagnosis:
    """Judge the mean ΔE00 between readings and `model.xyz`, against the model's white."""
    codes, light = means(measurements)
    if len(codes) < _FEWEST:
        return DIFFERENCE.unjudged("Fewer than eight colours were read.")
    white = model.white_XYZ_cd_m2
    difference = delta_e_2000(xyz_to_lab(light, white), xyz_to_lab(model.xyz(codes), white))
    lightness = xyz_to_lab(light, white)[:, 0]
    worst = np.argsort(-difference)[:8]
    table = Readout(
        ("code (0–255)", "ΔE00"),
        tuple((" ".join(f"{255 * part:.0f}" for part in codes[i]), float(difference[i])) for i in worst),
    )
    panel = PlotAxes(
        "",
        "lightness L* of the reading",
        "ΔE00",
        (Trace("", numbers(lightness), numbers(difference), "accent"),),
        (1.0,),
    )
    words = (
        f"Over {len(codes)} colours ΔE00 is {difference.mean():.2g} on average, {np.percentile(difference, 95):.2g} at "
        f"the 95th percentile and {difference.max():.2g} at most."
    )
    return DIFFERENCE.judged(float(difference.mean()), words, series=(panel,), table=table)
