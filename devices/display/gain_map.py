"""How evenly a panel shines: a grid of luminance readings, and the correction that makes it even.

What the panel sends at a place is gain(x, y) times what the display model says, black included: the backlight and the
viewing angle dim both alike. The room's light that it reflects is not dimmed. The gain is the readings relative to the
panel's centre, where the model was measured, bilinear between them. Thesis Section 3.2.1.3 and Figure 3.7, whose
"percent" are differences in cd/m² times 100; its readings relative to the centre are 0.44 to 1.12.

Places are in physical pixels of the panel, x to the right and y down: pixel column i spans i..i + 1, its middle is at
i + 0.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.errors import DeviceError
from documents.arrays import Floats

Positions = Literal["cells", "corners"]
Normalise = Literal["minimum", "centre"]


@dataclass(frozen=True, eq=False)
class GainMap:
    """Luminance readings over a panel, and what to make of them.

    ``luminance``: shape (rows, columns), top row first, in cd/m² or any other unit that they share. ``positions``: with
    ``cells`` the panel is divided into rows × columns equal cells and each reading was taken in the middle of its cell
    (beyond the outermost readings the gain stays what it is there); with ``corners`` the outermost readings were taken
    at the panel's edges. ``normalise``: ``centre`` shows what was asked, and clips where the panel is too dim for it;
    ``minimum`` shows everything darker by the dimmest reading's gain, so that what can be shown at the centre can be
    shown anywhere.

    Raises
    ------
    DeviceError
        If the readings are no grid of finite numbers above 0, or a grid of ``corners`` has fewer than two rows or
        columns, or the resolution is not positive.
    """

    luminance: Floats
    resolution_px: tuple[int, int]
    positions: Positions
    normalise: Normalise

    def __post_init__(self) -> None:
        grid = np.array(self.luminance, dtype=np.float64)
        if grid.ndim != 2 or 0 in grid.shape or not np.all(np.isfinite(grid)) or np.any(grid <= 0):
            raise DeviceError("a gain map needs rows of equally many finite luminances above 0")
        if self.positions == "corners" and min(grid.shape) < 2:
            rows, columns = grid.shape
            raise DeviceError(f"readings at the corners need at least 2 × 2 places, not {rows} × {columns}")
        if min(self.resolution_px) <= 0:
            raise DeviceError(f"a panel of {self.resolution_px} pixels has no places")
        grid.flags.writeable = False
        object.__setattr__(self, "luminance", grid)

    @cached_property
    def gains(self) -> Floats:
        """The readings relative to the panel's centre, shape (rows, columns)."""
        width_px, height_px = self.resolution_px
        centre = self._between(self.luminance, np.array([width_px / 2]), np.array([height_px / 2]))
        return np.asarray(self.luminance / centre[0, 0])

    @property
    def delivered_share(self) -> float:
        """The share of what was asked that is shown, everywhere alike: 1 for ``centre``, the least gain (at most 1)
        for ``minimum``.
        """
        return 1.0 if self.normalise == "centre" else self.reachable_share

    @property
    def luminance_lost(self) -> float:
        """The share of luminance that evenness costs the whole picture, 0..1."""
        return 1.0 - self.delivered_share

    @property
    def reachable_share(self) -> float:
        """The share of the centre's white that the whole panel can show: the least gain, at most 1."""
        return min(1.0, float(self.gains.min()))

    def gain(self, x_px: ArrayLike, y_px: ArrayLike) -> Floats:
        """Return the gain at places of the panel, of the shape that ``x_px`` and ``y_px`` broadcast to.

        A place beyond the panel has the gain of its edge. Raises DeviceError if a place is not finite.
        """
        x, y = np.broadcast_arrays(np.asarray(x_px, dtype=np.float64), np.asarray(y_px, dtype=np.float64))
        rows, columns = self.luminance.shape
        column, across = self._place(x, self.resolution_px[0], columns)
        row, down = self._place(y, self.resolution_px[1], rows)
        right, below = np.minimum(column + 1, columns - 1), np.minimum(row + 1, rows - 1)
        upper = (1 - across) * self.gains[row, column] + across * self.gains[row, right]
        lower = (1 - across) * self.gains[below, column] + across * self.gains[below, right]
        return np.asarray((1 - down) * upper + down * lower)

    def over(self, x_px: ArrayLike, y_px: ArrayLike) -> Floats:
        """Return the gains (len(y_px), len(x_px)) where columns at ``x_px`` cross rows at ``y_px``, both of shape (n,).

        The same as `gain` on the full grid, at the cost of two small matrix products, and with the same errors.
        """
        return self._between(self.gains, np.asarray(x_px, dtype=np.float64), np.asarray(y_px, dtype=np.float64))

    def corrected(self, xyz_cd_m2: ArrayLike, gain: ArrayLike, ambient_XYZ_cd_m2: ArrayLike = 0.0) -> Floats:
        """Return the XYZ (..., 3) to ask of the display model so that the panel shows ``xyz_cd_m2`` evenly.

        ``gain`` has the picture's shape without its last axis. What the observer sees is then `delivered_share` times
        what was asked, above the room's light ``ambient_XYZ_cd_m2``, (3,).
        """
        share = self.delivered_share / np.asarray(gain, dtype=np.float64)
        ambient = np.asarray(ambient_XYZ_cd_m2, dtype=np.float64)
        return np.asarray(ambient + (np.asarray(xyz_cd_m2, dtype=np.float64) - ambient) * share[..., None])

    def _place(self, place_px: Floats, length_px: int, readings: int) -> tuple[NDArray[np.intp], Floats]:
        """Return the reading before each place, and how far on towards the next the place lies (0..1)."""
        if not np.all(np.isfinite(place_px)):
            raise DeviceError("a place on the panel is not a finite number of pixels")
        share = place_px / length_px
        step = share * readings - 0.5 if self.positions == "cells" else share * (readings - 1)
        step = np.clip(step, 0.0, readings - 1.0)
        before = np.minimum(step.astype(np.intp), max(readings - 2, 0))
        return before, step - before

    def _between(self, grid: Floats, x_px: Floats, y_px: Floats) -> Floats:
        rows, columns = self.luminance.shape
        across = self._weights(x_px, self.resolution_px[0], columns)
        down = self._weights(y_px, self.resolution_px[1], rows)
        return np.asarray(down @ grid @ across.T)

    def _weights(self, places_px: Floats, length_px: int, readings: int) -> Floats:
        """Return each reading's weight at each place, shape (places, readings)."""
        before, onward = self._place(places_px, length_px, readings)
        weights = np.zeros((len(places_px), readings))
        index = np.arange(len(places_px))
        weights[index, before] += 1.0 - onward
        weights[index, np.minimum(before + 1, readings - 1)] += onward
        return weights
