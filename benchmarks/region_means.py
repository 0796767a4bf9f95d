"""Mean colours of a chart's 24 patches in a photograph: run time against error.

Beside ours: masks as large as the picture with sums in float32 and in float64, and OpenCV's `fillPoly` and `mean`,
whose corners are whole pixels and whose areas hold the pixels of their outline too. And the table of all regions at
once against one region after the other.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from curves import program, seconds, sized, times_faster
from numpy.typing import NDArray
from promises import Promise, worst

from devices.chart.layout import patch_quadrangles
from documents.arrays import Floats
from stimuli.comparison.areas import AreaMean, area_means, inside, window
from stimuli.comparison.regions import PairedArea
from stimuli.comparison.table import region_table

SMALLER = sized(1, 8)
SHAPE = (1600 // SMALLER, 2400 // SMALLER, 3)
CORNERS = np.array([[410.3, 310.7], [1700.2, 350.4], [1660.8, 1180.1], [380.6, 1120.9]]) / SMALLER
WHITE = np.array([96.42, 100.0, 82.49])
REGIONS = sized(1000, 20)


def picture() -> NDArray[np.float32]:
    """Light that falls off by a third, with noise, in float32."""
    rng = np.random.default_rng(0)
    falling = np.linspace(60, 40, SHAPE[1])[:, None]
    return (falling * (WHITE / 100) * (1 + 0.02 * rng.standard_normal(SHAPE))).astype(np.float32)


def whole_masks(light: NDArray[np.float32], quadrangles: Floats, kind: type[np.floating]) -> Floats:
    """Return the means by masks as large as the picture, summed in ``kind``."""
    whole = slice(0, SHAPE[0]), slice(0, SHAPE[1])
    found = []
    for one in quadrangles:
        values = light[inside(one, *whole)].astype(kind)
        found.append(values.sum(axis=0, dtype=kind) / kind(len(values)))
    return np.array(found)


def by_opencv(light: NDArray[np.float32], quadrangles: Floats) -> Floats:
    """Return the means by OpenCV."""
    import cv2

    means = []
    for one in quadrangles:
        mask = np.zeros(SHAPE[:2], dtype=np.uint8)
        cv2.fillPoly(mask, [np.round(one - 0.5).astype(np.int32)], 255)
        means.append(cv2.mean(light, mask)[:3])
    return np.array(means)


def ours(light: NDArray[np.float32], quadrangles: Floats) -> tuple[AreaMean, ...]:
    """Return the means in one pass over the rows that hold the chart."""
    return area_means(light, [(str(number), one) for number, one in enumerate(quadrangles)])


def run() -> dict[str, object]:
    """Time each; the error is the largest relative one of a mean, against long double over the same pixels."""
    light = picture()
    quadrangles = patch_quadrangles(CORNERS)
    exact = []
    for one in quadrangles:
        at = window(one, SHAPE)
        exact.append(light[at][inside(one, *at)].astype(np.longdouble).mean(axis=0).astype(np.float64))
    ways: list[tuple[str, str, Callable[[], Floats]]] = [
        (
            "one pass, with standard errors",
            "as shipped",
            lambda: np.array([one.XYZ for one in ours(light, quadrangles)]),
        ),
        ("whole masks", "float64", lambda: whole_masks(light, quadrangles, np.float64)),
        ("whole masks", "float32", lambda: whole_masks(light, quadrangles, np.float32)),
        ("OpenCV fillPoly and mean", "corners rounded", lambda: by_opencv(light, quadrangles)),
    ]
    rows: list[dict[str, object]] = []
    for series, parameter, way in ways:
        error = float(np.max(np.abs(way() / exact - 1)))
        rows.append(
            {"series": series, "parameter": parameter, "seconds": seconds(way, repeats=3, at_least_s=0), "error": error}
        )
    for row, (_, _, way) in zip(rows[1:], ways[1:], strict=True):
        row["note"] = f"{times_faster(ways[0][2], way, rounds=5):.2g} × as long as one pass, timed in turn"
    ratio = times_faster(ways[0][2], ways[3][2], rounds=5)
    promises = [
        Promise("relative error of a mean", worst(rows, series="one pass"), 1e-14, "error"),
        Promise("beside OpenCV's fillPoly and mean", ratio, None, "ratio", "at least", "×"),
    ]
    title = f"Means of 24 patches in {SHAPE[1]} × {SHAPE[0]} pixels"
    return {"title": title, "rows": rows + _tables(), "promises": promises}


def _tables() -> list[dict[str, object]]:
    rng = np.random.default_rng(1)
    regions = [PairedArea(str(n), "cell", np.zeros((4, 2)), np.zeros((4, 2)), "g") for n in range(REGIONS)]
    photo = [AreaMean(400, colour, np.ones(3), 1e-4 * np.eye(3), 0.0) for colour in rng.uniform(5, 80, (REGIONS, 3))]
    rendering = [AreaMean(400, one.XYZ * 1.03, np.ones(3), 1e-4 * np.eye(3), 0.0) for one in photo]

    def each() -> list[float]:
        return [
            region_table([one], [first], [second], WHITE).rows[0].delta_e
            for one, first, second in zip(regions, photo, rendering, strict=True)
        ]

    at_once = partial(region_table, regions, photo, rendering, WHITE)
    apart = np.max(np.abs(np.array([row.delta_e for row in at_once().rows]) - each()))
    return [
        {
            "series": f"table of {REGIONS} regions",
            "parameter": name,
            "seconds": seconds(way, repeats=1, at_least_s=0),
            "error": error,
        }
        for name, way, error in (("all at once", at_once, float(apart)), ("one by one", each, 0.0))
    ]


if __name__ == "__main__":
    program("region_means", run)
