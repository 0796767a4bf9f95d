"""Which flakes can matter: the rest are dropped before they are shaded, by a bound that is exact.

A flake of normal n sends an eye the share exp((n·h − 1)/σ²) of its lobe's peak, h the half-way direction between eye
and lamp inside the coat. It matters if that share is τ or more: if the angle between n and h is at most α, where
cos α = 1 − σ² ln(1/τ). With the widest σ of any flake anywhere on the plate, none that matters has a wider angle.

h changes over the plate. Let a place lie within ρ of a tile's middle, and nowhere in the tile nearer to the eye than r
or to the lamp than s:

1. Along the line from the middle, the direction to the eye turns by at most ρ/r, that to the lamp by at most ρ/s (a
   step dx turns a ray of length r by at most dx/r).
2. In the coat of index m these turns are at most 1/m as large: Snell's law divides a turn about the normal's azimuth,
   sin θ dφ, by m, and one towards the normal, dθ, by m cos θ'/cos θ, where θ' ≤ θ.
3. h = (v + l)/|v + l| turns by at most (dv + dl)/|v + l|, and |v + l| is at least the sum of both vectors' heights
   over the plate, whose least values in the tile are those at its greatest distance from eye and lamp.

So h lies within β = ρ (1/r + 1/s) / (m (v_z + l_z)) of the middle's, and a flake that matters has its normal within
γ = α + β of h there. On the plane of slopes that cap is an ellipse, whose long axis points away from the origin, from
tan(θ − γ) to tan(θ + γ) with θ the zenith angle of h. The circle on that axis holds the ellipse. A flake outside the
circle of the whole plate, or else outside that of its tile, is dropped. Circles are wider by 1e-5 than they
would have to be, for slopes are kept as float32. A cap that reaches the horizon has no circle: then all are kept.

A tile to which the lamp sends less than the share τ of its illuminance in the plate's middle, wherever in the tile one
looks, is dark: its flakes send less than τ of what they would send from the middle at their lobe's peak, and are
dropped as well. A near lamp's beam leaves such tiles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats
from extensions.sparkle.flakes import Flakes
from extensions.sparkle.lamplight import lamp_directions, most_illuminance_lx, nearest_mm
from extensions.sparkle.optics import half_way, refract, view_directions, widest_lobe_sd
from extensions.sparkle.scene import Camera, Lamp, Plate

Indices = NDArray[np.int64]

# Dropped flakes send the eye less than this share of their lobe's peak. On the grey plate in configs/stimuli that is
# below 0.001 cd/m² in the camera pixel of even an 80 µm flake, on a base of 3.6 cd/m².
LEAST_LOBE_SHARE = 1e-6
_SLACK = 1e-5

TILE_PX = 256


def that_matter(
    flakes: Flakes, plate: Plate, lamp: Lamp, eye_mm: Floats, tiles: Tiles, least_share: float = LEAST_LOBE_SHARE
) -> Indices:
    """Return the indices of flakes that may send the eye at ``eye_mm`` (3,) ``least_share`` of their lobe's peak.

    Flakes of tiles that no light reaches (see `lit`) are not among them.
    """
    light = lit(tiles, lamp, least_share)
    centre, radius = slope_circles(whole(plate), plate, lamp, eye_mm, least_share)
    near = np.arange(len(flakes))
    if np.isfinite(radius[0]):
        near = np.flatnonzero(_within(flakes.slope_x, flakes.slope_y, centre, radius))
    centres, radii = slope_circles(tiles, plate, lamp, eye_mm, least_share)
    tile = tiles.of_places(flakes.x_mm[near], flakes.y_mm[near])
    matters = _within(flakes.slope_x[near], flakes.slope_y[near], centres[tile], radii[tile])
    return near[matters] if light.all() else near[matters & light[tile]]


def lit(tiles: Tiles, lamp: Lamp, least_share: float) -> NDArray[np.bool_]:
    """Return which tiles (tiles,) may get ``least_share`` or more of the illuminance in the plate's middle."""
    x, y, reach = tiles.middles_mm()
    return np.asarray(most_illuminance_lx(lamp, x, y, reach * (1 + _SLACK)) >= least_share * lamp.illuminance_lx)


