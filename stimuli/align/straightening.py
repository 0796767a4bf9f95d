"""A pair whose cameras were rolled against each other, or saw at different scales, made as if they had not been."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats, Floats32
from stimuli.align.disparity import BLOCK_PX, measure_disparity
from stimuli.align.homography import common_part
from stimuli.align.planes import LEAST_SIDE_PX, Region, binned, light_plane, same_size
from stimuli.align.registration import register_planes
from stimuli.align.roll_scale import RollScale
from stimuli.align.subpixel import MOST_PIXELS
from stimuli.align.warping import warp
from stimuli.errors import StimulusError
from stimuli.pictures.stereo_image import StereoImage, XYZImage

# At the worst corner: less is not worth an interpolation.
LEAST_CORNER_PX = 0.05
_ROUNDS = 4
# A step that moves the corners by less is the last: what it leaves is a small part of it.
_CONVERGED_PX = 0.03
# Where the corners were moved by less, the shift has not changed by as much as blocks allow for.
_SAME_SHIFT_PX = 4.0
# Of the picture's sides: what to register by where a roll leaves no one shift over the whole.
_MIDDLE_PARTS = (3, 5, 8)


@dataclass(frozen=True, eq=False, slots=True)
class StraightenedPair:
    """A pair without roll and scale between its views, cropped to what both hold, and the shift left for `align_pair`.

    ``roll_scale`` is what was measured. It is undone, and ``applied`` true, if it is certain and reaches a twentieth of
    a pixel in the corners; else the views are returned as they were. ``crop`` is the part kept: first column, first
    row, column and row after the last.
    """

    left: XYZImage
    right: XYZImage
    roll_scale: RollScale
    applied: bool
    crop: tuple[int, int, int, int]
    steps: tuple[Mapping[str, Any], ...]

    @property
    def stereo(self) -> StereoImage:
        """The pair as a picture for two eyes."""
        return StereoImage(self.left, self.right)


def straighten(
    left: NDArray[Any],
    right: NDArray[Any],
    *,
    offset_px: tuple[float, float] | None = None,
    region: Region | None = None,
    most_px: tuple[int, int] | None = None,
) -> StraightenedPair:
    """Return a pair, linear XYZ or RGB (height, width, 3), with the roll and the scale between its views undone.

    Each view takes half of it, about the middle of the picture, by a cubic spline in linear light. ``region``
    and ``most_px`` are as in `align_pair`; the shift between the views is found on the way, or
    given by ``offset_px`` to about a tenth of a block of 64 pixels, and left as it is. Views of more than four million
    pixels are averaged down to measure.

    Parameters
    ----------
    left, right
        The views of both eyes, linear XYZ or RGB in any unit, of one shape (height, width, 3).
    offset_px
        The shift of the right view against the left one, across and down, in pixels; None finds it.
    region
        The part by which the views are registered: first column, first row, column and row after the last; None takes
        all of them.
    most_px
        The largest shift to look for, across and down, in pixels.

    Returns
    -------
    StraightenedPair
        Both views, cropped to what they share, the roll in degrees and the scale between them, and whether they were
        undone.

    Raises
    ------
    StimulusError
        If the views cannot be registered (see `register`), or too few blocks have a vertical disparity.

    Examples
    --------
    >>> from scipy.ndimage import gaussian_filter
    >>> noise = np.random.default_rng(1).uniform(1, 20, (400, 400))
    >>> light = np.repeat(gaussian_filter(noise, 1.5)[:, :, None], 3, axis=2).astype(np.float32)
    >>> larger = warp(light, np.diag([1.01, 1.01, 1.0]), (400, 400)).picture
    >>> straightened = straighten(light, larger)
    >>> straightened.applied, round(straightened.roll_scale.scale, 3)
    (True, 0.99)
    """
    planes = [light_plane(view, None, name) for view, name in ((left, "left"), (right, "right"))]
    if left.ndim != 3 or right.ndim != 3:
        raise StimulusError.of("a pair to straighten has one channel", "give (height, width, 3), XYZ or RGB")
    same_size(left, right, ("left", "right"))
    height, width = left.shape[:2]
    bin_px = int(np.ceil(np.sqrt(planes[0].size / MOST_PIXELS)))
    planes = [binned(plane, bin_px) for plane in planes]
    search = _Search(offset_px, region, most_px).binned(bin_px)
    matrix = np.eye(2)
    measured: RollScale | None = None
    shift: tuple[float, float] | None = None
    for _ in range(_ROUNDS):
        left_plane, right_plane = _turned(planes, matrix)
        if shift is None or measured is None or measured.corner_px > _SAME_SHIFT_PX:
            shift = search.shift(left_plane, right_plane)
        now = _measured(left_plane, right_plane, shift)
        matrix = _similarity(now.roll_deg, now.scale) @ matrix
        # The last round says how much was left, and so how certain the whole is.
        measured = now
        if now.corner_px < _CONVERGED_PX or not now.certain:
            break
    assert measured is not None
    growth, turn = float(matrix[0, 0]), float(matrix[1, 0])
    whole = RollScale(
        float(np.degrees(np.arctan2(turn, growth))),
        measured.roll_se_deg,
        float(np.hypot(growth, turn)),
        measured.scale_se,
        measured.middle_px * bin_px,
        (abs(turn) * (width - 1) + abs(growth - 1) * (height - 1)) / 2,
        measured.residual_px * bin_px,
        measured.blocks,
    )
    applied = whole.certain and whole.corner_px >= LEAST_CORNER_PX
    step: dict[str, Any] = {"step": "straighten", "applied": applied, **whole.to_json()}
    if not applied:
        views = [np.asarray(view, dtype=np.float32) for view in (left, right)]
        return StraightenedPair(views[0], views[1], whole, False, (0, 0, width, height), (step,))
    halves = _halves(matrix, width, height)
    crop = common_part(halves, width, height, "the roll is too large: mark points instead, or level the cameras")
    moved = np.array([[1.0, 0.0, crop[0]], [0.0, 1.0, crop[1]], [0.0, 0.0, 1.0]])
    size = (crop[2] - crop[0], crop[3] - crop[1])
    warped = [
        warp(np.asarray(view, dtype=np.float32), half @ moved, size)
        for view, half in zip((left, right), halves, strict=True)
    ]
    step |= {
        "crop": list(crop),
        "negative_px_set_to_0": {"left": warped[0].negative_px, "right": warped[1].negative_px},
    }
    return StraightenedPair(warped[0].picture, warped[1].picture, whole, True, crop, (step,))


def _measured(left_plane: Floats32, right_plane: Floats32, shift: tuple[float, float]) -> RollScale:
    """Return roll and scale of a pair of planes, about the middle of what both show at a shift."""
    height, width = left_plane.shape
    across, down = (round(part) for part in shift)
    left, right = max(0, -across), min(width, width - across)
    top, bottom = max(0, -down), min(height, height - down)
    if min(right - left, bottom - top) < LEAST_SIDE_PX:
        raise StimulusError.of(f"a shift of ({across}, {down}) px leaves too little in common", "give another shift")
    report = measure_disparity(
        left_plane[top:bottom, left:right],
        right_plane[top + down : bottom + down, left + across : right + across],
        block_px=min(BLOCK_PX, right - left, bottom - top),
    )
    if report.roll_scale is None:
        raise StimulusError.of(
            f"{report.used} of {report.blocks} blocks have a vertical disparity: too few, or all along one line",
            "a roll needs texture over the whole picture: align by the shift alone",
        )
    return report.roll_scale


@dataclass(frozen=True, slots=True)
class _Search:
    """How the shift between two planes is come by."""

    offset_px: tuple[float, float] | None
    region: Region | None
    most_px: tuple[int, int] | None

    def binned(self, bin_px: int) -> _Search:
        """Return the search on planes averaged over squares of ``bin_px``."""
        offset, region, most = self.offset_px, self.region, self.most_px
        return _Search(
            offset and (offset[0] / bin_px, offset[1] / bin_px),
            region and (region[0] // bin_px, region[1] // bin_px, region[2] // bin_px, region[3] // bin_px),
            most and (-(-most[0] // bin_px), -(-most[1] // bin_px)),
        )

    def shift(self, left: Floats32, right: Floats32) -> tuple[float, float]:
        """Return the shift; where a roll blurs it over the whole, that of the middle."""
        if self.offset_px is not None:
            return self.offset_px
        try:
            return self._registered(left, right, self.region)
        except StimulusError:
            if self.region is not None:
                raise
            height, width = left.shape
            for parts in _MIDDLE_PARTS:
                across, down = (round(0.5 * length * (1 - 1 / parts)) for length in (width, height))
                if min(width - 2 * across, height - 2 * down) < LEAST_SIDE_PX:
                    break
                with contextlib.suppress(StimulusError):
                    return self._registered(left, right, (across, down, width - across, height - down))
            raise

    def _registered(self, left: Floats32, right: Floats32, region: Region | None) -> tuple[float, float]:
        return register_planes(left, right, region=region, most_px=self.most_px, names=("left", "right")).shift_px


def _turned(planes: list[Floats32], matrix: Floats) -> list[Floats32]:
    if np.array_equal(matrix, np.eye(2)):
        return planes
    height, width = planes[0].shape
    return [
        warp(plane[..., None], half, (width, height)).picture[..., 0]
        for plane, half in zip(planes, _halves(matrix, width, height), strict=True)
    ]


def _similarity(roll_deg: float, scale: float) -> Floats:
    angle = np.radians(roll_deg)
    return scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _halves(matrix: Floats, width: int, height: int) -> list[Floats]:
    """Return the homographies from the straight pair's places to the left view's and to the right view's."""
    roll_deg = float(np.degrees(np.arctan2(matrix[1, 0], matrix[0, 0]))) / 2
    half = _similarity(roll_deg, float(np.sqrt(np.hypot(matrix[0, 0], matrix[1, 0]))))
    middle = (np.array([width, height]) - 1) / 2
    homographies = []
    for linear in (np.linalg.inv(half), half):
        homography = np.eye(3)
        homography[:2, :2] = linear
        homography[:2, 2] = middle - linear @ middle
        homographies.append(homography)
    return homographies
