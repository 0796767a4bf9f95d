"""The summary of a map of ΔE00, its histogram, and its reduced map for drawing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats32
from documents.text import JsonResult
from stimuli.comparison.areas import inside, window
from stimuli.comparison.regions import PairedArea
from stimuli.errors import StimulusError
from stimuli.measures import reduced
from stimuli.pictures.rows import Mask, bands

# The scale of every map and histogram, so that two can be compared; the thesis's.
HIGHEST = 10.0
BINS = 100


@dataclass(frozen=True, slots=True)
class DifferenceSummary(JsonResult):
    """ΔE00 over the ``pixels`` that were compared; ``above_limit_percent`` of them differ by more than ``limit``."""

    pixels: int
    mean: float
    median: float
    p95: float
    p99: float
    largest: float
    limit: float
    above_limit_percent: float


@dataclass(frozen=True, eq=False, slots=True)
class DifferenceOverview:
    """A map of ΔE00 made small enough to draw, and how many of the compared pixels differ by how much.

    ``reduced`` holds means over square blocks, NaN where a block has no pixel within the rendering. ``counts``, (n,),
    are pixels between two of the ``edges``, (n + 1,); the last also holds all that lies above.
    """

    reduced: Floats32
    counts: NDArray[np.int64]
    edges: NDArray[np.float64]


def summarise(delta_e: Floats32, limit: float, compared: Mask | None = None) -> DifferenceSummary:
    """Return the summary of a map of ΔE00, (height, width), where ``compared`` is true (everywhere without it).

    Parameters
    ----------
    delta_e
        ΔE00 at each pixel, (height, width), 0 or above, as `difference_map` gives it.
    limit
        The ΔE00 above which pixels are counted.
    compared
        Where pixels are compared, bool (height, width); None compares all.

    Returns
    -------
    DifferenceSummary
        Mean, median, percentiles and the largest ΔE00, and the percentage of pixels above ``limit``.

    Raises
    ------
    StimulusError
        If no pixel is compared.

    Examples
    --------
    >>> summary = summarise(np.array([[0.0, 1.0], [1.0, 2.0]], np.float32), limit=1.4)
    >>> summary.pixels, summary.mean, summary.largest, summary.above_limit_percent
    (4, 1.0, 2.0, 25.0)
    """
    values = delta_e.ravel() if compared is None else delta_e[compared]
    if values.size == 0:
        raise StimulusError("no pixel is left to compare: all are excluded")
    mean, largest, above = float(values.mean(dtype=np.float64)), float(values.max()), np.count_nonzero(values > limit)
    # A selection is a copy already: it is sorted where it is.
    percentiles = np.percentile(values, [50, 95, 99], overwrite_input=compared is not None)
    median, p95, p99 = (float(value) for value in percentiles)
    return DifferenceSummary(
        pixels=int(values.size),
        mean=mean,
        median=median,
        p95=p95,
        p99=p99,
        largest=largest,
        limit=limit,
        above_limit_percent=100.0 * float(above) / values.size,
    )


def overview(delta_e: Floats32, within: Mask | None = None, compared: Mask | None = None) -> DifferenceOverview:
    """Return a map, (height, width), reduced over the pixels ``within``, and the histogram of those ``compared``."""
    return DifferenceOverview(reduced(delta_e, within), *histogram(delta_e, compared))


def histogram(
    delta_e: Floats32,
    compared: Mask | None = None,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return how many pixels lie in each of `BINS` from 0 to `HIGHEST` ΔE00, (n,), and the edges, (n + 1,).

    The last bin also holds all that lies above.
    """
    counts = np.zeros(BINS, dtype=np.int64)
    for band in bands(delta_e.shape):
        values = delta_e[band].ravel() if compared is None else delta_e[band][compared[band]]
        # In double precision the product is exact, so that no value falls on the wrong side of an edge.
        bins = np.multiply(np.minimum(values, HIGHEST), BINS / HIGHEST, dtype=np.float64).astype(np.intp)
        counts += np.bincount(np.minimum(bins, BINS - 1, out=bins), minlength=BINS)
    return counts, np.linspace(0.0, HIGHEST, BINS + 1)


def seen_regions(delta_e: Floats32, regions: Sequence[PairedArea]) -> dict[str, float]:
    """Return the mean ΔE00 over each region's pixels, by name, of a map (height, width) on the photograph's grid.

    Regions without a pixel are left out.
    """
    means = {}
    for region in regions:
        at = window(region.photo_px, delta_e.shape)
        values = delta_e[at][inside(region.photo_px, *at)]
        if values.size:
            means[region.name] = float(values.mean(dtype=np.float64))
    return means
