"""Pseudoisochromatic plates: a Landolt ring of dots that differ from the dots around them in colour alone.

As in the Cambridge Colour Test [Regan1994]: dots of several sizes hide the ring's outline, and each dot's light is
scaled at random, so that lightness does not reveal the ring. A person who is missing one kind of cones cannot
distinguish the ring's colour from the ground's.

In the CIE 1931 chromaticity diagram such colours lie on lines through one point, the chromaticity of light that the
missing cones alone would answer to. The three points are those of [Wyszecki1982], Section 5.14.2. In XYZ it is simpler:
two lights are the same to a dichromat if they differ by any amount k of the light P that has the missing point's
chromaticity, because no cone that is left answers to it. `confused` adds such light, and thereby moves a colour along
its confusion line without changing anything that the dichromat sees, brightness included: every cone that the dichromat
has answers to ring and ground alike, dot for dot.

The points hold for the average dichromat and for CIE 1931 2°; a person's differ, and so do other tables':
[Smith1975] gives (1.400, -0.400) for deutan in Judd's revised space. For the observers of CIE 170 they follow from cone
fundamentals: `copunctal_xy`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.colour_matching import DEFAULT_OBSERVER, colorimetric_observer, xyz_from_lms
from documents.arrays import Floats
from extensions.vision_tests.optotypes import in_ring
from extensions.vision_tests.record import Side
from extensions.vision_tests.shown_range import ShownRange
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage

# Each dot's light, as a multiple of the mean: six steps, as far apart as 0.6 to 1.4.
SCALES = tuple(0.6 + 0.16 * step for step in range(6))
GROUND_SHARE = 0.45  # of the range from black to white
_SIZES = (0.042, 0.034, 0.027, 0.02)  # the dots' radii, as shares of the plate's
_GAP = 0.008
_RING = 0.92  # the ring's outer radius, as a share of the plate's reach for it
_REACH = 0.72

Axis = Literal["protan", "deutan", "tritan"]
AXES: tuple[Axis, ...] = ("protan", "deutan", "tritan")
COPUNCTAL_XY: Mapping[Axis, tuple[float, float]] = MappingProxyType(
    {"protan": (0.747, 0.253), "deutan": (1.080, -0.080), "tritan": (0.171, 0.0)}
)


@dataclass(frozen=True)
class ConfusionPlate:
    """How plates look: ``side_px`` wide, on black, in greys and colours of ``shown``, by the confusion ``points``."""

    side_px: int
    shown: ShownRange
    points: Mapping[Axis, tuple[float, float]] = field(default_factory=lambda: COPUNCTAL_XY)

    @property
    def ground_XYZ(self) -> Floats:
        """The mean of the ground's dots in cd/m², shape (3,)."""
        return self.shown.grey(GROUND_SHARE)

    def colour(self, axis: Axis, delta_uv: float) -> Floats:
        """Return the mean of the ring's dots in cd/m², shape (3,), ``delta_uv`` along a confusion line."""
        return confused(axis, self.ground_XYZ, delta_uv, self.points)

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


def uv_from_XYZ(xyz: ArrayLike) -> Floats:
    """Return CIE 1976 u', v', shape (..., 2), for XYZ, shape (..., 3)."""
    values = np.asarray(xyz, dtype=np.float64)
    total = values @ (1.0, 15.0, 3.0)
    return np.asarray(values[..., :2] * (4.0, 9.0) / total[..., None])


def copunctal_xy(observer: str = DEFAULT_OBSERVER) -> Mapping[Axis, tuple[float, float]]:
    """Return x, y of the light that only the cones which each dichromat lacks answer to, for an observer.

    Parameters
    ----------
    observer
        The name of a colorimetric observer, such as ``CIE 2015 10``.

    Returns
    -------
    mapping
        For CIE 1931 2° the points of [Wyszecki1982]; else those of the observer's cone fundamentals.

    Raises
    ------
    InputError
        If there is no such observer, or it has no cone fundamentals (CIE 1964 10°).

    Examples
    --------
    >>> {axis: (round(x, 3), round(y, 3)) for axis, (x, y) in copunctal_xy("CIE 2015 2").items()}
    {'protan': (0.738, 0.262), 'deutan': (1.327, -0.327), 'tritan': (0.159, 0.0)}
    """
    seen = colorimetric_observer(observer)
    if seen.name == DEFAULT_OBSERVER:
        return COPUNCTAL_XY
    if seen.name == "CIE 1964 10":
        what = f"{seen.name} has no cone fundamentals, from which confusion lines follow"
        raise StimulusError.of(what, "take CIE 2015 10, or leave the test of colour vision out")
    # The functions of CIE 2015 are those for age 32.
    lights = xyz_from_lms(seen.field_deg, 32.0 if seen.age_years is None else seen.age_years)
    points = (lights / lights.sum(axis=0))[:2].T.tolist()
    return MappingProxyType({axis: (x, y) for axis, (x, y) in zip(AXES, points, strict=True)})


