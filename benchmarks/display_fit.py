"""Display models fitted to 120 patches: run time against held-out error, on three displays."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from curves import answer_and_seconds, is_quick, program, seconds
from numpy.typing import NDArray
from promises import Promise, worst

from devices.characterise import parametric
from devices.characterise.choose import characterise
from devices.characterise.cross_validation import PARAMETRIC
from devices.characterise.parametric import fit_parametric
from devices.characterise.patches import patches
from devices.characterise.residual_fit import fit_residual
from devices.characterise.table_fit import fit_plvc, fit_table
from devices.characterise.thesis import table_c1_codes, thesis_display
from devices.readings import Measurements, read_csv
from tests.example_displays import liquid_crystal_XYZ, noisy

CRT = Path(os.environ.get("CYCLOPEAN_SHARED_DATA", "")) / "data" / "displays" / "apple17_crt_2000.csv"


def run() -> dict[str, object]:
    """Time each fit by itself, and the whole choice; the error is the mean held-out ΔE00."""
    codes = table_c1_codes()
    displays = {
        "the thesis's": Measurements(codes, noisy(thesis_display().xyz(codes), 0.002, 1)),
        "a liquid crystal one": Measurements(codes, noisy(liquid_crystal_XYZ(codes), 0.002, 1)),
    }
    if CRT.exists() and not is_quick():
        displays["a real CRT"] = read_csv(CRT)
    if is_quick():
        displays = {name: displays[name] for name in ("a liquid crystal one",)}
    rows = [row for display, readings in displays.items() for row in _rows(display, readings)]
    rows += _solvers(displays["a liquid crystal one"])
    simulated = [row for row in rows if "chosen" in row and row["series"] != "a real CRT"]
    whole_s = worst(rows, "seconds", parameter="all, cross-validated")
    promises = [
        Promise("mean held-out ΔE00 of the chosen model", worst(simulated, "chosen"), 0.5, "error"),
        Promise("95th percentile of it", worst(simulated, "p95"), 1.0, "error"),
        Promise("six models of 120 patches, cross-validated", whole_s, 2.0, "seconds", unit="s"),
    ]
    return {"title": "Display models: run time against held-out ΔE00", "rows": rows, "promises": promises}


def _rows(display: str, readings: Measurements) -> list[dict[str, object]]:
    found, whole_s = answer_and_seconds(lambda: characterise(readings), repeats=5)
    data = found.patches
    begin, _ = fit_parametric(data, "gogo")
    tables = fit_table(data, begin.model)
    fits: dict[str, Callable[[], object]] = {kind: partial(fit_parametric, data, kind) for kind in PARAMETRIC}
    fits |= {"table": partial(fit_table, data, begin.model), "plvc": partial(fit_plvc, data, tables)}
    plvc, count, _ = fit_plvc(data, tables)
    fits["residual"] = partial(fit_residual, data, plvc, count)
    rows: list[dict[str, object]] = []
    for candidate in found.candidates:
        held = candidate.held_out
        chosen = "chosen; " if candidate is found.chosen else ""
        rows.append(
            {
                "series": display,
                "parameter": candidate.name,
                "seconds": seconds(fits[candidate.name], repeats=5),
                "error": held.mean,
                "p95": held.p95 if chosen else 0.0,
                "chosen": held.mean if chosen else 0.0,
                "note": f"{chosen}p95 {held.p95:.2f}, largest {held.max:.2f}, dark third {held.dark_mean:.2f}",
            }
        )
    rows.append(
        {
            "series": display,
            "parameter": "all, cross-validated",
            "seconds": whole_s,
            "error": found.chosen.held_out.mean,
            "note": f"{len(data)} patches, {len(found.candidates)} models, {found.folds} folds",
        }
    )
    return rows


def _solvers(readings: Measurements) -> list[dict[str, object]]:
    """Time the solver of the GOGO fit beside SciPy's; the error is the largest difference of a number."""
    from scipy.optimize import least_squares

    data = patches(readings.codes, readings.XYZ)
    problem = parametric._Problem(data, "gogo")
    exact = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}

    def slow() -> NDArray[np.float64]:
        found = least_squares(
            problem.residuals,
            problem.start(),
            jac=problem.jacobian,
            bounds=problem.bounds(),
            x_scale="jac",
            loss="soft_l1",
            **exact,
        )
        return np.asarray(found.x)

    off = float(np.abs(fit_parametric(data, "gogo")[1] - slow()).max())
    ours, theirs = seconds(lambda: fit_parametric(data, "gogo")), seconds(slow)
    made = "" if is_quick() else f"; all choices make {characterise(readings).fits_made} fits of every model"
    note = f"{theirs / ours:.1f} × as fast{made}"
    return [
        {"series": "solver of gogo", "parameter": "descend", "seconds": ours, "error": off, "note": note},
        {"series": "solver of gogo", "parameter": "SciPy's least_squares", "seconds": theirs, "error": None},
    ]


if __name__ == "__main__":
    program("display_fit", run)
