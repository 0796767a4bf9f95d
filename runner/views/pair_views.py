"""How two stimuli are shown and chosen between: at once in two places, or one after the other in the same place.

The answers may include some that prefer neither of the two: the relaxed forced choice.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Literal

from runner.ports import Ask, Button, Hold, Response, answer
from runner.scene import Item, Offset, Picture, Scene, Text
from runner.views.layout import PairLayout, SingleLayout
from runner.views.pages import CONTINUE_KEYS, page
from runner.views.style import Style

Ties = Literal["none", "no_difference", "not_sure", "both"]
TIES = ("no_difference", "not_sure")
_TIE_KEYS = {"no_difference": "n", "not_sure": "u"}
_APART, _WIDTH, _HEIGHT = 220.0, 210.0, 30.0  # units of Style


def tie_meanings(ties: Ties) -> tuple[str, ...]:
    """Return the answers beside ``first`` and ``second``."""
    return TIES if ties == "both" else () if ties == "none" else (ties,)


def tie_keys(ties: Ties) -> dict[str, str]:
    """Return the keys of these answers."""
    return {_TIE_KEYS[meaning]: meaning for meaning in tie_meanings(ties)}


def tie_words(ties: Ties, middle_px: Offset, style: Style) -> tuple[Text, ...]:
    """Return the answers in small words, side by side about a place."""
    places = _tie_places(ties, middle_px, style)
    said = {m: style.say(m, key=style.interface.key(_TIE_KEYS[m])) for m in places}
    return tuple(
        style.text_at(said[m], place, height=17, width_px=style.px(_WIDTH), share=0.2) for m, place in places.items()
    )


def tie_targets(ties: Ties, middle_px: Offset, style: Style) -> dict[str, Button]:
    """Return where the answers can be clicked."""
    size = style.px(_WIDTH), style.px(_HEIGHT)
    return {meaning: Button(place, size) for meaning, place in _tie_places(ties, middle_px, style).items()}


def _tie_places(ties: Ties, middle_px: Offset, style: Style) -> dict[str, Offset]:
    meanings = tie_meanings(ties)
    left = -_APART * (len(meanings) - 1) / 2
    return {m: (middle_px[0] + style.px(left + _APART * n), middle_px[1]) for n, m in enumerate(meanings)}


_PADS = {"left": "pad_left", "right": "pad_right", "up": "pad_up", "down": "pad_down"}
_BLANK_BETWEEN_S = 0.5
_LABEL_SHARE = 0.3
_LETTER_SHARE = 0.55  # a letter's mean width in the type's height


@dataclass(frozen=True, slots=True)
class SimultaneousView:
    """Two pictures side by side or one above the other, the question above them, answers other than these under it."""

    layout: PairLayout
    words: str
    style: Style
    ties: Ties = "none"
    reference: str | None = None

    @property
    def position_names(self) -> tuple[str, str]:
        """Top and bottom, or left and right."""
        return self.layout.position_names

    @property
    def keys(self) -> dict[str, str]:
        """The arrows towards the pictures, those of a gamepad too, and the letters of the other answers."""
        arrows = self.layout.keys
        return {**arrows, **{_PADS[key]: meaning for key, meaning in arrows.items()}, **tie_keys(self.ties)}

    @property
    def targets(self) -> dict[str, Button]:
        """The pictures themselves, and the words of the other answers."""
        layout = self.layout
        pictures = {
            "first": Button(layout.first_px, layout.aperture_px),
            "second": Button(layout.second_px, layout.aperture_px),
        }
        return {**pictures, **tie_targets(self.ties, self._answers_px, self.style)}

    def pair(self, first: str, second: str) -> Scene:
        """Return both pictures with the question."""
        layout = self.layout
        return Scene(
            (
                Picture(first, layout.first_px, layout.aperture_px),
                Picture(second, layout.second_px, layout.aperture_px),
                *layout.reference(self.reference),
                *self._words,
            )
        )

    def question(self) -> Scene:
        """Return the question alone."""
        return Scene(self._words)

    @property
    def _words(self) -> tuple[Item, ...]:
        layout, (x, y) = self.layout, self.layout.question_px
        if self.ties == "none":
            return (self.style.text_at(self.words, (x, y), width_px=layout.question_width_px),)
        # Above the other answers there is room for a line of large type, or two of small.
        large = len(self.words) * _LETTER_SHARE * self.style.px(24) <= layout.question_width_px
        above, height = (x, y - self.style.px(16)), 24 if large else 17
        question = self.style.text_at(self.words, above, height=height, width_px=layout.question_width_px)
        return question, *tie_words(self.ties, self._answers_px, self.style)

    @property
    def _answers_px(self) -> tuple[int, int]:
        x, y = self.layout.question_px
        return x, y + self.style.px(17)


@dataclass(frozen=True, slots=True)
class SequenceView:
    """Two intervals at one place, numbered above it; then the question in that place's stead."""

    layout: SingleLayout
    words: str
    style: Style
    ties: Ties = "none"
    reference: str | None = None

    @property
    def position_names(self) -> tuple[str, str]:
        """The intervals by number."""
        return "interval_1", "interval_2"

    @property
    def keys(self) -> dict[str, str]:
        """The intervals' numbers or the arrows, those of a gamepad too, and the letters of the other answers."""
        first, second = ("1", "left", "pad_left"), ("2", "right", "pad_right")
        return {**dict.fromkeys(first, "first"), **dict.fromkeys(second, "second"), **tie_keys(self.ties)}

    @property
    def targets(self) -> dict[str, Button]:
        """The intervals' numbers, and the words of the other answers."""
        size = self.style.px(120), self.style.px(100)
        numbers = {
            meaning: Button(place, size) for meaning, place in zip(("first", "second"), self._numbers_px, strict=True)
        }
        return {**numbers, **tie_targets(self.ties, self._answers_px, self.style)}

    def pair(self, first: str, second: str) -> Scene:
        """Return what both intervals will need, to make it ready; never shown."""
        return Scene((*self.interval(0, first).items[:1], *self.interval(1, second).items))

    def interval(self, number: int, stimulus: str, *, hint: str = "") -> Scene:
        """Return an interval, 0 or 1: the picture under its number, with words under it if there are any."""
        x, below = self.layout.picture_px[0], self.layout.below_px + self.style.px(40)
        width_px = self.layout.question_width_px
        hints = (self.style.text_at(hint, (x, below), height=18, width_px=width_px, share=0.2),) if hint else ()
        above = x, self.layout.question_px[1]
        return Scene(
            (
                Picture(stimulus, self.layout.picture_px, self.layout.aperture_px),
                *self.layout.reference(self.reference),
                self.style.text_at(str(number + 1), above, height=36, share=_LABEL_SHARE),
                *hints,
            )
        )

    def between(self) -> Scene:
        """Return what stays between the two intervals: the reference picture, if there is one."""
        return Scene(self.layout.reference(self.reference))

    def question(self) -> Scene:
        """Return the question with the intervals' numbers, and the reference picture if there is one."""
        numbers = zip(map(self._called, "12"), self._numbers_px, strict=True)
        return Scene(
            (
                *self.layout.reference(self.reference),
                self.style.text_at(self.words, self.layout.question_px, width_px=self.layout.question_width_px),
                *(self.style.text_at(label, place, height=48) for label, place in numbers),
                *tie_words(self.ties, self._answers_px, self.style),
            )
        )

    def _called(self, number: str) -> str:
        """Return an interval's number, with what its key prints if that is something else."""
        return number if number in self.style.interface.keys else self.style.interface.key(number)

    @property
    def _numbers_px(self) -> tuple[tuple[int, int], tuple[int, int]]:
        x, y = self._free_px
        return (x - self.style.px(90), y), (x + self.style.px(90), y)

    @property
    def _answers_px(self) -> tuple[int, int]:
        x, y = self._free_px
        return x, y + self.style.px(85)

    @property
    def _free_px(self) -> tuple[int, int]:
        """Where the picture was, or under it where the reference picture stays beside it."""
        if self.layout.reference(self.reference):
            return 0, self.layout.below_px + self.style.px(75)
        return self.layout.picture_px


