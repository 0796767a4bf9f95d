"""Real against estimated codes, and read against predicted XYZ: how well a model describes the readings.

Thesis Figure 3.17. On readings that the model was fitted to both flatter it; `cyclopean display verify` shows fresh
colours.
"""

from __future__ import annotations

import numpy as np

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.diagnostics.diagnosis import Check, Colour, Diagnosis, Line, Panel, Table, numbers
from devices.diagnostics.readings import CHANNELS, FLOOR_SHARE, means
from devices.display.model import DisplayModel
from devices.measurements import Measurements

CODES = Check(
    "estimated_codes",
    "Real against estimated codes",
    0.995,
    "R², the least channel's",
    "thesis Table 3.6, whose least R² is 0.9976, less 0.002 for the noise of a reading; channels with less than 2 % of "
    "their full light, really and by the estimate, are drawn and not judged, because readings cannot tell them",
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
        real, found = codes[:, channel], estimated[:, channel]
        lit = np.maximum(model.curves[channel].linear(real), model.curves[channel].linear(found)) >= FLOOR_SHARE
        spread = float(((real[lit] - real[lit].mean()) ** 2).sum()) if lit.any() else 0.0
        if spread == 0:
            return CODES.unjudged(f"All readings in which {name} gives 2 % of its light have one code of it.")
        shares.append(1 - float(((real - found)[lit] ** 2).sum()) / spread)
        error = 255 * (found - real)[lit]
        rows.append((name, f"{shares[-1]:.5f}", float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())))
        lines = (
            Line("", (0.0, 255.0), (0.0, 255.0), "soft", "line"),
            Line(name, numbers(255 * real), numbers(255 * found), _COLOURS[channel], "points"),
        )
        panels.append(Panel(name, "real code (0–255)", "estimated code (0–255)", lines, equal=True))
    words = f"Estimated codes explain {100 * min(shares):.4g} % of the real ones' variance in the worst channel."
    table = Table(("channel", "R²", "root mean square, codes of 8 bits", "largest"), tuple(rows))
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
    table = Table(
        ("code (0–255)", "ΔE00"),
        tuple((" ".join(f"{255 * part:.0f}" for part in codes[i]), float(difference[i])) for i in worst),
    )
    panel = Panel(
        "",
        "lightness L* of the reading",
        "ΔE00",
        (Line("", numbers(lightness), numbers(difference), "accent"),),
        (1.0,),
    )
    words = (
        f"Over {len(codes)} colours ΔE00 is {difference.mean():.2g} on average, {np.percentile(difference, 95):.2g} at "
        f"the 95th percentile and {difference.max():.2g} at most."
    )
    return DIFFERENCE.judged(float(difference.mean()), words, series=(panel,), table=table)
