"""Verifying through a session's pass beside the model's own codes, where crosstalk and unevenness were measured.

Errors are the mean ΔE00 between 24 colours asked and a simulated reading of what the screen shows, without noise.
"""

from __future__ import annotations

import numpy as np
from curves import program, row, seconds, sized
from promises import Promise, worst

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.compensation.compensate import Correction
from devices.display.crosstalk import Crosstalk
from devices.display.curves import ToneCurve
from devices.display.display_file import EyeModels
from devices.display.gain_map import GainMap
from devices.display.model import DisplayModel
from devices.readings import Patch, PatchOnScreen
from devices.readings.colorchecker import asked_of
from devices.readings.simulated import Faults, Simulated, SimulatedDisplay
from runner.measuring.code_screen import CodeScreen
from runner.measuring.patch_screen import AskedScreen, PatchScreen
from runner.measuring.verification import patches_of
from runner.presenter.modes.registry import find_mode
from runner.presenter.surfaces.opening import open_surface

SIZE = sized((960, 540), (96, 54))
CURVE = ToneCurve(gamma=2.2)
MODEL = DisplayModel(
    np.array([0.02, 0.02, 0.03]),
    np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]]),
    (CURVE, CURVE, CURVE),
)


def run() -> dict[str, object]:
    """Show and read the colours both ways, with a leak of 5 % and a panel that is dim at its right edge."""
    models = EyeModels(MODEL, MODEL)
    leaks = Crosstalk(0.05 * np.eye(3), 0.05 * np.eye(3))
    gain_map = GainMap(np.array([[25.0, 27.0, 20.0]]), SIZE, "cells", "centre")
    display = SimulatedDisplay(models, leaks, gain_map)
    instrument = Simulated(display, 0, Faults(noise=0.0))
    asked = asked_of(MODEL)
    wanted = np.array([colour.XYZ_cd_m2 for colour in asked])
    white = MODEL.xyz([1.0, 1.0, 1.0])
    patches = patches_of(asked, MODEL).rounded(255).patches
    mode = find_mode("row-interleaved")

    def read(screen: PatchScreen, patch: Patch) -> tuple[float, float, float]:
        shown = screen.show_patch(patch, "both")
        return instrument.read(PatchOnScreen(patch.name, shown.own, 0, 0.0, shown.other, patch, shown.place)).XYZ_cd_m2

    rows = []
    with open_surface("egl", SIZE) as surface:
        correction = Correction(leaks, gain_map)
        for series in ("through the pass, read back", "codes of the model alone"):
            screen: AskedScreen | CodeScreen
            if series.startswith("through"):
                screen = AskedScreen(
                    surface, mode, models, correction, {colour.name: colour.XYZ_cd_m2 for colour in asked}
                )
            else:
                screen = CodeScreen(surface, mode)
            with screen:
                light = np.array([read(screen, patch) for patch in patches])
                taken = seconds(lambda shown=screen: [read(shown, patch) for patch in patches], repeats=3) / len(
                    patches
                )
            error = float(delta_e_2000(xyz_to_lab(wanted, white), xyz_to_lab(light, white)).mean())
            note = "a patch shown and read; mean ΔE00 of 24 colours"
            rows.append(row(series, "row-interleaved", taken, error, note=note))
    through = worst(rows, series="through the pass")
    promise = Promise("mean ΔE00 of 24 colours through the session's pass", through, 0.3, "error", unit="ΔE00")
    return {
        "title": f"Verifying a display with crosstalk and a gain map, {SIZE[0]} × {SIZE[1]} pixels",
        "rows": rows,
        "promises": [promise],
    }


if __name__ == "__main__":
    program("verification", run)
