"""How one stimulus is shown and asked about with yes or no: at one place, the two answers side by side under it."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

from runner.blocks.block import Hold
from runner.blocks.layout import SingleLayout
from runner.blocks.style import Style
from runner.ports import Target
from runner.scene import Item, Offset, Picture, Scene

YES_NO = ("yes", "no")
_KEYS = {"left": "yes", "pad_left": "yes", "right": "no", "pad_right": "no"}
_APART, _BELOW, _WIDTH, _HEIGHT = 240.0, 75.0, 220.0, 60.0  # units of Style


@dataclass(frozen=True, slots=True)
class DetectionView:
    """One picture under the question; the left arrow says yes, the right one no, and so do clicks on these words."""

    layout: SingleLayout
    words: str
    style: Style
    reference: str | None = None

    @property
    def keys(self) -> dict[str, str]:
        """The arrows, those of a gamepad too."""
        return dict(_KEYS)

    @property
    def targets(self) -> dict[str, Target]:
        """The words of the answers."""
        size = self.style.px(_WIDTH), self.style.px(_HEIGHT)
        return {meaning: Target(place, size) for meaning, place in zip(YES_NO, self._places_px, strict=True)}

    def scene(self, stimulus: str) -> Scene:
        """Return the picture with the question and the answers."""
        return Scene((*self._pictures(stimulus), *self._words))

    def question(self) -> Scene:
        """Return the question and the answers, and the reference picture if there is one."""
        return Scene((*self.layout.reference(self.reference), *self._words))

    def present(self, stimulus: str, exposure_s: float | None) -> Generator[Hold, None, Scene]:
        """Show the picture as far as it comes before the question, and return the scene to ask with."""
        if exposure_s is None:
            return self.scene(stimulus)
        yield Hold("picture", Scene(self._pictures(stimulus)), exposure_s)
        return self.question()

    def _pictures(self, stimulus: str) -> tuple[Item, ...]:
        layout = self.layout
        return Picture(stimulus, layout.picture_px, layout.aperture_px), *layout.reference(self.reference)

    @property
    def _words(self) -> tuple[Item, ...]:
        layout, style = self.layout, self.style
        said = (style.say("yes_key"), style.say("no_key"))
        return (
            style.text_at(self.words, layout.question_px, width_px=layout.question_width_px),
            *(
                style.text_at(words, place, height=20, width_px=style.px(_WIDTH))
                for words, place in zip(said, self._places_px, strict=True)
            ),
        )

    @property
    def _places_px(self) -> tuple[Offset, Offset]:
        y = self.layout.below_px + self.style.px(_BELOW)
        half = self.style.px(_APART / 2)
        return (-half, y), (half, y)
