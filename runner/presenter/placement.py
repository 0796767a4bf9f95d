"""Where on the panel a picture's pixels stand for each eye: what a gain map must know.

Places are in pixels of the panel, x to the right and y down, a pixel's middle at half a pixel. Where the display
stretches a squeezed view back over its panel, the place is that of the view.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.display.display_file import Eye
from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.rectangle import Rectangle, Size
from runner.presenter.scene import Offset

Places = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Placement:
    """A mode on a panel of ``resolution_px`` whose first pixel is the surface's first."""

    mode: Mode
    resolution_px: Size

    def of(self, eye: Eye, size_px: Size, offset_px: Offset) -> tuple[Places, Places]:
        """Return the columns' x (width,) and the rows' y (height,) of a picture shown to ``eye`` at ``offset_px``."""
        area = next(area for area in self.mode.areas(self.resolution_px) if eye in area.eyes)
        moved = offset_px[0] + area.offset_px[0], offset_px[1] + area.offset_px[1]
        place = _view(area).centred(size_px, moved)
        x: Places = np.arange(place.left, place.left + place.width, dtype=np.float64) + 0.5
        y: Places = np.arange(place.top, place.top + place.height, dtype=np.float64) + 0.5
        whole = _view(area)
        if area.mirror[0]:
            x = 2 * whole.left + whole.width - x
        if area.mirror[1]:
            y = 2 * whole.top + whole.height - y
        return x, y


def _view(area: EyeArea) -> Rectangle:
    if area.squeeze == (1, 1):
        return area.rectangle
    return Rectangle(0, 0, *area.view_px)
