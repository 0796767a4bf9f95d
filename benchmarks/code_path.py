"""What stands between codes and light, found from the set ``cable``, beside plain rules.

Dynamic contrast: a backlight that adds 0 or 5 % to patches on white, with up to 1 % of the surround's light as stray
light; the error is that of the change found, in % of a patch's own light. The plain rule is the largest change of any
patch. Successive codes: panels of 8 and of 6 bits, read with noise; the error is how many of the 16 steps are taken for
what they are not. The plain rule calls two codes alike that differ by less than three standard errors.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from curves import program, seconds, sized
from promises import Promise, worst

from devices.diagnostics.content import dynamic_contrast
from devices.diagnostics.panel import pixel_independence
from devices.diagnostics.signal_path import cable_greys, code_steps
from devices.display.curves import ToneCurve
from devices.display.model import DisplayModel
from devices.readings import Measurements, PatchOnScreen, find_sets, steps
from devices.readings.simulated import Faults, Simulated

RUNS = sized(25, 1)
CODES = range(120, 137)
ORDER = steps(find_sets(("cable",)), 1)
PRIMARIES = np.array([[54.0, 48.0, 28.0], [28.0, 93.0, 11.0], [2.7, 8.0, 146.0]])


def readings(seed: int, faults: Faults) -> Measurements:
    """Return the set read on a display of gamma 1.9 to 2.4 with ``faults``."""
    curve = ToneCurve(gamma=float(np.random.default_rng(seed).uniform(1.9, 2.4)))
    display = DisplayModel(PRIMARIES.sum(axis=1) / 1000, PRIMARIES, (curve, curve, curve))
    instrument = Simulated(display, seed, faults)
    shown = [PatchOnScreen(s.label, s.patch.codes, s.position, 0.0, s.patch.codes, s.patch) for s in ORDER]
    return Measurements(
        np.array([step.patch.codes for step in ORDER]),
        np.array([instrument.read(showing).XYZ_cd_m2 for showing in shown]),
        tuple(step.label for step in ORDER),
        area=np.array([step.patch.filled for step in ORDER]),
        surround=np.array([step.patch.surround for step in ORDER]),
    )


def alike_by_slope(table: Measurements) -> list[bool]:
    """Return which steps `code_steps` finds missing."""
    judged = code_steps(table)
    assert judged.table is not None, judged.words
    return [float(str(row[1])) < 0.5 for row in judged.table.rows]


def alike_by_noise(table: Measurements) -> list[bool]:
    """Return which steps are less than three standard errors of the two codes' own readings."""
    greys = cable_greys(table)
    pairs = pairwise(greys[code] for code in CODES)
    return [abs(b.mean() - a.mean()) < 3 * np.sqrt(a.var(ddof=1) / len(a) + b.var(ddof=1) / len(b)) for a, b in pairs]


def largest_change(table: Measurements) -> float:
    """Return the largest change of a patch with its surround, in %."""
    return float(pixel_independence(table).value or 0.0)


def own_light(table: Measurements) -> float:
    """Return the change of a patch's own light with its surround, in %."""
    return float(dynamic_contrast(table).value or 0.0)


def run() -> dict[str, object]:
    """Return for each case and way the time and the error."""
    rows: list[dict[str, object]] = []
    ways: dict[str, Callable[[Measurements], float]] = {
        "largest change of a patch": largest_change,
        "slope over three patches": own_light,
    }
    for stray in (0.0, 0.002, 0.01):
        cases = [(gain, readings(seed, Faults(noise=0.002, surround_gain=gain, stray_light=stray)))
                 for seed in range(RUNS) for gain in (0.0, 0.05)]  # fmt: skip
        for way, change in ways.items():
            errors = [abs(change(table) - 100 * gain) for gain, table in cases]
            rows.append(_row(f"dynamic contrast, {100 * stray:g} % of stray light", way, errors, change, cases[0][1]))
    judges = {"alike within the noise": alike_by_noise, "over the slope of all": alike_by_slope}
    for noise in (0.001, 0.002, 0.003):
        for bits in (8, 6):
            tables = [readings(seed, Faults(noise=noise, panel_bits=bits)) for seed in range(RUNS)]
            tables = [table for table in tables if code_steps(table).passed is not None]
            truth = [bits == 6 and code % 4 != 3 for code in CODES][:-1]
            for way, judge in judges.items():
                errors = [float(sum(a != b for a, b in zip(judge(t), truth, strict=True))) for t in tables]
                name = f"successive codes, {bits} bits, {100 * noise:g} % of noise"
                rows.append(_row(name, way, errors, judge, tables[0]))
    promises = [
        Promise("steps of successive codes taken for another", worst(rows, parameter="over the slope"), 0, "count"),
        Promise(
            "a backlight's change, whatever the stray light",
            worst(rows, parameter="slope over"),
            0.3,
            "error",
            unit="%",
        ),
    ]
    title = "What codes pass on their way to the light: run time against error"
    return {"title": title, "rows": rows, "promises": promises}


def _row(
    series: str, way: str, errors: list[float], work: Callable[[Measurements], object], table: Measurements
) -> dict[str, object]:
    took_s = seconds(lambda: work(table), repeats=3)
    note = f"largest of {len(errors)} displays {max(errors):.2g}"
    return {"series": series, "parameter": way, "seconds": took_s, "error": float(np.mean(errors)), "note": note}


if __name__ == "__main__":
    program("code_path", run)
