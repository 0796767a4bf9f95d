"""Pages of words: `kind: instructions`, `kind: break`, breaks between trials, and the pause that Escape opens."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from runner.blocks.block import Block, BlockSpec, Draft, Steps, answer
from runner.blocks.field_types import Words
from runner.blocks.setting import Setting
from runner.blocks.style import FULL_HD_HALF, Style
from runner.blocks.text_entry import button
from runner.ports import Ask, Target
from runner.presenter.lettering import text_area
from runner.presenter.scene import Scene

PAGES = ("instructions", "break")
CONTINUE_KEYS = {"space": "continue", "enter": "continue", "pad_a": "continue"}
_TYPE, _WIDTH, _HINT_BELOW, _HINT_ROOM = 26, 860, 60, 20


def page(words: str, style: Style, hint: str = "press_space") -> Ask:
    """Return a page that waits for the space bar, Enter, a gamepad's first button or a click on the ``hint``.

    The hint is one of the interface's words: ``press_space``, ``next_page``, ``begin`` or ``finish``.
    """
    text = style.text(words.rstrip(), height=_TYPE, width=_WIDTH)
    area = text_area(text)
    # In the middle, or higher where the hint would not fit below.
    below = (area.bottom if area else 0) + style.px(_HINT_BELOW)
    up = max(0, below + style.px(_HINT_ROOM) - style.room_px[1] // 2)
    told = style.text(style.say(hint), height=20, share=0.2)
    place = 0, below - up
    return Ask(
        Scene((replace(text, offset_px=(0, -up)), replace(told, offset_px=place))),
        CONTINUE_KEYS,
        targets={"continue": Target(place, (style.px(400), style.px(50)))},
    )


@dataclass(frozen=True, slots=True)
class Message(Block):
    """A page shown until the observer goes on; ``kind`` is ``instructions`` or ``break``."""

    kind: str
    words: str
    style: Style = FULL_HD_HALF
    hint: str = "press_space"

    @property
    def expected_s(self) -> float:
        """As long as reading takes, at four words a second."""
        return max(3.0, len(self.words.split()) / 4.0)

    def steps(self) -> Steps:
        """Show the page and record that it was read."""
        response = answer((yield page(self.words, self.style, self.hint)))
        yield Draft(self.kind, response_time_s=response.time_s, repeatable=False)


class InstructionsSpec(BlockSpec):
    """A page of words."""

    kind: Literal["instructions"]
    """Which kind of entry this is; it decides which other keys there are."""
    text: Words
    """The words of the page."""

    def make(self, setting: Setting) -> Message:
        """Return the page."""
        return Message(self.kind, self.text, setting.style, setting.hint)


class BreakSpec(BlockSpec):
    """A break, ended by the observer."""

    kind: Literal["break"]
    """Which kind of entry this is; it decides which other keys there are."""
    text: Words = "Time for a break."
    """The words of the page."""

    def make(self, setting: Setting) -> Message:
        """Return the page, in the interface's words if it has none of its own."""
        words = self.text if "text" in self.model_fields_set else setting.style.say("break_page")
        return Message(self.kind, words, setting.style)


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