def gap_s(asked_s: float | None, *, in_sequence: bool) -> float:
    """Return how long black lies between two intervals, in seconds; 0 where pictures are shown at once."""
    if not in_sequence:
        return 0.0
    return _BLANK_BETWEEN_S if asked_s is None else asked_s


def sequence_page(style: Style) -> Ask:
    """Return the page before a sequence."""
    return page(style.say("sequence_page"), style, "begin")


Showing = Generator[Ask | Hold, Response | None, list[float]]


def present(
    view: SimultaneousView | SequenceView, first: str, second: str, exposure_s: float | None, blank_between_s: float
) -> Generator[Ask | Hold, Response | None, tuple[Scene, list[float]]]:
    """Show both as far as they come before the question; to be used with ``yield from``.

    Returned are the scene to ask with, and the times in s that the observer stayed on each interval; none where time
    was not theirs: timed scenes are recorded as such.
    """
    if isinstance(view, SequenceView):
        dwell_s = yield from _intervals(view, first, second, exposure_s, blank_between_s)
        return view.question(), dwell_s
    scene = view.pair(first, second)
    if exposure_s is None:
        return scene, []
    yield Hold("pair", scene, exposure_s)
    return view.question(), []


def _intervals(
    view: SequenceView, first: str, second: str, exposure_s: float | None, blank_between_s: float
) -> Showing:
    dwell_s: list[float] = []
    for number, stimulus in enumerate((first, second)):
        if number and blank_between_s:
            yield Hold("between", view.between(), blank_between_s)
        if exposure_s is not None:
            yield Hold(view.position_names[number], view.interval(number, stimulus), exposure_s)
            continue
        hint = view.style.say("press_space")
        scene = view.interval(number, stimulus, hint=hint)
        upcoming = view.interval(1, second, hint=hint) if number == 0 else None
        picture = Button(view.layout.picture_px, view.layout.aperture_px)
        response = answer((yield Ask(scene, CONTINUE_KEYS, upcoming, targets={"continue": picture})))
        dwell_s.append(response.time_s)
    return dwell_s
