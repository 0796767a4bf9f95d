"""A rating scale in both eyes' views at the same place, answered by numbers, arrows, wheel, mouse or gamepad."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field, model_validator

from documents.yaml import FileModel
from runner.blocks.block import Fault, Named
from runner.ports import Ask, Button, Rate, Response, answer
from runner.scene import Item, Scene, Text
from runner.views.field_types import Label, Line
from runner.views.layout import SingleLayout
from runner.views.style import Style

MOST_POINTS = 11
_LINE, _END, _BESIDE = 40.0, 360.0, 118.0  # from its top to its line, its middle to either end, and for words there
_NUMBERS, _ANCHORS, _HINT = 78.0, 122.0, 178.0
_CLEAR = 46.0  # what the marker's number needs to either side
_PLAIN, _CHOSEN, _SMALL = 0.25, 0.6, 0.2  # shares of white
_STEPS = {
    "left": "lower",
    "right": "higher",
    "wheel_down": "lower",
    "wheel_up": "higher",
    "pad_left": "lower",
    "pad_right": "higher",
}
_ACCEPT = {"enter": "accept", "space": "accept", "pad_a": "accept"}


WIDEST = 100
Anchor = Annotated[str, Field(max_length=60)]


class Scale(FileModel):
    """A scale of whole numbers, ``lowest`` to ``highest``; more than 11 make a slider.

    ``name`` is what the record calls it. The anchors stand at the ends and in the middle. Without ``confirm`` a number
    key or a click is the answer at once, except on a slider.
    """

    name: Label
    """The name of the scale in the records: small letters, digits and _."""
    question: Line
    """The question above the scale."""
    lowest: Annotated[int, Field(ge=-WIDEST, le=WIDEST)] = 1
    """The smallest number that may be answered."""
    highest: Annotated[int, Field(ge=-WIDEST, le=WIDEST)] = 10
    """The largest number that may be answered."""
    low_anchor: Anchor = ""
    """The words at the lower end of the scale."""
    middle_anchor: Anchor = ""
    """The words in the middle of the scale."""
    high_anchor: Anchor = ""
    """The words at the upper end of the scale."""
    confirm: bool = True
    """Whether a number must be confirmed with Enter."""

    @model_validator(mode="after")
    def _rises(self) -> Scale:
        if not 1 <= self.highest - self.lowest <= WIDEST:
            raise ValueError(f"'highest' must be above 'lowest', by {WIDEST} at most")
        return self

    @property
    def is_slider(self) -> bool:
        """Whether there are too many points to give each a number."""
        return self.highest - self.lowest >= MOST_POINTS

    @property
    def numbers(self) -> range:
        """What can be answered."""
        return range(self.lowest, self.highest + 1)

    @property
    def numbered(self) -> tuple[int, ...]:
        """The points that have their number beside them."""
        if not self.is_slider:
            return tuple(self.numbers)
        return tuple(dict.fromkeys(self._part(quarter, 4) for quarter in range(5)))

    @property
    def at_once(self) -> bool:
        """Whether a number is the answer without being confirmed."""
        return not self.confirm and not self.is_slider

    @property
    def number_keys(self) -> dict[str, str]:
        """The digits and the numbers they mean: themselves, or tenths of a slider; 0 is 10 where a scale ends there."""
        if self.is_slider:
            return {str(digit): str(self._part(digit, 10)) for digit in range(10)}
        keys = {str(number): str(number) for number in self.numbers if 0 <= number <= 9}
        return {**keys, "0": "10"} if self.highest == 10 and self.lowest > 0 else keys

    @property
    def keys(self) -> dict[str, str]:
        """What keys mean once the marker stands somewhere."""
        return {**self.number_keys, **_STEPS, **_ACCEPT}

    def place(self, number: int) -> float:
        """Return how far along the line ``number`` stands, from 0 at its left end to 1."""
        return (number - self.lowest) / (self.highest - self.lowest)

    def moved(self, current: int | None, meaning: str) -> int:
        """Return where a press puts the marker; the first step puts it in the middle."""
        if meaning not in ("lower", "higher"):
            return int(meaning)
        if current is None:
            return (self.lowest + self.highest) // 2
        step = 1 if meaning == "higher" else -1
        return min(self.highest, max(self.lowest, current + step))

    def _part(self, part: int, of: int) -> int:
        return self.lowest + round((self.highest - self.lowest) * part / of)


def ends_of(scales: Sequence[Scale]) -> dict[str, tuple[int, int]]:
    """Return the lowest and the highest number of each scale by its name."""
    return {scale.name: (scale.lowest, scale.highest) for scale in scales}


@dataclass(frozen=True, slots=True)
class RatedScene:
    """What is rated: ``stimulus``, against ``reference`` if there is one; ``items`` are drawn with the scale, first.

    With a ``layout`` the question stands above its picture and the scale below it, without one both stand in the
    middle. ``upcoming`` is the scene to make ready.
    """

    layout: SingleLayout | None = None
    items: tuple[Item, ...] = ()
    stimulus: str | None = None
    reference: str | None = None
    upcoming: Scene | None = None


def rate(
    scale: Scale,
    style: Style,
    about: RatedScene = RatedScene(),  # it is frozen
) -> Generator[Ask, Response | None, tuple[int, float]]:
    """Ask for a number on ``scale``; return it and the time it took in s. To be used with ``yield from``.

    The time is the sum of the times of all presses, each from the onset of its screen or, where the press before moved
    nothing, from that press.
    """
    current: int | None = None
    took_s = 0.0
    while True:
        drawn = scale_items(scale, style, current, about.layout)
        keys = {**scale.number_keys, **_jumps(scale, current), **_STEPS, **(_ACCEPT if current is not None else {})}
        ask = Ask(
            Scene((*about.items, *drawn)),
            keys,
            about.upcoming,
            Rate(scale.name, scale.lowest, scale.highest, about.stimulus, about.reference, current),
            scale_targets(scale, style, current, about.layout),
        )
        response = answer((yield ask))
        took_s += response.time_s
        if response.meaning == "accept" and current is not None:
            return current, took_s
        current = scale.moved(current, response.meaning)
        if scale.at_once and response.meaning not in ("lower", "higher"):
            return current, took_s


def rate_all(
    scales: Sequence[Scale], style: Style, about: RatedScene
) -> Generator[Ask, Response | None, tuple[dict[str, int], dict[str, float]]]:
    """Ask for a number on each scale; return the numbers and their times in s, both by the scales' names."""
    ratings: dict[str, int] = {}
    times_s: dict[str, float] = {}
    for scale in scales:
        ratings[scale.name], time_s = yield from rate(scale, style, about)
        times_s[scale.name] = round(time_s, 6)
    return ratings, times_s


