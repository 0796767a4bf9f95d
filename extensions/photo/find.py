"""Finds a 24-patch chart in a photograph, which way up it lies, and the camera's values of each patch.

OpenCV's detector finds it on a preview, and the centres of its patches correct that. It lies the way in which one
matrix takes the camera's values to the patches' colours. A patch's value is the trimmed mean of its inner part.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.chart import COLORCHECKER, MOST_OFF, WAYS, ChartLayout, misfit, patch_quadrangles, perspective, project
from documents import Finding
from documents.arrays import Floats
from stimuli.errors import StimulusError

Bools = NDArray[np.bool_]
Picture = NDArray[np.floating[Any]]

# The detector's own sizes suit pictures of about this many pixels across.
_PREVIEW_PX = 1200
_GAMMA = 2.2
_BRIGHT = 99.0
_ROUNDS = 3
_LEAST_CENTRES = 12

_LOOKS = 7
_LEAST = 8
_COLOURS = ("red", "green", "blue")
# A channel whose patches differ by less than this share of what the strongest channel's do sees nothing.
_DEAD = 0.01

INNER = 0.5
_TRIMMED = 0.1
# The standard deviation of a normal distribution without its outer tenths.
_NORMAL = 0.6616
_LEAST_PX = 9
# More saturated pixels than this in a patch, and its mean is of clipped light.
_MOST_SATURATED = 0.001


def find_corners(rgb: Picture, layout: ChartLayout = COLORCHECKER, *, file: str | None = None) -> Floats:
    """Return the outer corners (4, 2) of the patches of a ColorChecker in linear ``rgb`` (height, width, 3), in pixels.

    The order is the detector's guess at top left, top right, bottom right, bottom left of the chart.

    Raises
    ------
    StimulusError
        If no chart is found.
    """
    preview, scale = _preview(rgb)
    box = _detect(preview)
    if box is None:
        raise StimulusError(
            Finding(
                "no chart of 24 patches was found in the picture",
                file,
                remedy="give the outer corners of its patches: --corners x,y x,y x,y x,y",
            )
        )
    return _centred(preview.astype(np.float64), box, layout) * scale


def _preview(rgb: Picture) -> tuple[NDArray[np.uint8], float]:
    """Return a picture (h, w, 3) of 8 bits, bent for the detector's eyes, and how many pixels one of its stands for."""
    import cv2

    linear = np.nan_to_num(np.asarray(rgb, dtype=np.float32), nan=0.0, posinf=1.0, neginf=0.0)
    scale = max(1.0, max(rgb.shape[:2]) / _PREVIEW_PX)
    if scale > 1:
        size = (max(1, round(rgb.shape[1] / scale)), max(1, round(rgb.shape[0] / scale)))
        linear = np.asarray(cv2.resize(linear, size, interpolation=cv2.INTER_AREA), dtype=np.float32)
    # Each channel to its own bright end: a raw picture is green until balanced.
    bright = np.maximum(np.percentile(linear.reshape(-1, 3), _BRIGHT, axis=0), 1e-6)
    bent = np.clip(linear / bright, 0.0, 1.0) ** (1.0 / _GAMMA)
    return np.round(255 * bent).astype(np.uint8), rgb.shape[1] / linear.shape[1]


def _detect(preview: NDArray[np.uint8]) -> Floats | None:
    import cv2

    detector = cv2.mcc.CCheckerDetector.create()
    detector.setColorChartType(cv2.mcc.MCC24)
    try:
        if not detector.process(np.ascontiguousarray(preview[..., ::-1]), 1):
            return None
    except cv2.error:  # a picture without contours, or smaller than the detector's windows
        return None
    return np.asarray(detector.getBestColorChecker().getBox(), dtype=np.float64)


def _centred(preview: Floats, corners: Floats, layout: ChartLayout) -> Floats:
    """Return the corners moved so that the grid lies on the centres of the patches as their colours show them."""
    import cv2

    best = corners
    for _ in range(_ROUNDS):
        centres = layout.centres()
        where = project(perspective(layout.outline(), best), centres)
        step = float(np.median(np.linalg.norm(np.diff(where.reshape(layout.rows, layout.columns, 2), axis=1), axis=2)))
        matches = [(own, at_px) for own, at in zip(centres, where, strict=True) if (at_px := _blob(preview, at, step))]
        if len(matches) < _LEAST_CENTRES:
            return best
        own = np.array([pair[0] for pair in matches])
        seen = np.array([pair[1] for pair in matches])
        matrix, _ = cv2.findHomography(own, seen, cv2.LMEDS)
        if matrix is None:
            return best
        best = project(np.asarray(matrix, dtype=np.float64), layout.outline())
    return best


