"""The figures of a comparison's page: maps of ΔE00, luminance along lines, regions, and both pictures.

Maps are on one fixed scale (thesis Figure 5.11). Luminances of regions are drawn as they are and scaled (thesis Figures
5.9 and 5.10).
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.colour import xyY_from_XYZ
from documents.arrays import Floats
from documents.figures import DEEP, FAINT, INK, NARROW_IN, WIDE_IN, Drawing, drawing, drawn, rows_only, short
from stimuli.comparison import (
    HIGHEST,
    DifferenceOverview,
    PairedArea,
    RegionRow,
    RegionTable,
)
from stimuli.measures import LONGEST_PX, MeasureRow
from stimuli.pictures import Rows, block_means

MOST_PROFILES = 6
# The patches of a ColorChecker that its grey scale begins and ends with.
GREYS = (19, 24)
# Excluded pixels are drawn in this grey, which is not on the scale.
EXCLUDED_GREY = "#9aa0a6"
RENDERED = "#c2571a"
# Bars for the regions that differ most, no more than can be read.
MOST_BARS = 60
# Luminances that span more than this are drawn on logarithmic axes.
_WIDE_SPAN = 30.0
_TIMES = (1, 2, 5, 10, 20, 50, 100, 200, 500)
# Difference vectors are drawn as long as this share of what the figure spans, at most.
_VECTOR_SHARE = 0.12


def map_figure(small: NDArray[np.float32], label: str) -> Drawing:
    """Return a reduced map, on a scale of ΔE00 0 to 10 with its colour bar; NaN is grey."""
    return _map(small, label, "ΔE00", HIGHEST, "max")


def _map(
    small: NDArray[np.float32], label: str, scale: str, highest: float, beyond: Literal["max", "neither"]
) -> Drawing:
    from matplotlib import colormaps

    shape = small.shape[0] / small.shape[1]
    colours = colormaps["viridis"].with_extremes(bad=EXCLUDED_GREY, over="#fff7c2")
    with drawing("difference-map", WIDE_IN, min(9.0, max(1.6, 6.6 * shape))) as (figure, axes):
        image = axes.imshow(small, cmap=colours, vmin=0, vmax=highest, interpolation="nearest", rasterized=True)
        axes.set_axis_off()
        bar = figure.colorbar(image, ax=axes, extend=beyond, fraction=0.04, pad=0.02)
        bar.set_label(scale, color=INK)
        bar.ax.tick_params(colors=INK)
        return drawn(figure, label)


def measure_figures(row: MeasureRow) -> dict[str, Drawing]:
    """Return the reduced error map of each eye with its colour bar, on one scale; NaN is grey."""
    maps = {eye: measured.error_map for eye, measured in row.eyes.items() if measured.error_map is not None}
    measure, highest = row.measure, row.measure.map_highest
    if highest is None:
        highest = max((float(np.nanmax(small, initial=0.0)) for small in maps.values()), default=0.0) or 1.0
    beyond: Literal["max", "neither"] = "neither" if measure.map_highest is None else "max"
    return {
        eye: _map(
            small, measure.title if eye == "both" else f"{measure.title}, {eye} eye", measure.map_title, highest, beyond
        )
        for eye, small in maps.items()
    }


def histogram_figure(overview: DifferenceOverview, limit: float, label: str) -> Drawing:
    """Return the shares of pixels by ΔE00, with the ``limit`` as a line."""
    counts, edges = overview.counts, overview.edges
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
        axes.set(xlim=(0, HIGHEST), xlabel="ΔE00 (the last bar holds all above)", ylabel="% of pixels")
        axes.spines[["top", "right"]].set_visible(False)
        return drawn(figure, label)


def disparity_figure(photo: ArrayLike, rendering: ArrayLike, what: str, label: str) -> Drawing:
    """Return how many disparities across, in px, either pair of views has; (n,) and (m,) of them."""
    pairs = [np.asarray(values, dtype=np.float64) for values in (photo, rendering)]
    low, high = np.percentile(np.concatenate(pairs), [0.5, 99.5])
    margin = max(0.5, 0.05 * float(high - low))
    edges = np.linspace(float(low) - margin, float(high) + margin, 41)
    with drawing("disparity-histogram", NARROW_IN, 2.4) as (figure, axes):
        for values, name, colour in zip(pairs, ("photograph", "rendering"), (DEEP, RENDERED), strict=True):
            shares = 100.0 * np.histogram(values, edges)[0] / max(1, len(values))
            axes.stairs(shares, edges, color=colour, linewidth=1.4, label=name)
        axes.set(xlabel="right eye minus left, px", ylabel=f"% of {what}")
        axes.legend(frameon=False, fontsize=8)
        axes.spines[["top", "right"]].set_visible(False)
        return drawn(figure, label)


def draw_profiles(photo: Rows, rendering: Rows, regions: Sequence[PairedArea]) -> tuple[tuple[str, Drawing], ...]:
    """Return the luminance along a line across every plate and along each chart's greys, with its name."""
    profiles = []
    for name, start, end in _lines(regions)[:MOST_PROFILES]:
        photo_profile, rendering_profile = (_along(picture, start, end) for picture in (photo, rendering))
        profiles.append((name, profile_figure(photo_profile, rendering_profile, f"Luminance along a line, {name}")))
    return tuple(profiles)


