"""What a measurement needs of a screen: a patch shown to the eyes, kept there, and words for the person beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from devices.patches import Patch, PatchEye
from runner.presenter.surfaces.surface import Surface

CodeTriple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Shown:
    """The codes in 0..1 of the eye that is read and of the other one, None where they share their pixels.

    ``read_back`` says that they were read off the screen, as they are not those of the patch.
    """

    own: CodeTriple
    other: CodeTriple | None
    read_back: bool = False


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