def _blob(preview: Floats, at: Floats, step: float) -> tuple[float, float] | None:
    """Return the centre of the patch of one colour about ``at``; None if that is no square of a patch's size."""
    import cv2

    half = int(np.ceil(0.8 * step))
    column, row = int(at[0]), int(at[1])
    top, left = row - half, column - half
    if half < 3 or top < 0 or left < 0 or row + half >= preview.shape[0] or column + half >= preview.shape[1]:
        return None
    window = preview[top : row + half + 1, left : column + half + 1]
    heart = max(1, round(0.15 * step))
    middle = window[half - heart : half + heart + 1, half - heart : half + heart + 1].reshape(-1, 3)
    colour = np.median(middle, axis=0)
    tolerance = 6.0 + 4.0 * float(np.median(np.abs(middle - colour)))
    alike = (np.abs(window - colour).max(axis=2) <= tolerance).astype(np.uint8)
    alike = np.asarray(cv2.morphologyEx(alike, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)), dtype=np.uint8)
    _, labels, statistics, centroids = cv2.connectedComponentsWithStats(alike, connectivity=4)
    label = int(labels[half, half])
    x, y, width, height, area = (int(number) for number in statistics[label])
    touches = x == 0 or y == 0 or x + width == window.shape[1] or y + height == window.shape[0]
    if label == 0 or touches or not 0.4 * step**2 < area < 1.1 * step**2:
        return None
    return left + float(centroids[label][0]) + 0.5, top + float(centroids[label][1]) + 0.5


def turn_upright(
    rgb: Picture,
    saturated: Bools,
    corners_px: Floats,
    reference_XYZ: Floats,
    layout: ChartLayout = COLORCHECKER,
    *,
    file: str | None = None,
) -> tuple[Floats, str]:
    """Return the corners (4, 2) in the order of the chart's patches, and in words how the chart lay, empty if upright.

    ``reference_XYZ`` (n, 3) are the patches' colours row by row from the top left, in any unit.

    Raises
    ------
    StimulusError
        If most patches are saturated, or the colours are those of the chart in no way round.
    """
    offs: dict[str, float] = {}
    clipped = 0
    for way, order in WAYS.items():
        values, full = _glance(rgb, saturated, corners_px[list(order)], layout)
        usable = ~full & np.isfinite(values).all(axis=1)
        clipped = max(clipped, int(full.sum()))
        if usable.sum() >= _LEAST:
            offs[way] = misfit(values[usable], reference_XYZ[usable])
    if not offs:
        raise StimulusError(
            Finding(
                f"{clipped} of the chart's {len(layout)} patches are saturated",
                file,
                remedy="photograph the chart again with a shorter exposure",
            )
        )
    best = min(offs, key=lambda way: offs[way])
    if not offs[best] <= MOST_OFF:
        raise StimulusError(_unlike(rgb, saturated, corners_px, layout, offs[best], file))
    return corners_px[list(WAYS[best])], best


def _unlike(
    rgb: Picture, saturated: Bools, corners_px: Floats, layout: ChartLayout, off: float, file: str | None
) -> Finding:
    """Return why the colours between the corners are no chart's."""
    values, _ = _glance(rgb, saturated, corners_px, layout)
    range_rgb = np.ptp(np.nan_to_num(values), axis=0)
    dead = [name for name, spread in zip(_COLOURS, range_rgb, strict=True) if spread < _DEAD * range_rgb.max()]
    if dead:
        blind = " and ".join(dead) + (" channel sees" if len(dead) == 1 else " channels see")
        return Finding(f"the {blind} nothing of the chart", file, remedy="check how the file was made")
    return Finding(
        f"the colours there are not those of the chart in any way round (median ΔE00 {off:.0f} at best)",
        file,
        remedy="see that --corners x,y x,y x,y x,y lie on the chart's patches and that the reference is this chart's",
    )


