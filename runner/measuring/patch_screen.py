"""What a measurement needs of a screen, and the screen that shows colours asked in XYZ as a session shows pictures.

The colours pass the presenter undithered, so that the codes read back are those that a picture of them gets.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from devices.compensation import Correction, Size
from devices.display import Eye, EyeModels
from devices.readings import CodeTriple, Patch, PatchEye, ShownPatch
from documents.arrays import Floats
from runner.presenter.depth import highest_code
from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.presenter import Presenter
from runner.presenter.surfaces.surface import Surface
from runner.scene import Item, Picture, Scene, Text
from stimuli.pictures import StereoImage


def middle_of(area: EyeArea, size_px: Size) -> tuple[float, float]:
    """Return where on a panel of ``size_px`` the middle of an eye's area stands, as shares of it.

    A squeezed view is stretched back over the panel.
    """
    if area.squeeze != (1, 1):
        return 0.5, 0.5
    place = area.rectangle
    return (place.left + place.width / 2) / size_px[0], (place.top + place.height / 2) / size_px[1]


class PatchScreen(Protocol):
    """A screen that shows patches in a stereo mode."""

    surface: Surface

    @property
    def takes_turns(self) -> bool:
        """Whether the eyes see frames in turn, so that `redraw` must be called for every refresh."""

    @property
    def highest(self) -> int:
        """The code of full drive: 255 or 1023."""

    def show_patch(self, patch: Patch, eye: PatchEye) -> ShownPatch:
        """Show ``patch`` from now on in a measurement of ``eye``, and return what stands there."""

    def redraw(self) -> None:
        """Show the patch again, to the next eye where they take turns."""

    def say(self, words: str) -> None:
        """Show ``words`` over the patch until other ones come; none if they are empty."""


class AskedScreen:
    """Shows ``asked`` XYZ, shape (3,) in cd/m² by patch name, over all of each eye's view; codes are read back.

    Crosstalk is cancelled and the panel evened out as ``correction`` says. Raises as `Presenter` does.
    """

    def __init__(
        self, surface: Surface, mode: Mode, models: EyeModels, correction: Correction, asked: Mapping[str, Floats]
    ) -> None:
        self.surface = surface
        self._models = models
        self._asked = asked
        self._presenter = Presenter(surface, mode, models, self._picture, picture_budget_bytes=0, correction=correction)
        areas = self._presenter.areas
        self._view_px = areas[0].view_px
        self._shared = any(len(area.eyes) > 1 for area in areas)
        self._mixed = mode.mixture(models) is not None
        self._turns = 1 + max(area.turn for area in areas)
        self._items: tuple[Item, ...] = ()

    @property
    def takes_turns(self) -> bool:
        """Whether the eyes see frames in turn."""
        return self._turns > 1

    @property
    def highest(self) -> int:
        """The code of full drive: 255 or 1023."""
        return highest_code(self.surface.bits)

    def show_patch(self, patch: Patch, eye: PatchEye) -> ShownPatch:
        """Show the colour asked under the patch's name, and return the codes read back at the middle of each view."""
        shown = patch.eye or eye
        self._items = (Picture(f"{shown}:{patch.name}"),)
        self._show()
        own: Eye = "right" if shown == "right" else "left"
        other: Eye = "left" if own == "right" else "right"
        area = next(area for area in self._presenter.areas if own in area.eyes)
        place = middle_of(area, self.surface.size_px)
        return ShownPatch(self._middle(own), None if self._shared else self._middle(other), place, read_back=True)

    def redraw(self) -> None:
        """Show the patch again, to the next eye where they take turns."""
        self._presenter.redraw()

    def say(self, words: str) -> None:
        """Show ``words`` over the patch until other ones come; none if they are empty."""
        self._items = self._items[:1] + ((Text(words, (0, self._view_px[1] // 3)),) if words else ())
        self._show()

    def close(self) -> None:
        """Free what is held on the graphics card; the surface stays open."""
        self._presenter.close()

    def __enter__(self) -> AskedScreen:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _show(self) -> None:
        self._presenter.show(Scene(self._items))
        for _ in range(self._turns - 1):
            self._presenter.redraw()

    def _picture(self, name: str) -> StereoImage:
        """Return the picture ``EYE:PATCH``: the other eye's view is its black."""
        eye, _, patch = name.partition(":")
        models = self._models
        wanted = self._view(self._asked[patch])
        if eye == "both" or (self._shared and not self._mixed):
            return StereoImage.flat(wanted)
        dark = self._view(models.right.xyz([0.0] * 3) if eye == "left" else models.left.xyz([0.0] * 3))
        return StereoImage(wanted, dark) if eye == "left" else StereoImage(dark, wanted)

    def _view(self, XYZ_cd_m2: Floats) -> NDArray[np.float32]:
        width, height = self._view_px
        return np.broadcast_to(XYZ_cd_m2.astype(np.float32), (height, width, 3)).copy()

    def _middle(self, eye: Eye) -> CodeTriple:
        """Return the codes in 0..1 of the pixel nearest the middle of ``eye``'s view that is its own."""
        view = self._presenter.eye_view(eye)
        area = next(area for area in self._presenter.areas if eye in area.eyes)
        height, width = view.shape[:2]
        row, column = height // 2, width // 2
        if area.weave is not None:
            own = area.weave.mask(height, width)[row - 1 : row + 1, column - 1 : column + 1]
            down, across = np.argwhere(own)[0]
            row, column = row - 1 + int(down), column - 1 + int(across)
        red, green, blue = (float(code) / self.highest for code in view[row, column])
        return red, green, blue
