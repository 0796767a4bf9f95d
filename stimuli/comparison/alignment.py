"""Where a rendering lies on its photograph's grid, and the rendering interpolated there, a band of rows at a time.

Places are in pixels of the middle of a pixel, x to the right and y down; an angle is positive clockwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np

from documents import in_threads
from documents.arrays import Floats
from documents.text import json_fields, significant
from stimuli.align.homography import mapped
from stimuli.align.warping import grid_places, warp
from stimuli.comparison.verdict import Limits, Outcome, Reason, decimals
from stimuli.pictures.rows import Mask, RowFile, RowsDone

# Displacements below this are not worth an interpolation.
STILL_PX = 0.02
# A displacement that was undone is named from here on, if it is above so many of its standard errors.
_NAMED_PX, _NAMED_Z, _NAMED_DEG = 0.02, 3.0, 0.01
# Rows made at a time, and rows beyond those they come from: what a cubic spline looks at fades within these.
_BAND_ROWS, _BEYOND = 256, 24


@dataclass(frozen=True, eq=False, slots=True)
class Alignment:
    """How the rendering was brought to the photograph's pixels.

    ``matrix`` (3, 3) takes a place of the photograph to the rendering. ``shift_px``, ``rotation_deg`` and ``scale`` are
    what it does to the photograph's middle, with their standard errors where squares gave them. ``residual_px`` is left
    after it, None where nothing could be measured. ``start`` is where the first guess came from. ``blur_px`` is the
    standard deviation of the Gaussian by which the rendering is blurrier, negative if the photograph is; 0 below 1.
    """

    matrix: Floats
    start: str
    shift_px: tuple[float, float]
    shift_se_px: tuple[float, float] | None
    rotation_deg: float
    rotation_se_deg: float | None
    scale: float
    residual_px: float | None
    squares: int
    squares_of: int
    moved: bool
    blur_px: float = 0.0

    def to_json(self) -> dict[str, Any]:
        """Return the numbers by name."""
        values = json_fields(self)
        matrix = values.pop("matrix")
        return {**values, "photo_to_rendering": matrix}

    def sentences(self) -> list[str]:
        """Return sentences on how the rendering lies."""
        lines = []
        ways = [_way(self.shift_px[0], "further right", "further left"), _way(self.shift_px[1], "lower", "higher")]
        if any(ways):
            lines.append(f"the rendering lies {' and '.join(way for way in ways if way)} than the photograph")
        if self.rotation_deg and abs(self.rotation_deg) >= 5e-4:
            sign = "clockwise" if self.rotation_deg > 0 else "anticlockwise"
            error = "" if self.rotation_se_deg is None else f" ± {self.rotation_se_deg:.3f}"
            lines.append(f"the rendering is turned {abs(self.rotation_deg):.3f}{error}° {sign}")
        if abs(self.scale - 1.0) >= 5e-5:
            lines.append(f"the rendering is {self.scale:.4f} times as large")
        return lines

    def remarks(self) -> list[str]:
        """Return sentences on the scale, on blur, and on a residual that is not known; the verdict has none."""
        remarks = [f"the rendering is {self.scale:.4f} times as large"] if abs(self.scale - 1.0) >= 5e-5 else []
        if self.blur_px:
            one, other = ("rendering", "photograph") if self.blur_px > 0 else ("photograph", "rendering")
            remarks.append(
                f"the {one} is blurrier than the {other}, as if by a Gaussian of {abs(self.blur_px):.1f} px standard "
                "deviation"
            )
        if self.residual_px is None:
            remarks.append(
                "how far the pictures lie apart could not be measured: their textures have nothing in common"
            )
        return remarks


def registration_reasons(alignment: Alignment | None, limits: Limits) -> list[Reason]:
    """Return whether the pictures lie on one grid, and how they lay before."""
    if alignment is None:
        return []
    reasons = []
    residual, most = alignment.residual_px, limits.registration_residual_px
    if residual is not None:
        good = residual <= most
        sentence = (
            f"the pictures lie {significant(residual, 2)} px apart, {'within' if good else 'more than'} {most:g} px"
        )
        if not good:
            sentence += ": single pixels cannot be compared"
        outcome: Outcome = "passes" if good else "cannot say"
        reasons.append(Reason("registration", "residual", outcome, sentence, residual, most, "px"))
    shift = math.hypot(*alignment.shift_px)
    error = math.hypot(*alignment.shift_se_px) if alignment.shift_se_px is not None else 0.0
    if shift > max(_NAMED_PX, _NAMED_Z * error):
        across, down = (decimals(component, 2) for component in alignment.shift_px)
        sentence = f"the rendering lay ({across}, {down}) px beside the photograph, across and down"
        reasons.append(Reason("registration", "shift", "noted", sentence, shift, None, "px"))
    if abs(alignment.rotation_deg) > _NAMED_DEG:
        sentence = f"the rendering lay turned by {decimals(alignment.rotation_deg, 2)}° against the photograph"
        reasons.append(Reason("registration", "rotation", "noted", sentence, alignment.rotation_deg, None, "°"))
    return reasons


def _way(value: float, more: str, less: str) -> str:
    return f"{abs(value):.2f} px {more if value >= 0 else less}" if abs(value) >= STILL_PX else ""


def resample(
    rendering: RowFile, alignment: Alignment, size_px: tuple[int, int], rows_done: RowsDone
) -> tuple[RowFile, Mask]:
    """Return the rendering on a grid of ``size_px`` across and down, and which of its pixels lie within the rendering.

    In linear light, by a cubic spline; pixels are within only where the spline uses nothing beyond the edge.
    """
    width, height = size_px
    if not alignment.moved:
        return rendering, np.ones((height, width), dtype=np.bool_)
    moved, within = RowFile((height, width, 3)), np.empty((height, width), dtype=np.bool_)
    turn, done = Lock(), 0

    def move(first: int) -> None:
        nonlocal done
        last = min(first + _BAND_ROWS, height)
        within[first:last] = _within(alignment.matrix, first, last, width, rendering.shape)
        top, bottom = _rows_seen(alignment.matrix, first, last, width, rendering.shape[0])
        source = rendering[top:bottom]
        turned = _down(-top) @ alignment.matrix @ _down(first)
        moved.write(first, warp(source, turned, (width, last - first), of=width * height).picture)
        with turn:
            done += last - first
            rows_done(done, height)

    in_threads(move, range(0, height, _BAND_ROWS))
    return moved, within


def resample_flags(flags: Mask, alignment: Alignment, size_px: tuple[int, int]) -> Mask:
    """Return flags (height, width) of the rendering on that grid; a pixel is flagged if one that it comes from is."""
    width, height = size_px
    if not alignment.moved:
        return flags
    from scipy.ndimage import maximum_filter

    wide = maximum_filter(flags, 3)
    resampled = np.zeros((height, width), dtype=np.bool_)
    for first in range(0, height, _BAND_ROWS):
        last = min(first + _BAND_ROWS, height)
        places = np.broadcast_arrays(*grid_places(alignment.matrix, slice(first, last), width))
        x, y = (np.round(place).astype(np.int64) for place in places)
        inside = (x >= 0) & (x < flags.shape[1]) & (y >= 0) & (y < flags.shape[0])
        part = resampled[first:last]
        part[inside] = wide[y[inside], x[inside]]
    return resampled


def _within(matrix: Floats, first: int, last: int, width: int, shape: tuple[int, ...]) -> Mask:
    x, y = grid_places(matrix, slice(first, last), width)
    return np.asarray((x >= 1) & (x <= shape[1] - 2) & (y >= 1) & (y <= shape[0] - 2))


def _rows_seen(matrix: Floats, first: int, last: int, width: int, height: int) -> tuple[int, int]:
    corners = np.array([[0, first], [width - 1, first], [0, last - 1], [width - 1, last - 1]], dtype=np.float64)
    y = mapped(matrix, corners)[:, 1]
    top = int(np.clip(np.floor(y.min()) - _BEYOND, 0, height - 1))
    return top, int(np.clip(np.ceil(y.max()) + _BEYOND + 1, top + 1, height))


def _down(by: float) -> Floats:
    return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, by], [0.0, 0.0, 1.0]])
