"""Random-dot stereograms: four squares in a field of dots, one of them in front of or behind all else [Julesz1971].

Dots are bright Gaussian spots, placed as a Poisson process and laid over each other as ink is: the light between ground
and dot is 1 - Π (1 - spot). The field continues behind the square, and the square hides what it covers, for each eye on
its own: what one eye sees is a Poisson process of one density everywhere, so that nothing in a single view shows where
the square is. Half of the parallax is given to each eye.

Spots are drawn at their places between pixels, in linear light. A Gaussian of a standard deviation of one pixel or more
has next to nothing above the frequency that pixels can carry (0.7 % at one pixel), so that a shift of a fraction of a
pixel is as exact as one of whole pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from documents.arrays import Floats
from extensions.vision_tests.record import Side
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage, XYZImage

TOWARDS: dict[Side, tuple[int, int]] = {"up": (0, -1), "down": (0, 1), "left": (-1, 0), "right": (1, 0)}
_REACH = 3.5  # standard deviations after which a spot is nothing


@dataclass(frozen=True, slots=True)
class DotField:
    """A square field of ``side_px`` with four places for a square of ``target_px``.

    Their middles are ``target_offset_px`` from the field's middle. ``spots_px`` are the standard deviations of the
    spots, across and down, and ``dots`` how many there are.
    """

    side_px: int
    target_px: float
    target_offset_px: float
    spots_px: tuple[float, float]
    dots: int

    def __post_init__(self) -> None:
        if self.target_offset_px < self.target_px / 2 or self.target_offset_px + self.target_px / 2 > self.side_px / 2:
            raise StimulusError("the four squares overlap, or do not lie within the field")

    def middle_px(self, side: Side) -> tuple[float, float]:
        """Return the middle of a square, x to the right and y down from the field's middle."""
        across, down = TOWARDS[side]
        return across * self.target_offset_px, down * self.target_offset_px


def stereogram(
    field: DotField, side: Side, parallax_px: float, ground_XYZ: Floats, dot_XYZ: Floats, seed: str
) -> StereoImage:
    """Return a stereogram in which the square at ``side`` has ``parallax_px``, and all else lies on the screen.

    Parameters
    ----------
    field
        The size of the field and of the square, in pixels, and the dots.
    side
        Where the square is: ``up``, ``down``, ``left`` or ``right`` of the middle.
    parallax_px
        The right eye's place of the square minus the left eye's, in pixels: negative is in front of the screen.
    ground_XYZ, dot_XYZ
        XYZ of ground and dots, (3,), in cd/m².
    seed
        A text: equal texts place equal dots.

    Returns
    -------
    StereoImage
        Both views, XYZ in cd/m², float32 (side_px, side_px, 3).

    Examples
    --------
    >>> field = DotField(side_px=120, target_px=30.0, target_offset_px=35.0, spots_px=(1.5, 1.5), dots=600)
    >>> picture = stereogram(field, "left", -4.0, np.full(3, 5.0), np.full(3, 80.0), seed="trial 1")
    >>> picture.width_px, bool((picture.left[:, 75:] == picture.right[:, 75:]).all())
    (120, True)
    """
    left, right = views(field, side, parallax_px, seed)
    return StereoImage(_lit(left, ground_XYZ, dot_XYZ), _lit(right, ground_XYZ, dot_XYZ))


def views(field: DotField, side: Side, parallax_px: float, seed: str) -> tuple[Floats, Floats]:
    """Return the coverage, 0 to 1 and shape (side_px, side_px), that each eye sees of `stereogram`."""
    rng = np.random.default_rng(np.frombuffer(seed.encode(), dtype=np.uint8))
    # Beyond the field's edges too, so that spots are cut there as a window cuts them.
    half = field.side_px / 2 + _REACH * max(field.spots_px)
    density = field.dots / field.side_px**2
    behind = rng.uniform(-half, half, (rng.poisson(density * (2 * half) ** 2), 2))
    middle = np.asarray(field.middle_px(side))
    on_square = middle + field.target_px * rng.uniform(-0.5, 0.5, (rng.poisson(density * field.target_px**2), 2))
    return _view(field, behind, on_square, middle, -parallax_px / 2), _view(
        field, behind, on_square, middle, parallax_px / 2
    )


def _view(field: DotField, behind: Floats, on_square: Floats, middle: Floats, shift_px: float) -> Floats:
    moved = middle + (shift_px, 0.0)
    hidden = np.all(np.abs(behind - moved) < field.target_px / 2, axis=1)
    return spots(np.concatenate([behind[~hidden], on_square + (shift_px, 0.0)]), field.spots_px, field.side_px)


def spots(places: Floats, spots_px: tuple[float, float], side_px: int) -> Floats:
    """Return 1 - Π (1 - spot), shape (side_px, side_px), for Gaussian spots at ``places`` (n, 2) from the middle."""
    reach = [int(np.ceil(_REACH * spot)) for spot in spots_px]
    seen = np.all(np.abs(places) < side_px / 2 + np.asarray(reach), axis=1)
    corner = places[seen] + (side_px - 1) / 2  # in pixels from the middle of the first
    first = np.round(corner).astype(np.int64)
    steps = [np.arange(-r, r + 1) for r in reach]
    across, down = (
        np.exp(-0.5 * ((first[:, i, None] + steps[i] - corner[:, i, None]) / spots_px[i]) ** 2) for i in (0, 1)
    )
    # The Gaussian's tail is taken down to nothing where it is cut, so that no edge moves by whole pixels.
    floor = np.exp(-0.5 * _REACH**2)
    spot = (down[:, :, None] * across[:, None, :] - floor) / (1.0 - floor)
    np.clip(spot, 0.0, 1.0 - 1e-9, out=spot)
    # On a canvas that is wider all round, so that no spot need be cut at an edge before it is added.
    wide, high = (side_px + 4 * r + 2 for r in reach)
    columns, rows = (first[:, i, None] + steps[i] + 2 * reach[i] + 1 for i in (0, 1))
    index = rows[:, :, None] * wide + columns[:, None, :]
    dark = np.bincount(index.ravel(), np.log1p(-spot).ravel(), wide * high).reshape(high, wide)
    top, left = 2 * reach[1] + 1, 2 * reach[0] + 1
    return np.asarray(-np.expm1(dark[top : top + side_px, left : left + side_px]))


def _lit(coverage: Floats, ground_XYZ: Floats, dot_XYZ: Floats) -> XYZImage:
    light = np.empty((*coverage.shape, 3), dtype=np.float32)
    for channel in range(3):
        light[:, :, channel] = ground_XYZ[channel] + coverage * (dot_XYZ[channel] - ground_XYZ[channel])
    return light