def _jumps(scale: Scale, current: int | None) -> dict[str, str]:
    """Return the keys that go far along a slider."""
    if not scale.is_slider:
        return {}
    keys = {"home": str(scale.lowest), "end": str(scale.highest)}
    if current is not None:
        tenth = max(1, round((scale.highest - scale.lowest) / 10))
        keys["page_down"] = str(max(scale.lowest, current - tenth))
        keys["page_up"] = str(min(scale.highest, current + tenth))
    return keys


def scale_items(
    scale: Scale, style: Style, current: int | None, layout: SingleLayout | None = None
) -> tuple[Item, ...]:
    """Return the question, the scale and, if it stands at ``current``, its marker."""
    top = _top(style, layout)
    line, end = top + _LINE, _end(style)
    items: list[Item] = [_question(scale, style, top, layout), style.box(0, line, 2 * end, 3, _PLAIN)]
    at = {number: end * (2 * scale.place(number) - 1) for number in scale.numbers}
    for number in scale.numbered:
        items.append(style.box(at[number], line, 3, 22, _PLAIN))
        if current is None or abs(at[number] - at[current]) > _CLEAR:
            items.append(style.text(str(number), at[number], top + _NUMBERS, height=24, share=_PLAIN))
    if current is not None:
        items.append(style.box(at[current], line, 16, 40, _CHOSEN))
        items.append(style.text(str(current), at[current], top + _NUMBERS, height=30, share=_CHOSEN))
    anchors = ((scale.low_anchor, -end), (scale.middle_anchor, 0.0), (scale.high_anchor, end))
    items += [style.text(words, x, top + _ANCHORS, height=20, width=230, share=_SMALL) for words, x in anchors if words]
    items.append(style.text(style.say(_hint(scale, current)), 0, top + _HINT, height=20, share=_SMALL))
    return tuple(items)


def scale_targets(
    scale: Scale, style: Style, current: int | None, layout: SingleLayout | None = None
) -> dict[str, Button]:
    """Return where each number can be clicked, and where the marker's number can be accepted."""
    top = _top(style, layout)
    end = _end(style)
    width = 2 * end / (scale.highest - scale.lowest)
    high = _NUMBERS - _LINE
    targets = {
        str(number): style.target(end * (2 * scale.place(number) - 1), top + _LINE + high / 2, width, 2 * high)
        for number in scale.numbers
    }
    if current is not None:
        targets["accept"] = style.target(0, top + _HINT, 320, 44)
    return targets


def _top(style: Style, layout: SingleLayout | None) -> float:
    return -20.0 if layout is None else layout.below_px / style.unit_px


def _end(style: Style) -> float:
    """Return how far from its middle a scale may end, with room for words there."""
    return min(_END, style.width / 2 - _BESIDE)


def _question(scale: Scale, style: Style, top: float, layout: SingleLayout | None) -> Text:
    if layout is None:
        return style.text(scale.question, 0, top - 110, height=30)
    return style.text_at(scale.question, layout.question_px, width_px=layout.question_width_px)


def _hint(scale: Scale, current: int | None) -> str:
    if current is not None:
        return "scale_done"
    if scale.is_slider:
        return "scale_slider"
    return "scale_number" if set(scale.number_keys.values()) else "scale_arrows"


def scale_faults(scales: Sequence[Scale], *path: str | int) -> Iterator[Fault]:
    """Yield the faults of a list of scales: names that stand twice."""
    names = [scale.name for scale in scales]
    for index, name in enumerate(names):
        if name in names[:index]:
            yield Fault(f"two scales are called '{name}'", (*path, index, "name"), "give each a name of its own")


def scales_named(scales: Sequence[Scale]) -> Iterator[Named]:
    """Yield each scale's name, which means its numbers."""
    for index, scale in enumerate(scales):
        numbers = scale.lowest, scale.highest
        yield Named("scale", scale.name, numbers, f"{numbers[0]} to {numbers[1]}", ("ratings", index, "name"))