def slope_circles(tiles: Tiles, plate: Plate, lamp: Lamp, eye_mm: Floats, least_share: float) -> tuple[Floats, Floats]:
    """Return the circles that hold the slopes of flakes that matter: centres (tiles, 2) and radii (tiles,).

    The radius is infinite where there is none.
    """
    x, y, reach = tiles.middles_mm()
    reach = reach * (1 + _SLACK)
    index = plate.coat_refractive_index
    view, light = view_directions(x, y, eye_mm), np.broadcast_to(lamp_directions(lamp, x, y), (len(x), 3))
    h = half_way(refract(view, index), refract(light, index))
    to_eye = np.sqrt((eye_mm[0] - x) ** 2 + (eye_mm[1] - y) ** 2 + eye_mm[2] ** 2)
    # r and s of step 1: the least distances within the tile.
    eye_near, lamp_near = np.maximum(to_eye - reach, eye_mm[2]), nearest_mm(lamp, x, y, reach)
    # v_z + l_z of step 3, at the tile's greatest distance from eye and lamp.
    height = _least_height(eye_mm[2] / (to_eye + reach), index)
    position = lamp.position_mm
    if position is None:
        height = height + refract(lamp.direction, index)[2]
    else:
        away = np.sqrt((position[0] - x) ** 2 + (position[1] - y) ** 2 + position[2] ** 2)
        height = height + _least_height(position[2] / (away + reach), index)
    # β = ρ (1/r + 1/s) / (m (v_z + l_z)); cos α = 1 − σ² ln(1/τ); γ = α + β, from tan(θ − γ) to tan(θ + γ).
    beta = reach * (1.0 / eye_near + 1.0 / lamp_near) / (index * height)
    square = -(widest_lobe_sd(plate, lamp) ** 2) * np.log(least_share)
    alpha = np.arccos(1.0 - square) if square < 2 else np.pi
    zenith = np.arctan2(np.hypot(h[:, 0], h[:, 1]), h[:, 2])
    gamma = (alpha + beta) * (1 + _SLACK)
    bounded = zenith + gamma < np.pi / 2 - 1e-3
    outer, inner = (np.tan(np.where(bounded, zenith + sign * gamma, 0.0)) for sign in (1, -1))
    radius = np.where(bounded, 0.5 * (outer - inner) * (1 + _SLACK) + _SLACK, np.inf)
    away_xy = h[:, :2] / np.maximum(np.hypot(h[:, 0], h[:, 1]), 1e-300)[:, None]
    return 0.5 * (outer + inner)[:, None] * away_xy, radius


def _least_height(cosine: Floats, refractive_index: float) -> Floats:
    """Return the height in the coat of a unit vector whose height outside is ``cosine``."""
    # Snell: sin θ' = sin θ / m, and sin² + cos² = 1.
    return np.asarray(np.sqrt(1.0 - (1.0 - cosine**2) / refractive_index**2))


def _within(
    slope_x: NDArray[np.float32], slope_y: NDArray[np.float32], centre: Floats, radius: Floats
) -> NDArray[np.bool_]:
    along, across = slope_x - centre[:, 0].astype(np.float32), slope_y - centre[:, 1].astype(np.float32)
    along *= along
    across *= across
    along += across
    return np.asarray(along <= (radius**2).astype(np.float32))


@dataclass(frozen=True, slots=True)
class Tiles:
    """Tiles of ``tile_px`` camera pixels a side; those at the right and at the bottom may be smaller.

    Tiles are counted from the top left, row by row.
    """

    width_mm: float
    height_mm: float
    columns_px: int
    rows_px: int
    tile_px: int

    @property
    def columns(self) -> int:
        """Tiles from left to right."""
        return -(-self.columns_px // self.tile_px)

    @property
    def rows(self) -> int:
        """Tiles from top to bottom."""
        return -(-self.rows_px // self.tile_px)

    def __len__(self) -> int:
        return self.columns * self.rows

    def of_pixels(self, across_px: Floats, down_px: Floats) -> NDArray[np.int64]:
        """Return the tile (n,) that each place on the pixel grid, (n,) each, lies in, or the one next to it."""
        # What lies outside is cut towards the first tile or clipped to the last.
        column = np.clip((across_px * (1.0 / self.tile_px)).astype(np.int64), 0, self.columns - 1)
        row = np.clip((down_px * (1.0 / self.tile_px)).astype(np.int64), 0, self.rows - 1)
        return row * self.columns + column

    def of_places(self, x_mm: NDArray[np.float32], y_mm: NDArray[np.float32]) -> NDArray[np.int64]:
        """Return the tile (n,) that each place on the plate lies in."""
        across = (x_mm.astype(np.float64) + 0.5 * self.width_mm) * (self.columns_px / self.width_mm)
        down = (0.5 * self.height_mm - y_mm.astype(np.float64)) * (self.rows_px / self.height_mm)
        return self.of_pixels(across, down)

    def middles_mm(self) -> tuple[Floats, Floats, Floats]:
        """Return x and y of each tile's middle, and how far its corners lie from there, in mm; (tiles,) each."""
        left, right = self._edges(self.columns_px, self.columns)
        top, bottom = self._edges(self.rows_px, self.rows)
        column_mm, row_mm = self.width_mm / self.columns_px, self.height_mm / self.rows_px
        x = 0.5 * (left + right) * column_mm - 0.5 * self.width_mm
        y = 0.5 * self.height_mm - 0.5 * (top + bottom) * row_mm
        half_width, half_height = 0.5 * (right - left) * column_mm, 0.5 * (bottom - top) * row_mm
        reach = np.hypot(half_width[None, :], half_height[:, None])
        return np.tile(x, self.rows), np.repeat(y, self.columns), reach.ravel()

    def _edges(self, pixels: int, tiles: int) -> tuple[Floats, Floats]:
        first = np.arange(tiles, dtype=np.float64) * self.tile_px
        return first, np.minimum(first + self.tile_px, pixels)


def tiles_of(plate: Plate, camera: Camera, tile_px: int = TILE_PX) -> Tiles:
    """Return the plate's tiles in the camera's pixels."""
    columns, rows = camera.grid_px(plate)
    return Tiles(plate.width_mm, plate.height_mm, columns, rows, tile_px)


def whole(plate: Plate) -> Tiles:
    """Return the plate as one tile."""
    return Tiles(plate.width_mm, plate.height_mm, 1, 1, 1)