def _lines(regions: Sequence[PairedArea]) -> list[tuple[str, Floats, Floats]]:
    """Return names and both ends, x and y from the picture's corner: of plates from side to side, of charts the greys'.

    Where there is neither, of the first region.
    """
    lines = []
    for region in regions:
        if region.kind == "plate" or region.sparkle:
            lines.append((f"across '{region.name}'", *_across(region.photo_px)))
        elif region.kind == "patch" and region.number == GREYS[0]:
            last = next(patch for patch in regions if patch.entry == region.entry and patch.number == GREYS[1])
            ends = region.photo_px.mean(axis=0), last.photo_px.mean(axis=0)
            lines.append((f"along the greys of '{region.entry}'", *ends))
    if not lines:
        lines.append((f"across '{regions[0].name}'", *_across(regions[0].photo_px)))
    return lines


def _across(outline_px: Floats) -> tuple[Floats, Floats]:
    if len(outline_px) == 4:
        top_left, top_right, bottom_right, bottom_left = outline_px
        return (top_left + bottom_left) / 2, (top_right + bottom_right) / 2
    low, high = outline_px.min(axis=0), outline_px.max(axis=0)
    middle = (low[1] + high[1]) / 2
    return np.array([low[0], middle]), np.array([high[0], middle])


def _along(picture: Rows, start: Floats, end: Floats) -> Floats:
    """Return Y along a line; only the rows that it crosses are read."""
    # Regions count from the corner of a pixel, profiles from its middle.
    ends = np.array([start, end]) - 0.5
    top = int(np.clip(np.floor(ends[:, 1].min()), 0, picture.shape[0] - 1))
    bottom = int(np.clip(np.ceil(ends[:, 1].max()) + 1, top + 1, picture.shape[0]))
    rows = np.concatenate([picture[at : min(at + 256, bottom)][:, :, 1] for at in range(top, bottom, 256)])
    (x, y), (other_x, other_y) = (ends - [0.0, top]).tolist()
    return profile(rows, (x, y), (other_x, other_y))


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


def profile_figure(photo: NDArray[np.float64], rendering: NDArray[np.float64], label: str) -> Drawing:
    """Return the luminance of both pictures along a line, (n,) each,."""
    with drawing("profile", WIDE_IN, 2.4) as (figure, axes):
        axes.plot(photo, color=INK, linewidth=1, label="photograph")
        axes.plot(rendering, color=RENDERED, linewidth=1, linestyle=(0, (4, 1.5)), label="rendering")
        axes.set(xlabel="pixels along the line", ylabel="luminance (cd/m²)", xlim=(0, max(1, len(photo) - 1)))
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, fontsize=8)
        return drawn(figure, label)


