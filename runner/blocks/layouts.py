"""Where pictures and words stand in a trial, in pixels from the middle of each eye's view."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from runner.presenter.scene import Offset, Picture


@dataclass(frozen=True, slots=True)
class PairLayout:
    """Where two pictures and the question stand, and a reference picture if there is one."""

    arrangement: Literal["vertical", "horizontal"]
    first_px: Offset
    second_px: Offset
    aperture_px: tuple[int, int]
    question_px: Offset
    question_width_px: int
    reference_px: Offset | None = None

    @property
    def keys(self) -> dict[str, str]:
        """The arrow keys that choose the first and the second picture."""
        vertical = self.arrangement == "vertical"
        return {"up": "first", "down": "second"} if vertical else {"left": "first", "right": "second"}

    @property
    def position_names(self) -> tuple[str, str]:
        """What the first and the second place are called in the record."""
        return ("top", "bottom") if self.arrangement == "vertical" else ("left", "right")

    @property
    def places_px(self) -> tuple[Offset, ...]:
        """Where pictures are shown."""
        places = (self.first_px, self.second_px)
        return places if self.reference_px is None else (*places, self.reference_px)

    def reference(self, stimulus: str | None) -> tuple[Picture, ...]:
        """Return the reference picture in its place, or nothing."""
        if stimulus is None or self.reference_px is None:
            return ()
        return (Picture(stimulus, self.reference_px, self.aperture_px),)


@dataclass(frozen=True, slots=True)
class SingleLayout:
    """Where one picture and the words above it stand; ``below_px`` is the first free row under it."""

    picture_px: Offset
    aperture_px: tuple[int, int]
    question_px: Offset
    question_width_px: int
    below_px: int
    reference_px: Offset | None = None

    @property
    def places_px(self) -> tuple[Offset, ...]:
        """Where pictures are shown."""
        return (self.picture_px,) if self.reference_px is None else (self.picture_px, self.reference_px)

    def reference(self, stimulus: str | None) -> tuple[Picture, ...]:
        """Return the reference picture in its place, or nothing."""
        if stimulus is None or self.reference_px is None:
            return ()
        return (Picture(stimulus, self.reference_px, self.aperture_px),)