def _glance(
    rgb: Picture, saturated: Bools, corners_px: Floats, layout: ChartLayout
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the median of a few pixels of each patch, (n, 3), and whether any of them is saturated, (n,)."""
    quadrangles = patch_quadrangles(corners_px, layout, 0.5)
    steps = (np.arange(_LOOKS) + 0.5) / _LOOKS
    u, v = (grid.ravel()[None, :, None] for grid in np.meshgrid(steps, steps))
    a, b, c, d = (quadrangles[:, i, None, :] for i in range(4))
    points = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c)
    column = np.clip(np.floor(points[..., 0]).astype(int), 0, rgb.shape[1] - 1)
    row = np.clip(np.floor(points[..., 1]).astype(int), 0, rgb.shape[0] - 1)
    return np.median(rgb[row, column].astype(np.float64), axis=1), saturated[row, column].any(axis=(1, 2))


@dataclass(frozen=True, slots=True, eq=False)
class PatchValues:
    """Of each patch: mean ``rgb`` (n, 3), ``spread`` (n, 3), its pixels' standard deviation, and ``pixels`` (n,).

    Both leave out the highest and the lowest tenth of the pixels; the spread is scaled to what it is of normal noise.
    ``saturated`` (n, 3) marks channels that clipped in more than a thousandth of the patch's inner part.
    ``corners_px`` (4, 2) is where the chart was taken to lie.
    """

    rgb: Floats
    spread: Floats
    saturated: Bools
    pixels: NDArray[np.intp]
    corners_px: Floats


def sample_patches(
    rgb: Picture,
    saturated: Bools,
    corners_px: Floats,
    layout: ChartLayout = COLORCHECKER,
    *,
    inner: float = INNER,
    file: str | None = None,
) -> PatchValues:
    """Return the values of the patches between four corners, row by row from the first corner towards the second.

    ``rgb`` and ``saturated`` are (height, width, 3); ``inner`` is the side of what counts, as a share of the patch's.

    Raises
    ------
    StimulusError
        If a patch's inner part holds fewer than nine pixels, or values that are no finite numbers.
    """
    quadrangles = patch_quadrangles(corners_px, layout, inner)
    means, spreads, clipped, counts = [], [], [], []
    for number, quadrangle in enumerate(quadrangles):
        inside, window = _inside(quadrangle, rgb.shape)
        values = rgb[window][inside].astype(np.float64)
        if len(values) < _LEAST_PX:
            raise StimulusError(
                Finding(
                    f"patch {number + 1} of the chart holds {len(values)} pixels",
                    file,
                    remedy="photograph the chart larger, or give its corners",
                )
            )
        if not np.all(np.isfinite(values)):
            raise StimulusError(Finding(f"patch {number + 1} of the chart holds values that are no numbers", file))
        ordered = np.sort(values, axis=0)
        cut = int(_TRIMMED * len(values))
        kept = ordered[cut : len(ordered) - cut]
        means.append(kept.mean(axis=0))
        spreads.append(kept.std(axis=0, ddof=1) / (_NORMAL if cut else 1.0))
        clipped.append(saturated[window][inside].mean(axis=0) > _MOST_SATURATED)
        counts.append(len(values))
    return PatchValues(np.array(means), np.array(spreads), np.array(clipped), np.array(counts), corners_px)


def _inside(quadrangle: Floats, shape: tuple[int, ...]) -> tuple[Bools, tuple[slice, slice]]:
    """Return which pixel centres of a window lie inside a convex quadrangle (4, 2), and the window."""
    low = np.clip(np.floor(quadrangle.min(axis=0)).astype(int), 0, None)
    high = np.minimum(np.ceil(quadrangle.max(axis=0)).astype(int), [shape[1], shape[0]])
    x = np.arange(low[0], high[0]) + 0.5
    y = (np.arange(low[1], high[1]) + 0.5)[:, None]
    following = np.roll(quadrangle, -1, axis=0)
    across = [
        (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) for a, b in zip(quadrangle, following, strict=True)
    ]
    sides = np.array(across) if len(x) and len(y) else np.zeros((4, len(y), len(x)))
    inside = np.all(sides >= 0, axis=0) | np.all(sides <= 0, axis=0)
    return inside, (slice(low[1], max(low[1], high[1])), slice(low[0], max(low[0], high[0])))
