"""What a measurement needs of a screen: a patch shown to the eyes, kept there, and words for the person beside it."""

from __future__ import annotations

from typing import Protocol

from devices.compensation.eye_view import Size
from devices.measurements.log import Shown
from devices.patches import Patch, PatchEye
from runner.presenter.modes.mode import EyeArea
from runner.presenter.surfaces.surface import Surface


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

    def show_patch(self, patch: Patch, eye: PatchEye) -> Shown:
        """Show ``patch`` from now on in a measurement of ``eye``, and return what stands there."""

    def redraw(self) -> None:
        """Show the patch again, to the next eye where they take turns."""

    def say(self, words: str) -> None:
        """Show ``words`` over the patch until other ones come; none if they are empty."""
