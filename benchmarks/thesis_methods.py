"""Two of the thesis's own methods beside plain libraries: the curves of a display, and contrast over exposure.

Curves: the second method's GOG of three channels from the ramps of Table C.1 with 0.2 % of noise, beside SciPy's
``curve_fit``; the error is the mean one of gamma over 20 noises. Contrast: sparkles of known contrast on a background
that falls off across the picture, at three exposures, beside a median filter over every pixel (SciPy); the error is
that of the mean Weber contrast of the shortest exposure.
"""

from __future__ import annotations

from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from curves import Row, program, seconds, sized, times_faster
from promises import Promise, worst
from scipy.ndimage import median_filter
from scipy.optimize import curve_fit

from devices.characterise import table_c1_codes, thesis_display
from devices.characterise.channel_fit import fit_channels
from devices.characterise.thesis import THESIS_CURVES
from documents.arrays import Floats
from extensions.sparkle import contrast_over_exposure
from stimuli.pictures import StereoImage
from tests.example_displays import noisy

NOISES = sized(20, 2)
SIZES_PX = sized((192, 384, 1024), (96,))
# A median about each pixel takes minutes on more.
MOST_FILTERED_PX = 192
FULL_CD_S_M2, CONTRAST, WINDOW_PX = 10.0, 6.0, sized(65, 15)


def _ramps(seed: int) -> list[tuple[Floats, Floats]]:
    codes, display = table_c1_codes(), thesis_display()
    light = noisy(display.xyz(codes), 0.002, seed) @ np.linalg.inv(display.primaries_XYZ_cd_m2).T
    alone = [np.all(np.delete(codes, channel, axis=1) == 0, axis=1) for channel in range(3)]
    return [(codes[rows, channel], light[rows, channel]) for channel, rows in enumerate(alone)]


def _gog(code: Floats, gain: float, offset: float, gamma: float) -> Floats:
    return np.asarray(np.maximum(gain * code + offset, 0.0) ** gamma)


def _by_scipy(ramps: list[tuple[Floats, Floats]]) -> list[float]:
    start, bounds = (1.0, 0.01, 2.0), ((0.05, -0.9, 0.1), (4.0, 0.9, 10.0))
    return [float(curve_fit(_gog, code, light, p0=start, bounds=bounds)[0][2]) for code, light in ramps]


def _by_us(ramps: list[tuple[Floats, Floats]]) -> list[float]:
    return [float(fit.coefficients[2]) for fit in fit_channels(ramps, "gog")]


def curve_rows() -> list[Row]:
    """Fit the ramps of the thesis's display both ways."""
    true = np.array([gamma for _, _, gamma in THESIS_CURVES])
    every = [_ramps(seed) for seed in range(NOISES)]
    ratio = times_faster(partial(_by_us, every[0]), partial(_by_scipy, every[0]))
    rows: list[Row] = []
    for series, fit in (("three curves", _by_us), ("three curves, SciPy", _by_scipy)):
        error = float(np.mean([np.abs(np.array(fit(ramps)) - true) for ramps in every]))
        row: dict[str, Any] = {"series": series, "parameter": "gamma", "seconds": seconds(partial(fit, every[0]))}
        note = f"{ratio:.1f} × as fast as SciPy, timed in turn; with standard errors" if fit is _by_us else ""
        rows.append({**row, "error": error, "note": note})
    return rows


def _photographs(side: int) -> list[tuple[str, float, StereoImage]]:
    base = 2.0 + np.linspace(0, 1, side)[:, None] * np.linspace(0.5, 1, side)
    places = np.random.default_rng(1).choice(np.arange(8, side - 8, 16), (2, side * side // 2000))
    luminance = base.copy()
    luminance[tuple(places)] *= 1 + CONTRAST
    return [
        (f"{time:g} s", time, StereoImage.flat(np.repeat(np.minimum(luminance, full)[..., None], 3, 2).astype("f4")))
        for time, full in ((time, FULL_CD_S_M2 / time) for time in (1 / 15, 1 / 2, 2.0))
    ]


def _by_filter(pictures: list[tuple[str, float, StereoImage]]) -> list[float]:
    first = pictures[0][2].left[..., 1]
    sparkles = first > 2 * median_filter(first, WINDOW_PX)
    found = []
    for _, _, image in pictures:
        luminance = image.left[..., 1]
        background = median_filter(luminance, WINDOW_PX)[sparkles]
        found.append(float(np.mean(luminance[sparkles] / background - 1)))
    return found


def _by_windows(pictures: list[tuple[str, float, StereoImage]]) -> list[float]:
    return [row.as_photographed.contrast.value for row in contrast_over_exposure(pictures).rows]


def contrast_rows() -> list[Row]:
    """Measure three exposures both ways."""
    rows: list[Row] = []
    for side in SIZES_PX:
        pictures = _photographs(side)
        for series, way in (("contrast, windows", _by_windows), ("contrast, median about each pixel", _by_filter)):
            if way is _by_filter and side > MOST_FILTERED_PX:
                continue
            began = perf_counter()
            found = way(pictures)
            taken = perf_counter() - began if way is _by_filter else seconds(partial(way, pictures), repeats=5)
            row: dict[str, Any] = {"series": series, "parameter": f"{side} × {side} px"}
            note = "contrast " + ", ".join(f"{value:.3f}" for value in found) + " at 1/15, 1/2 and 2 s"
            rows.append({**row, "seconds": taken, "error": abs(found[0] - CONTRAST) / CONTRAST, "note": note})
    return rows


def run() -> dict[str, Any]:
    """Fit and measure."""
    rows = [*curve_rows(), *contrast_rows()]
    ours, theirs = (worst(rows[place : place + 1]) for place in (0, 1))
    promises = [
        Promise("error of γ beside SciPy's curve_fit", ours / theirs, 1.01, "error", unit="×"),
        Promise("contrast of sparkles, relative", worst(rows, series="contrast, windows"), 5e-3, "error"),
    ]
    return {"title": "The thesis's own methods", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("thesis_methods", run)
