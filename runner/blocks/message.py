"""Pages of words: `kind: instructions`, `kind: break`, breaks between trials, and the pause that Escape opens."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, ClassVar, Literal

from documents.yaml import Natural
from runner.blocks.block import Block, BlockKind, Draft, Steps
from runner.blocks.context import BlockContext
from runner.blocks.text_entry import button
from runner.ports import Ask, Hold, answer
from runner.scene import Offset, Scene
from runner.views.field_types import Seconds, ShortSeconds, Words
from runner.views.pages import page
from runner.views.style import Style


class _PageKind(BlockKind):
    """A page of words, shown until the observer goes on."""

    is_page = begins_with_words = True
    by_scores = has_trials = False

    text: Words
    """The words of the page."""

    def _page(self, words: str, style: Style, hint: str = "press_space") -> Block:
        """Return the block; it takes as long as reading takes, at four words a second."""

        def steps() -> Steps:
            response = answer((yield page(words, style, hint)))
            yield Draft(self.kind, response_time_s=response.time_s, repeatable=False)

        return Block(entry=self, steps=steps, expected_s=max(3.0, len(words.split()) / 4.0))


class Instructions(_PageKind):
    """A page of words."""

    kind: Literal["instructions"]

    def meet(self, setting: BlockContext) -> Block:
        """Return the page."""
        return self._page(self.text, setting.style, setting.hint)


class Break(_PageKind):
    """A break, ended by the observer."""

    kind: Literal["break"]
    text: Words = "Time for a break."

    def meet(self, setting: BlockContext) -> Block:
        """Return the page, in the interface's words if it has none of its own."""
        words = self.text if "text" in self.model_fields_set else setting.style.say("break_page")
        return self._page(words, setting.style)


# The order of keys in what a digest is made of: experiments that were recorded keep theirs.
_TIMES = ("break_every", "fixation_s", "exposure_s", "blank_between_s", "blank_s")


class PausedKind(BlockKind):
    """A kind with pages to rest between its trials. Its keys of time follow the others, but for those of ``_last``."""

    _last: ClassVar[tuple[str, ...]] = ()

    break_every: Natural | None = None
    """After how many trials there is a page to rest; left out, there is none."""

    @classmethod
    def __pydantic_init_subclass__(cls, **more: Any) -> None:
        """Put the keys in order: a kind's own, those of time, and the last."""
        super().__pydantic_init_subclass__(**more)
        order = ("", *_TIMES, *cls._last)
        keys = sorted(cls.__pydantic_fields__, key=lambda key: order.index(key) if key in order else 0)
        cls.__pydantic_fields__ = {key: cls.__pydantic_fields__[key] for key in keys}

    def rests(self, style: Style, words: str, done: int, trials: int, upcoming: Scene | None) -> Iterator[Ask]:
        """Yield a page after ``done`` of the ``trials``, if one comes there; ``words`` is its name in the interface."""
        if self.break_every and done and done % self.break_every == 0:
            yield replace(page(style.say(words, done=done, all=trials), style), upcoming=upcoming)


class TimedKind(PausedKind):
    """A kind whose trials have times, in seconds, to the nearest frame."""

    fixation_s: ShortSeconds = 0.0
    """Seconds of a fixation mark before each trial."""
    exposure_s: Seconds | None = None
    """Seconds that the pictures are shown; left out, until the answer."""
    blank_s: ShortSeconds = 0.0
    """Seconds of an empty screen between trials."""

    def before(self, style: Style, place_px: Offset = (0, 0), *, first_of_all: bool) -> Iterator[Hold]:
        """Yield what is shown before a trial: black after another one, and a cross at a place."""
        if self.blank_s and not first_of_all:
            yield Hold("blank", Scene(), self.blank_s)
        if self.fixation_s:
            yield Hold("fixation", Scene((style.text_at("+", place_px, height=48),)), self.fixation_s)


_OPTIONS = {"c": "continue", "r": "repeat", "n": "note", "s": "stop"}
_TOP, _ROW = -80.0, 72.0


def pause_menu(style: Style, *, can_repeat: bool) -> Ask:
    """Return the menu; its meanings: ``continue``, ``repeat`` (if there is a trial to repeat), ``note``, ``stop``."""
    keys = {key: meaning for key, meaning in _OPTIONS.items() if can_repeat or meaning != "repeat"}
    rows = {key: _TOP + _ROW * row for row, key in enumerate(keys)}
    below = _TOP + _ROW * len(rows) + 10.0
    called = {key: style.interface.key(key) for key in keys}
    wide = 52 if max(map(len, called.values())) == 1 else 100
    buttons = [
        item
        for key, y in rows.items()
        for item in (
            *button(style, called[key], -164 - wide / 2, y, wide, 52),
            *button(style, style.say(f"menu_{keys[key]}"), 35, y, 370, 52),
        )
    ]
    return Ask(
        Scene(
            (
                style.text(style.say("pause"), y=_TOP - 90, height=36),
                *buttons,
                style.text(style.say("menu_kept"), y=below, height=20, share=0.2),
            )
        ),
        {**keys, "escape": "continue"},
        targets={keys[key]: style.target(0, y, 440, 60) for key, y in rows.items()},
    )
