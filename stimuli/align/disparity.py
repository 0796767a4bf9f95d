"""The disparity of a pair, block by block: how far sparkles, edges and slopes lie from the plane of the screen.

Each block is registered on its own. A block without texture, or whose best shift noise would reach as well, is left out
and counted: it has no disparity, and a guess for it would widen the range.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.display import disparity_arcmin, mm_from_px, visual_angle_deg
from documents.arrays import Floats, Floats32
from documents.text import JsonResult
from stimuli.align.phase import correlation, find_peak, hann
from stimuli.align.planes import LEAST_SIDE_PX, is_flat, light_plane, same_size, texture
from stimuli.align.registration import refine_within
from stimuli.align.roll_scale import RollScale, fit_roll_scale
from stimuli.errors import StimulusError

BLOCK_PX = 64
# Of a block, by its floor. A block of 32 pixels has few cells to know its floor by: there 1 of 4096 passed.
FALSE_ALARM = 1e-5
PERCENTILES = (2.5, 97.5)


@dataclass(frozen=True, slots=True)
class Viewing:
    """How a pair is seen: the pitch of its pixels on the screen, the distance, and that between the eyes."""

    pixel_pitch_mm: float
    distance_mm: float
    interpupillary_distance_mm: float = 65.0


@dataclass(frozen=True, slots=True)
class BlockSpread(JsonResult):
    """Median, 2.5th and 97.5th percentile, and both ends of the blocks' disparities, in one unit."""

    median: float
    low: float
    high: float
    least: float
    most: float

    @classmethod
    def of(cls, values: Floats) -> BlockSpread:
        """Return the spread of ``values`` (n,), n at least 1."""
        low, median, high = np.percentile(values, [PERCENTILES[0], 50.0, PERCENTILES[1]])
        return cls(float(median), float(low), float(high), float(values.min()), float(values.max()))


@dataclass(frozen=True, eq=False, slots=True)
class DisparityReport(JsonResult):
    """Disparities of a pair's blocks: the right eye's place minus the left eye's, positive behind the screen.

    ``middle_px``, ``disparity_px`` and its ``standard_error_px``, (n, 2) each, across and down, are of the ``used``
    blocks alone, and so is ``false_alarm`` (n,), the chance that noise gives such a block: with the standard errors it
    says how much of the spread is the measurement's own. ``flat`` blocks have no texture, in ``uncertain``
    ones nothing rises above noise. ``horizontal`` and ``vertical`` hold a `BlockSpread` for each unit that is known:
    ``px``, and with a `Viewing` ``mm`` and ``arcmin``; they are empty where no block was used. ``roll_scale`` is how
    far the right view is turned or larger, None where too few blocks have a disparity.
    """

    block_px: int
    middle_px: Floats
    disparity_px: Floats
    standard_error_px: Floats
    false_alarm: Floats
    flat: int
    uncertain: int
    horizontal: Mapping[str, BlockSpread]
    vertical: Mapping[str, BlockSpread]
    roll_scale: RollScale | None
    json_names: ClassVar = "block_px blocks used flat uncertain median_standard_error_px horizontal vertical roll_scale"

    @property
    def used(self) -> int:
        """How many blocks have a disparity."""
        return len(self.disparity_px)

    @property
    def blocks(self) -> int:
        """How many blocks were looked at."""
        return self.used + self.flat + self.uncertain

    @property
    def median_standard_error_px(self) -> Floats | None:
        """The median standard error across and down, (2,); None where no block was used."""
        return np.median(self.standard_error_px, axis=0) if self.used else None


