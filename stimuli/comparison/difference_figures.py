"""Figures of ΔE00: the map on one fixed scale (thesis Figure 5.11), its histogram, and profiles along a line."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from documents.pages.drawing import DEEP, INK, NARROW_IN, WIDE_IN, drawing, svg_of
from stimuli.comparison.difference_map import Floats32, Mask, histogram

# The scale of every map, so that two maps can be held beside each other; the thesis's.
HIGHEST_SHOWN = 10.0
# A map is drawn with at most so many pixels along its longer side, each the mean of those it stands for.
LONGEST_PX = 900
# Excluded pixels are drawn in this grey, which is not on the scale.
EXCLUDED_GREY = "#9aa0a6"


def reduced(delta_e: Floats32, compared: Mask | None = None, longest_px: int = LONGEST_PX) -> Floats32:
    """Return a map, (height, width), as means over square blocks: NaN where a block has no compared pixel."""
    size = max(1, -(-max(delta_e.shape) // longest_px))
    rows, columns = np.arange(0, delta_e.shape[0], size), np.arange(0, delta_e.shape[1], size)

    def sums(values: NDArray[np.generic]) -> NDArray[np.float64]:
        along = np.add.reduceat(values, rows, axis=0, dtype=np.float64)
        return np.asarray(np.add.reduceat(along, columns, axis=1))

    if compared is None:
        counts = np.outer(np.diff([*rows, delta_e.shape[0]]), np.diff([*columns, delta_e.shape[1]])).astype(float)
        total = sums(delta_e)
    else:
        counts = sums(compared)
        total = sums(np.where(compared, delta_e, np.float32(0)))
    means = np.divide(total, counts, out=np.full(counts.shape, np.nan), where=counts > 0)
    return np.asarray(means, dtype=np.float32)


def map_figure(delta_e: Floats32, label: str, compared: Mask | None = None) -> str:
    """Return a map as ``<svg>``, on a scale of ΔE00 0 to 10 with its colour bar; excluded pixels are grey."""
    from matplotlib import colormaps

    small = reduced(delta_e, compared)
    shape = small.shape[0] / small.shape[1]
    colours = colormaps["viridis"].with_extremes(bad=EXCLUDED_GREY, over="#fff7c2")
    with drawing("difference-map", WIDE_IN, min(9.0, max(1.6, 6.6 * shape))) as (figure, axes):
        image = axes.imshow(small, cmap=colours, vmin=0, vmax=HIGHEST_SHOWN, interpolation="nearest", rasterized=True)
        axes.set_axis_off()
        bar = figure.colorbar(image, ax=axes, extend="max", fraction=0.04, pad=0.02)
        bar.set_label("ΔE00", color=INK)
        bar.ax.tick_params(colors=INK)
        return svg_of(figure, label)


def histogram_figure(delta_e: Floats32, limit: float, label: str, compared: Mask | None = None) -> str:
    """Return the shares of pixels by ΔE00 as ``<svg>``, with the ``limit`` as a line."""
    counts, edges = histogram(delta_e, compared, highest=HIGHEST_SHOWN)
    with drawing("difference-histogram", NARROW_IN, 2.4) as (figure, axes):
        axes.stairs(100.0 * counts / max(1, int(counts.sum())), edges, fill=True, color=DEEP, alpha=0.75)
        axes.axvline(limit, color=INK, linewidth=1, linestyle=(0, (4, 2)))
        axes.annotate(
            f"limit {limit:g}",
            (limit, 1),
            xycoords=("data", "axes fraction"),
            xytext=(4, -10),
            textcoords="offset points",
            fontsize=8,
            color=INK,
        )
        axes.set(xlim=(0, HIGHEST_SHOWN), xlabel="ΔE00 (the last bar holds all above)", ylabel="% of pixels")
        axes.spines[["top", "right"]].set_visible(False)
        return svg_of(figure, label)


def profile(
    values: NDArray[np.floating], start_px: tuple[float, float], end_px: tuple[float, float]
) -> NDArray[np.float64]:
    """Return the values of an array (height, width) along a line from (x, y) to (x, y), about one per pixel.

    Pixel centres lie at whole numbers; between them the four nearest are weighted by their distance.
    """
    from scipy.ndimage import map_coordinates

    count = max(2, int(np.ceil(np.hypot(end_px[0] - start_px[0], end_px[1] - start_px[1]))) + 1)
    x, y = (np.linspace(start_px[axis], end_px[axis], count) for axis in (0, 1))
    return np.asarray(map_coordinates(np.asarray(values, dtype=np.float64), [y, x], order=1, mode="nearest"))


def profile_figure(photo: NDArray[np.float64], rendering: NDArray[np.float64], label: str) -> str:
    """Return the luminance of both pictures along a line, (n,) each, as ``<svg>``."""
    with drawing("profile", WIDE_IN, 2.4) as (figure, axes):
        axes.plot(photo, color=INK, linewidth=1, label="photograph")
        axes.plot(rendering, color="#c2571a", linewidth=1, label="rendering")
        axes.set(xlabel="pixels along the line", ylabel="luminance (cd/m²)", xlim=(0, max(1, len(photo) - 1)))
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, fontsize=8)
        return svg_of(figure, label)
