"""Display models fitted to every file of measurements in a folder: held-out ΔE00 of the chosen model and of plain GOG.

    python benchmarks/displays.py FOLDER

reads each `.ti3`, `.mat`, `.csv` and ICC profile in FOLDER and below, prints one table, and writes it as JSON and
Markdown. A file that is refused stands below with its message. Without FOLDER the displays are simulated.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from time import process_time

from documents.arrays import Floats

# Before NumPy is loaded: more threads of it only wait.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from curves import program, row, sized
from promises import Promise, worst

from devices.characterise import fit_display
from devices.characterise.thesis import table_c1_codes, thesis_display
from devices.readings import PROFILE_ENDINGS, Measurements, read_measurements
from documents import InputError
from tests.example_displays import liquid_crystal_XYZ, noisy

ENDINGS = (".ti3", ".mat", ".csv", *PROFILE_ENDINGS)
PRIMARIES = np.array([[41.2, 35.8, 18.0], [21.3, 71.5, 7.2], [1.9, 11.9, 95.0]])
NOISE = 0.001
COLUMNS = ("display", "readings", "chosen", "mean", "p95", "max", "GOG mean", "time, s")


def power_limited(codes: Floats) -> Floats:
    """An OLED whose supply gives way: up to a quarter less light the more shines."""
    light = codes**2.2
    load = light @ np.array([0.25, 0.3, 0.45])
    return np.asarray(light @ PRIMARIES.T * (1.0 - 0.25 * load**1.5)[:, None] + 1e-4)


def saturated(codes: Floats) -> Floats:
    """A display that makes colours more vivid, most at middle levels."""
    grey = codes.mean(axis=1, keepdims=True)
    vivid = np.clip(grey + (codes - grey) * (1.0 + 0.6 * grey * (1.0 - grey)), 0.0, 1.0)
    return np.asarray(vivid**2.2 @ PRIMARIES.T + 0.05)


def white_segment(codes: Floats) -> Floats:
    """A projector that adds 80 % of white to what the channels have in common."""
    light = codes**2.2
    return np.asarray((light + 0.8 * light.min(axis=1, keepdims=True)) @ PRIMARIES.T)


SIMULATED: Mapping[str, Callable[[Floats], Floats]] = {
    "the thesis's": thesis_display().xyz,
    "liquid crystal, interacting": liquid_crystal_XYZ,
    "OLED, power limited": power_limited,
    "vivid colours": saturated,
    "projector, white segment": white_segment,
}


def sources(folder: Path | None) -> dict[str, Callable[[], Measurements]]:
    """Return what reads each display's measurements, by its name."""
    if folder is not None:
        files = sorted(file for file in folder.rglob("*") if file.suffix.lower() in ENDINGS and file.is_file())
        return {str(file.relative_to(folder)): partial(read_measurements, file) for file in files}
    more = np.random.default_rng(0).integers(0, 256, (180, 3)) / 255
    codes = np.concatenate([table_c1_codes(), more, np.ones((2, 3))])
    return {name: partial(_simulated, light, codes) for name, light in [*SIMULATED.items()][: sized(None, 1)]}


def _simulated(light: Callable[[Floats], Floats], codes: Floats) -> Measurements:
    return Measurements(codes, noisy(light(codes), NOISE, 1))


def run(folder: Path | None = None) -> dict[str, object]:
    """Fit every display; the error is the mean held-out ΔE00 of the chosen model, the time that of the processor."""
    rows, cells, refused = [], [], []
    for name, read in sources(folder).items():
        start_s = process_time()
        try:
            eyes = fit_display(read()).eyes
        except (InputError, ValueError) as error:
            refused.append(f"{name}: {error}")
            continue
        taken_s = process_time() - start_s
        for eye, fit in eyes.items():
            found = fit.characterisation
            held = found.chosen.held_out
            gog = next(one.held_out for one in found.candidates if one.name == "gog")
            display = name if eye == "both" else f"{name}, {eye} eye"
            figures = [f"{value:.2f}" for value in (held.mean, held.p95, held.max, gog.mean)]
            cells.append((display, str(len(found.patches)), found.chosen.name, *figures, f"{taken_s:.1f}"))
            rows.append(
                row(
                    display,
                    found.chosen.name,
                    taken_s,
                    held.mean,
                    note=f"{len(found.patches)} readings; p95 {held.p95:.2f}, largest {held.max:.2f}; "
                    f"plain GOG {gog.mean:.2f}" + (f"; {len(found.left_out)} left out" if found.left_out else ""),
                    p95=held.p95,
                    max=held.max,
                    gog_mean=gog.mean,
                    left_out=list(found.left_out),
                )
            )
    where = "simulated displays" if folder is None else f"the files in {folder.name}"
    promises = [] if folder else [Promise("largest held-out mean ΔE00", worst(rows), 0.7, "error", unit="ΔE00")]
    lines = [printed(cells), *(f"refused: {line}" for line in refused)]
    return {"title": f"Display models on {where}: held-out ΔE00", "rows": rows, "lines": lines, "promises": promises}


def printed(cells: list[tuple[str, ...]]) -> str:
    """Return the table as text."""
    every = [COLUMNS, *cells]
    widths = [max(len(row[i]) for row in every) for i in range(len(COLUMNS))]
    return "\n".join(
        "  ".join(
            cell.ljust(w) if i in (0, 2) else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        )
        for row in every
    )


if __name__ == "__main__":
    named = [word for word in sys.argv[1:] if not word.startswith("--")]
    given = Path(named[0]) if named else None
    if given is not None and not given.is_dir():
        sys.exit(f"there is no folder {given}")
    program("displays" if given is None else f"displays_{given.name}", lambda: run(given))
