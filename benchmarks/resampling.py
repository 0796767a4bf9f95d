"""A plate photographed with 2190 × 1460 pixels, brought to 542 × 361 of a display: run time against aliasing.

The error is what a chirp above the display's Nyquist frequency leaves behind: root of the mean square over 0.55 to 1.9
cycles per display pixel, the chirp's own amplitude being 1. Beside it stand how much of it passes below Nyquist, and
for a plate of sparkles the least luminance, how much light is lost, and what a sparkle's brightest pixel keeps.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from curves import Row, program, seconds, sized
from numpy.typing import NDArray
from promises import Promise, worst

from documents.arrays import Floats
from stimuli.pictures.resampling import Filter, axis_weights, resample

Picture = NDArray[np.float32]
Way = Callable[[Picture], NDArray[np.floating]]

PITCH_MM = 0.2768
# Of a plate of 150 × 100 mm what fills whole display pixels.
SMALLER = sized(1, 4)
WIDE, HIGH = (2190 // SMALLER, 542 // SMALLER * PITCH_MM), (1460 // SMALLER, 361 // SMALLER * PITCH_MM)
HIGHEST = 1.9  # cycles per display pixel


def ways() -> dict[tuple[str, str], Way]:
    """Return ways to resample a picture, by series and parameter."""
    import cv2
    from PIL import Image

    found: dict[tuple[str, str], Way] = {}
    shape = (0, 0)
    filters: tuple[Filter, ...] = ("area", "linear", "cubic")
    for name in filters:
        columns, rows = (axis_weights(*axis, PITCH_MM, name) for axis in (WIDE, HIGH))
        shape = (columns.shape[0], rows.shape[0])
        found["ours", name] = partial(resample, rows=rows, columns=columns)
    for name, flag in (("INTER_AREA", cv2.INTER_AREA), ("INTER_LINEAR", cv2.INTER_LINEAR)):
        found["OpenCV", name] = lambda picture, flag=flag: cv2.resize(picture, shape, interpolation=flag)
    for name, kind in (("bicubic", Image.Resampling.BICUBIC), ("Lanczos", Image.Resampling.LANCZOS)):
        found["Pillow", name] = lambda picture, kind=kind: np.asarray(Image.fromarray(picture).resize(shape, kind))
    return found


def chirp() -> tuple[Picture, Floats]:
    """Return a picture whose frequency rises along its rows, and that of each display pixel, in cycles per pixel."""
    display = round(WIDE[1] / PITCH_MM)
    place = (np.arange(WIDE[0]) + 0.5) / WIDE[0]
    line = 1 + np.cos(np.pi * HIGHEST * display * place**2)
    shown = (np.arange(display) + 0.5) / display
    return np.repeat(line[None], HIGH[0], axis=0).astype(np.float32), HIGHEST * shown


def sparkles() -> Picture:
    """Return a plate of 10 cd/m² with sparkles thirty times as bright, spread over a camera pixel."""
    from scipy.ndimage import gaussian_filter

    random = np.random.default_rng(4)
    points = np.zeros((HIGH[0], WIDE[0]))
    points[random.integers(0, HIGH[0], 1500), random.integers(0, WIDE[0], 1500)] = 290 * 2 * np.pi
    return (10 + gaussian_filter(points, 1.0)).astype(np.float32)


def measured(way: Way, plate: Picture, wave: Picture, frequency: Floats) -> tuple[float, str]:
    """Return the aliasing, and the rest in words."""
    seen = way(wave)[HIGH[0] // 8].astype(np.float64) - 1
    above = np.flatnonzero((frequency > 0.55) & (np.arange(len(frequency)) < len(frequency) - 8))
    below = np.flatnonzero((frequency > 0.02) & (frequency < 0.45))
    alias = float(np.sqrt(2 * np.mean(seen[above] ** 2)))
    passed = float(np.sqrt(2 * np.mean(seen[below] ** 2)))
    small = way(plate).astype(np.float64)
    light = float(small.mean() / plate.mean(dtype=np.float64)) - 1
    peak = float(np.percentile(small, 99.9) - 10) / float(np.percentile(plate, 99.9) - 10)
    return alias, (
        f"{100 * passed:.0f} % passes below Nyquist; least luminance {small.min():.2f} of 10 cd/m²; "
        f"light {100 * light:+.4f} %; bright pixels keep {100 * peak:.0f} %"
    )


def run() -> dict[str, object]:
    """Resample chirp and sparkles each way."""
    wave, frequency = chirp()
    plate = sparkles()
    rows: list[Row] = []
    for (series, parameter), way in ways().items():
        alias, note = measured(way, plate, wave, frequency)
        time_s = seconds(partial(way, plate), repeats=5)
        rows.append({"series": series, "parameter": parameter, "seconds": time_s, "error": alias, "note": note})
    promises = [
        Promise("aliasing by linear B-splines", worst(rows, series="ours", parameter="linear"), 0.12, "error"),
        Promise("aliasing by cubic B-splines", worst(rows, series="ours", parameter="cubic"), 0.04, "error"),
        Promise(
            "areas, aliasing beside OpenCV's INTER_AREA",
            worst(rows, series="ours", parameter="area") - worst(rows, series="OpenCV", parameter="INTER_AREA"),
            1e-3,
            "error",
        ),
    ]
    return {
        "title": "Photograph to display pixels, one channel: time against aliasing",
        "rows": rows,
        "promises": promises,
    }


if __name__ == "__main__":
    program("resampling", run)