def draw_pictures(photo: Rows, rendering: Rows, white_XYZ: ArrayLike) -> tuple[str, str, float]:
    """Return both pictures as PNG in data URLs, made smaller in linear light, one white for both, and its luminance.

    White has the colour of ``white_XYZ`` (3,), of any luminance, to which the eye is taken to be adapted; its luminance
    is the 99.5th percentile of the photograph's, so that some highlights are cut off.
    """
    side = max(1, -(-max(photo.shape[:2]) // LONGEST_PX))
    small = [block_means(picture, side).astype(np.float64) for picture in (photo, rendering)]
    luminance = float(np.percentile(small[0][..., 1], 99.5))
    luminance = luminance if luminance > 0 else 1.0
    white = np.asarray(white_XYZ, dtype=np.float64)
    white = white / white[1] * luminance
    first, second = (_png(picture, white) for picture in small)
    return first, second, luminance


def _png(xyz: Floats, white: Floats) -> str:
    from PIL import Image

    from devices.colour import srgb

    out = io.BytesIO()
    Image.fromarray(np.round(255 * srgb(xyz, white)).astype(np.uint8)).save(out, "PNG")
    return "data:image/png;base64," + base64.b64encode(out.getvalue()).decode("ascii")


def luminance_figure(table: RegionTable, label: str) -> Drawing:
    """Return the photograph's luminances over the rendering's: as rendered, and times the mean ratio.

    Equal luminances lie on the line. Excluded regions are left out.
    """
    photo = np.array([row.photo.luminance_cd_m2 for row in table.compared])
    rendering = np.array([row.rendering.luminance_cd_m2 for row in table.compared])
    factor = table.factor.mean_ratio if table.factor is not None else 1.0
    with drawing("region-luminance", NARROW_IN, 3.8) as (figure, axes):
        if len(photo):
            everything = np.concatenate([photo, rendering, factor * rendering])
            low, high = float(everything.min()), float(everything.max())
            if high > _WIDE_SPAN * low:
                axes.set(xscale="log", yscale="log")
                ends = (low / 1.3, high * 1.3)
            else:
                ends = (0.0, high * 1.05)
            axes.plot(ends, ends, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
            axes.plot(rendering, photo, "o", color=RENDERED, markerfacecolor="none", label="as rendered", zorder=2)
            scaled = f"rendering × {factor:.4g}"
            axes.plot(factor * rendering, photo, "o", color=DEEP, markersize=4, label=scaled, zorder=3)
            axes.set(xlim=ends, ylim=ends, aspect="equal")
            axes.legend(frameon=False, fontsize=8)
        axes.set_xlabel("rendering (cd/m²)", color=INK)
        axes.set_ylabel("photograph (cd/m²)", color=INK)
        axes.spines[["top", "right"]].set_visible(False)
        return drawn(figure, label)


def chromaticity_figure(table: RegionTable, label: str) -> Drawing:
    """Return the photograph's chromaticities, with vectors towards the rendering's.

    Vectors are drawn a round number of times as long, so that they can be seen; the figure says how many. Excluded
    regions are left out; the cross is the white.
    """
    rows = table.compared
    start = np.array([[row.photo.x, row.photo.y] for row in rows]).reshape(-1, 2)
    apart = np.array([[row.delta_x, row.delta_y] for row in rows]).reshape(-1, 2)
    times = _times(start, apart)
    with drawing("region-chromaticity", NARROW_IN, 3.8) as (figure, axes):
        white = xyY_from_XYZ(table.white_XYZ)
        axes.plot([white[0]], [white[1]], "+", color=INK, markersize=9, zorder=1)
        axes.plot(start[:, 0], start[:, 1], "o", color=DEEP, markersize=4, zorder=3)
        end = start + times * apart
        for tail, head in zip(start, end, strict=True):
            axes.plot(*zip(tail, head, strict=True), color=RENDERED, linewidth=1.2, zorder=2)
        everything = np.concatenate([start, end, [white[:2]]])
        middle, reach = (everything.max(axis=0) + everything.min(axis=0)) / 2, float(np.ptp(everything, axis=0).max())
        half = 0.55 * max(reach, 0.02)
        axes.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half), aspect="equal")
        axes.grid(color=FAINT, linewidth=0.7)
        axes.set_axisbelow(True)
        axes.set_xlabel("x" if times == 1 else f"x    (differences drawn {times} × as long)", color=INK)
        axes.set_ylabel("y", color=INK)
        axes.spines[["top", "right"]].set_visible(False)
        return drawn(figure, label)


def delta_e_figure(table: RegionTable, limit: float, label: str) -> Drawing:
    """Return ΔE00 of each region, with the ``limit`` as a line; excluded regions are grey.

    Of more than `MOST_BARS` regions, those that differ most.
    """
    rows = _most(table.rows)
    with drawing("region-delta-e", WIDE_IN, 0.8 + 0.22 * max(len(rows), 1)) as (figure, axes):
        for place, row in enumerate(rows):
            colour = FAINT if row.excluded else RENDERED if row.delta_e > limit else DEEP
            axes.barh(place, row.delta_e, height=0.62, color=colour, zorder=2)
            if row.delta_e_se is not None:
                ends = [row.delta_e - row.delta_e_se, row.delta_e + row.delta_e_se]
                axes.plot(ends, [place, place], color=INK, linewidth=1.1, zorder=3)
        axes.axvline(limit, color=INK, linewidth=1, linestyle=(0, (4, 2)), zorder=4)
        axes.set_yticks(range(len(rows)), [short(row.name) + (" (excluded)" if row.excluded else "") for row in rows])
        axes.set_ylim(max(len(rows), 1) - 0.4, -0.6)
        axes.set_xlim(0, 1.05 * max([limit, *(row.delta_e + (row.delta_e_se or 0.0) for row in rows)]))
        axes.set_xlabel(f"ΔE00 (the line is the limit, {limit:g})", color=INK)
        rows_only(axes, len(rows))
        axes.tick_params(axis="y", labelsize=8)
        return drawn(figure, label)


def _most(rows: Sequence[RegionRow]) -> Sequence[RegionRow]:
    if len(rows) <= MOST_BARS:
        return rows
    kept = sorted(range(len(rows)), key=lambda place: -rows[place].delta_e)[:MOST_BARS]
    return [rows[place] for place in sorted(kept)]


def _times(start: np.ndarray, apart: np.ndarray) -> int:
    """Return how many times as long the vectors are drawn: the longest then has a share of what the points span."""
    longest = float(np.hypot(*apart.T).max()) if len(apart) else 0.0
    if longest == 0.0:
        return 1
    room = _VECTOR_SHARE * max(float(np.ptp(start, axis=0).max()), 0.02)
    return max((times for times in _TIMES if times * longest <= room), default=1)
