"""1500 sparkles planted in a picture of 1460 × 2190 pixels with noise: run time against error of their places.

Beside ours stands what scikit-image and SciPy offer for it: a median filter for the background (on a picture reduced
eightfold, since one at full size takes minutes), `peak_local_max`, and centroids over 5 × 5 pixels.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from curves import Row, program, seconds, sized
from numpy.typing import NDArray
from promises import Promise, times_as_fast, worst

from documents.arrays import Floats
from stimuli.sparkles.find import SparkleThreshold
from stimuli.sparkles.measure import measure_sparkles

Picture = NDArray[np.float32]
SHAPE = sized((1460, 2190), (292, 438))
SPARKLES = sized(1500, 60)
SD_PX, BASE, PEAK = 1.0, 10.0, 60.0

PLAIN = "scikit-image, SciPy"


def planted(noise: float, sparkles: int = SPARKLES) -> tuple[Picture, Floats]:
    """Return the picture, its light falling off to the right, and the sparkles' places (n, 2)."""
    random = np.random.default_rng(2)
    places = random.uniform(10, np.array(SHAPE) - 10, (sparkles, 2))
    picture = np.full(SHAPE, BASE)
    offsets = np.arange(-6, 7)
    for row, column in places:
        i, j = round(row), round(column)
        # Nine points to a pixel: its mean light, nearly.
        fine = (np.arange(3) - 1) / 3
        down = np.exp(-0.5 * (((i + offsets)[:, None] + fine - row) / SD_PX) ** 2).mean(axis=1)
        across = np.exp(-0.5 * (((j + offsets)[:, None] + fine - column) / SD_PX) ** 2).mean(axis=1)
        picture[i - 6 : i + 7, j - 6 : j + 7] += PEAK * np.outer(down, across)
    picture *= np.linspace(1.3, 0.7, SHAPE[1])
    return (picture + random.normal(0, noise, SHAPE)).astype(np.float32), places


def ours(picture: Picture) -> Floats:
    """Return the places of sparkles twice as bright as their background."""
    found = measure_sparkles(picture, SparkleThreshold(times=2.0)).moments
    return np.stack([found.row_px, found.column_px], axis=-1)


def plain(picture: Picture) -> Floats:
    """Return the same by well-known functions."""
    from scipy.ndimage import median_filter, zoom
    from skimage.feature import peak_local_max

    coarse = median_filter(picture[::8, ::8], 9, mode="nearest")
    background = zoom(coarse, np.array(picture.shape) / coarse.shape, order=1)
    above = np.where(picture > 2 * background, picture, 0)
    peaks = peak_local_max(above, min_distance=2, threshold_abs=1e-6, exclude_border=False)
    light = picture - background
    offsets = np.arange(-2, 3)
    inside = np.clip(peaks, 2, np.array(picture.shape) - 3)
    around = light[inside[:, 0, None, None] + offsets[:, None], inside[:, 1, None, None] + offsets]
    total = around.sum(axis=(1, 2))
    return inside + np.stack([(around.sum(axis=axis) * offsets).sum(axis=1) / total for axis in (2, 1)], axis=-1)


def run() -> dict[str, object]:
    """Find the sparkles of pictures with less and more noise."""
    from scipy.spatial import cKDTree

    rows: list[Row] = []
    for noise in sized((0.0, 0.1, 0.5), (0.1,)):
        picture, places = planted(noise)
        for name, way in (("ours", ours), (PLAIN, plain)):
            found = way(picture)
            distance, _ = cKDTree(found).query(places)
            # Nearer than 3 px, two may be one peak.
            apart = cKDTree(places).query(places, k=2)[0][:, 1] > 3
            error = float(np.sqrt(np.mean(distance[apart] ** 2)))
            note = f"{len(found)} found of {len(places)}, {int(apart.sum())} of them more than 3 px apart, "
            note += f"those within {distance[apart].max():.2f} px"
            row = {"series": name, "parameter": f"noise {100 * noise / BASE:.0f} % of the background"}
            time_s = seconds(partial(way, picture), repeats=3, at_least_s=0)
            rows.append({**row, "seconds": time_s, "error": error, "note": note})
    promises = [
        Promise("places of sparkles", worst(rows, series="ours"), 0.02, "error", unit="px"),
        Promise("beside scikit-image's peaks", times_as_fast(rows, "ours", PLAIN), None, "ratio", "at least", "×"),
    ]
    return {"title": "Places of sparkles: time against error in pixels", "rows": rows, "promises": promises}


if __name__ == "__main__":
    program("sparkle_measures", run)
