"""Pseudoisochromatic plates: a Landolt ring of dots that differ from the dots around them in colour alone.

As in the Cambridge Colour Test [Regan1994]: dots of several sizes hide the ring's outline, and each dot's light is
scaled at random, so that lightness tells nothing. The ring's colour lies on the ground's confusion line; as it is mixed
(see `confusion_lines`), every cone that the dichromat has answers to ring and ground alike, dot for dot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stimuli.errors import StimulusError
from stimuli.pictures.stereo_image import StereoImage
from stimuli.vision_tests.confusion_lines import Axis, confused
from stimuli.vision_tests.dot_packing import packed
from stimuli.vision_tests.optotypes import in_ring
from stimuli.vision_tests.random_dots import Side
from stimuli.vision_tests.shown_range import ShownRange

Floats = NDArray[np.float64]
# Each dot's light, as a multiple of the mean: six steps, as far apart as 0.6 to 1.4.
SCALES = tuple(0.6 + 0.16 * step for step in range(6))
GROUND_SHARE = 0.45  # of the range from black to white
_SIZES = (0.042, 0.034, 0.027, 0.02)  # the dots' radii, as shares of the plate's
_GAP = 0.008
_RING = 0.92  # the ring's outer radius, as a share of the plate's reach for it
_REACH = 0.72


@dataclass(frozen=True)
class Plate:
    """How plates look: ``side_px`` wide, on black, in greys and colours of ``shown``."""

    side_px: int
    shown: ShownRange

    @property
    def ground_XYZ(self) -> Floats:
        """The mean of the ground's dots in cd/m², shape (3,)."""
        return self.shown.grey(GROUND_SHARE)

    def colour(self, axis: Axis, delta_uv: float) -> Floats:
        """Return the mean of the ring's dots in cd/m², shape (3,), ``delta_uv`` along a confusion line."""
        return confused(axis, self.ground_XYZ, delta_uv)

    def can_show(self, axis: Axis, delta_uv: float) -> bool:
        """Return whether ring and ground, in their lightest and darkest dots, are within the gamut of both eyes."""
        try:
            colour = self.colour(axis, delta_uv)
        except StimulusError:
            return False
        return self.shown.holds(np.outer(SCALES, colour)) and self.shown.holds(np.outer(SCALES, self.ground_XYZ))

    def draw(self, side: Side, ring_XYZ: Floats, seed: str) -> StereoImage:
        """Return a plate whose ring, open towards ``side``, has dots of ``ring_XYZ`` in the mean; both eyes alike."""
        places, radii, in_figure = self.dots(side, seed)
        rng = _rng(f"{seed}/light")
        scales = rng.choice(SCALES, len(places))
        colours = np.where(in_figure[:, None], ring_XYZ, self.ground_XYZ) * scales[:, None]
        return StereoImage.flat(_discs(places, radii, colours, self.side_px, self.shown.black_XYZ_cd_m2))

    def dots(self, side: Side, seed: str) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Return middles (n, 2) and radii (n,) of the dots in pixels from the middle, and which are the ring's."""
        half = self.side_px / 2
        places, radii = packed(half, tuple(half * size for size in _SIZES), half * _GAP, _rng(seed))
        gap = half * _REACH * _RING / 2.5
        return places, radii, in_ring(places[:, 0], places[:, 1], gap, side)


def _rng(seed: str) -> np.random.Generator:
    return np.random.default_rng(np.frombuffer(seed.encode(), dtype=np.uint8))


def _discs(places: Floats, radii: Floats, colours: Floats, side_px: int, ground_XYZ: Floats) -> NDArray[np.float32]:
    """Return discs on a ground, each pixel mixed by how much of it they cover, to about a hundredth of the pixel."""
    picture = np.zeros((3, side_px * side_px))
    for radius in np.unique(radii):
        same = radii == radius
        index, share, which = _covered(places[same], float(radius), side_px)
        for channel in range(3):
            light = (colours[same, channel] - ground_XYZ[channel])[which]
            picture[channel] += np.bincount(index, share * light, side_px * side_px)
    return (picture.T + ground_XYZ).reshape(side_px, side_px, 3).astype(np.float32)


def _covered(places: Floats, radius: float, side_px: int) -> tuple[NDArray[np.int64], Floats, NDArray[np.int64]]:
    """Return the pixels that discs of one radius cover: index in the picture, share covered, and which disc does."""
    reach = int(np.ceil(radius)) + 1
    steps = np.arange(-reach, reach + 1)
    corner = places + (side_px - 1) / 2
    first = np.round(corner).astype(np.int64)
    across, down = (first[:, i, None] + steps - corner[:, i, None] for i in (0, 1))
    covered = np.clip(radius + 0.5 - np.sqrt(across[:, None, :] ** 2 + down[:, :, None] ** 2), 0.0, 1.0)
    columns, rows = first[:, 0, None] + steps, first[:, 1, None] + steps
    inside = ((rows >= 0) & (rows < side_px))[:, :, None] & ((columns >= 0) & (columns < side_px))[:, None, :]
    which, row, column = np.nonzero(inside & (covered > 0))
    return rows[which, row] * side_px + columns[which, column], covered[which, row, column], which