def missing_light(axis: Axis, points: Mapping[Axis, tuple[float, float]] = COPUNCTAL_XY) -> Floats:
    """Return XYZ (3,) with X + Y + Z = 1 of the light to which only the cones that the dichromat lacks answer."""
    x, y = points[axis]
    return np.array([x, y, 1.0 - x - y])


def confused(
    axis: Axis,
    ground_XYZ: ArrayLike,
    delta_uv: float,
    points: Mapping[Axis, tuple[float, float]] = COPUNCTAL_XY,
) -> Floats:
    """Return XYZ (3,) that the dichromat confuses with ``ground_XYZ`` and others see at a distance of it.

    ``delta_uv`` is the distance in CIE 1976 u', v': positive towards the missing point, negative away from it. The
    colour is the ground plus k times the missing light, whose chromaticity ``points`` gives.

    Raises
    ------
    StimulusError
        If there is no such colour: the line ends before.
    """
    ground = np.asarray(ground_XYZ, dtype=np.float64)
    light = missing_light(axis, points)
    weights = np.array([1.0, 15.0, 3.0])
    # u'v' moves along a straight line by s(k) = |a| k / (D + d k), with D and d the denominators of ground and light.
    total, per_k = float(ground @ weights), float(light @ weights)
    start = uv_from_XYZ(ground)
    step = (light[:2] * (4.0, 9.0) - start * per_k) / total  # the derivative at k = 0
    speed = float(np.hypot(*step))
    # A colour at k has moved by speed · k / (1 + k per_k / total).
    denominator = speed - delta_uv * per_k / total
    if denominator <= 0:
        raise StimulusError(f"no colour lies {delta_uv} in u'v' along the {axis} line")
    k = delta_uv / denominator
    if k * per_k / total <= -1:
        raise StimulusError(f"no colour lies {delta_uv} in u'v' along the {axis} line")
    return np.asarray(ground + k * light)


def packed(radius: float, sizes: tuple[float, ...], gap: float, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return middles (n, 2) and radii (n,) of discs within a circle of ``radius`` about 0.

    ``sizes`` are the discs' radii, placed largest first, each into the room that is left; ``gap`` stays free between
    two. The smallest are placed longest, and fill what is left.
    """
    places, radii = np.empty((0, 2)), np.empty(0)
    for size in sorted(sizes, reverse=True):
        smallest = size == min(sizes)
        room = (radius / (size + gap / 2)) ** 2
        for _ in range(8 if smallest else 2):
            count = int(room * (0.5 if smallest else 0.25)) + 8
            angle, distance = rng.uniform(0, 2 * np.pi, count), (radius - size) * np.sqrt(rng.uniform(0, 1, count))
            placed = distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
            placed = placed[_clear(placed, places, radii + size + gap)]
            placed = placed[_first(placed, 2 * size + gap)]
            places = np.concatenate([places, placed])
            radii = np.concatenate([radii, np.full(len(placed), size)])
    return places, radii


def _clear(placed: Floats, places: Floats, apart: Floats) -> NDArray[np.bool_]:
    """Return which of ``placed`` keep their distance from all ``places``."""
    if not len(places):
        return np.ones(len(placed), dtype=bool)
    return np.asarray((_squares(placed, places) >= apart**2).all(axis=1))


def _first(placed: Floats, apart: float) -> NDArray[np.bool_]:
    """Return which of ``placed`` keep their distance from all that were placed before them."""
    near = np.triu(_squares(placed, placed) < apart**2, k=1)
    return np.asarray(~near.any(axis=0))


def _squares(first: Floats, second: Floats) -> Floats:
    """Return the squares of all distances; a product of matrices would wake every processor for so little."""
    squares = np.subtract.outer(first[:, 0], second[:, 0])
    squares *= squares
    down = np.subtract.outer(first[:, 1], second[:, 1])
    down *= down
    squares += down
    return np.asarray(squares)