def measure_disparity(
    left: NDArray[Any],
    right: NDArray[Any],
    *,
    luminance_weights: ArrayLike | None = None,
    block_px: int = BLOCK_PX,
    viewing: Viewing | None = None,
    false_alarm: float = FALSE_ALARM,
) -> DisparityReport:
    """Return the disparities of an aligned pair by squares, up to a quarter of a square either way.

    Parameters
    ----------
    left, right
        Linear light, (height, width) or (height, width, 3).
    luminance_weights
        (3,): what the channels weigh; without it, the second channel is taken, which is Y of XYZ.
    block_px
        The side of a square, 32 or more.
    viewing
        How the pair is seen, so that disparities are reported in millimetres and minutes of arc too.
    false_alarm
        The probability with which a square of noise has a disparity.

    Returns
    -------
    DisparityReport
        The disparities of the squares in pixels, positive behind the screen, and their spread.

    Raises
    ------
    StimulusError
        If the pictures differ in size, hold NaN, or are smaller than a square; if a square is smaller than 32 pixels.

    Examples
    --------
    >>> texture = np.random.default_rng(1).uniform(1, 20, (128, 132))
    >>> report = measure_disparity(texture[:, 3:131], texture[:, :128])  # 3 pixels behind the screen
    >>> report.used, round(report.horizontal["px"].median, 3)
    (4, 3.0)
    """
    left_plane, right_plane = (
        light_plane(left, luminance_weights, "left"),
        light_plane(right, luminance_weights, "right"),
    )
    same_size(left_plane, right_plane, ("left", "right"))
    if not LEAST_SIDE_PX <= block_px <= min(left_plane.shape):
        raise StimulusError.of(
            f"block_px is {block_px}", f"between {LEAST_SIDE_PX} and the picture's side, {min(left_plane.shape)}"
        )
    return _report(_Blocks(left_plane, right_plane, block_px, false_alarm), viewing)


class _Blocks:
    """The blocks of a pair of planes, row by row."""

    def __init__(self, left: Floats32, right: Floats32, block_px: int, false_alarm: float) -> None:
        self.block_px = block_px
        self.size_px = (left.shape[1], left.shape[0])
        self.flat = self.uncertain = 0
        self.measured: list[tuple[float, ...]] = []
        left_texture, right_texture = texture(left), texture(right)
        columns, rows = (length // block_px for length in (left.shape[1], left.shape[0]))
        # What is over at the edges is shared between both sides.
        first = [
            (length - count * block_px) // 2 for length, count in ((left.shape[1], columns), (left.shape[0], rows))
        ]
        window = np.outer(hann(block_px), hann(block_px))
        for row in range(rows):
            top = first[1] + row * block_px
            places = [(first[0] + column * block_px, top) for column in range(columns)]
            kept = []
            for x, y in places:
                part = (slice(y, y + block_px), slice(x, x + block_px))
                if is_flat(left[part], left[part]) or is_flat(right[part], right[part]):
                    self.flat += 1
                else:
                    kept.append((x, y))
            if kept:
                stacks = [
                    np.stack([plane[y : y + block_px, x : x + block_px] for x, y in kept]) * window
                    for plane in (left_texture, right_texture)
                ]
                for (x, y), surface in zip(kept, correlation(stacks[0], stacks[1]), strict=True):
                    self._register(left_texture, right_texture, (x, y), surface, false_alarm)

    def _register(
        self, left: Floats32, right: Floats32, corner: tuple[int, int], surface: Floats32, false_alarm: float
    ) -> None:
        x, y = corner
        side = self.block_px
        peak = find_peak(surface, (side // 4, side // 4))
        if peak.false_alarm <= false_alarm:
            start = (float(peak.shift_px[0]), float(peak.shift_px[1]))
            fit = refine_within(left, right, (x, y, x + side, y + side), start)
            if fit.converged and fit.correlation > 0:
                middle = (x + (side - 1) / 2, y + (side - 1) / 2)
                self.measured.append((*middle, *fit.shift_px, *fit.standard_error_px, peak.false_alarm))
                return
        self.uncertain += 1


def _report(blocks: _Blocks, viewing: Viewing | None) -> DisparityReport:
    table = np.array(blocks.measured, dtype=np.float64).reshape(-1, 7)
    across, down = table[:, 2], table[:, 3]
    horizontal: dict[str, BlockSpread] = {}
    vertical: dict[str, BlockSpread] = {}
    if len(table):
        horizontal["px"], vertical["px"] = BlockSpread.of(across), BlockSpread.of(down)
    if len(table) and viewing is not None:
        pitch, distance = viewing.pixel_pitch_mm, viewing.distance_mm
        horizontal["mm"], vertical["mm"] = (
            BlockSpread.of(mm_from_px(disparity_px, pitch)) for disparity_px in (across, down)
        )
        eyes = viewing.interpupillary_distance_mm
        horizontal["arcmin"] = BlockSpread.of(disparity_arcmin(across, pitch, distance, eyes))
        vertical["arcmin"] = BlockSpread.of(60.0 * visual_angle_deg(mm_from_px(down, pitch), distance))
    return DisparityReport(
        blocks.block_px,
        table[:, :2],
        table[:, 2:4],
        table[:, 4:6],
        table[:, 6],
        blocks.flat,
        blocks.uncertain,
        horizontal,
        vertical,
        fit_roll_scale(table[:, :2], down, blocks.size_px),
    )
