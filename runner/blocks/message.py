"""Pages of words: `kind: instructions`, `kind: break`, breaks between trials, and the pause that Escape opens."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from runner.blocks.block import Block, BlockSpec, Draft, Steps, answer
from runner.blocks.field_types import Words
from runner.blocks.setting import Setting
from runner.blocks.style import FULL_HD_HALF, Style
from runner.blocks.text_entry import button
from runner.ports import Ask
from runner.presenter.scene import Scene

CONTINUE_KEYS = {"space": "continue", "enter": "continue", "pad_a": "continue"}
_TYPE, _LINE, _LETTERS_PER_LINE = 26, 34, 62
_HINT = "Press the space bar to go on"


def page(words: str, style: Style, hint: str = _HINT) -> Ask:
    """Return a page that waits for the space bar, Enter, a gamepad's first button or a click on the hint."""
    lines = sum(1 + len(line) // _LETTERS_PER_LINE for line in words.rstrip().split("\n"))
    below = lines * _LINE / 2 + 60
    return Ask(
        Scene(
            (
                style.text(words.rstrip(), height=_TYPE, width=860),
                style.text(hint, y=below, height=20, share=0.2),
            )
        ),
        CONTINUE_KEYS,
        targets={"continue": style.target(0, below, 400, 50)},
    )


@dataclass(frozen=True, slots=True)
class Message(Block):
    """A page shown until the observer goes on; ``kind`` is ``instructions`` or ``break``."""

    kind: str
    words: str
    style: Style = FULL_HD_HALF

    @property
    def expected_s(self) -> float:
        """As long as reading takes, at four words a second."""
        return max(3.0, len(self.words.split()) / 4.0)

    def steps(self) -> Steps:
        """Show the page and record that it was read."""
        response = answer((yield page(self.words, self.style)))
        yield Draft(self.kind, response_time_s=response.time_s, repeatable=False)


class InstructionsSpec(BlockSpec):
    """A page of words."""

    kind: Literal["instructions"]
    text: Words

    def make(self, setting: Setting) -> Message:
        """Return the page."""
        return Message(self.kind, self.text, setting.style)


class BreakSpec(BlockSpec):
    """A break, ended by the observer."""

    kind: Literal["break"]
    text: Words = "Time for a break."

    def make(self, setting: Setting) -> Message:
        """Return the page."""
        return Message(self.kind, self.text, setting.style)


_OPTIONS = {"c": "continue", "r": "repeat", "n": "note", "s": "stop"}
_WORDS = {
    "continue": "Continue",
    "repeat": "Repeat the last trial",
    "note": "Write a note",
    "stop": "Stop the session",
}
_KEPT = "Every answer so far is kept; a stopped session can be resumed."
_TOP, _ROW = -80.0, 72.0


def pause_menu(style: Style, *, can_repeat: bool) -> Ask:
    """Return the menu; its meanings: ``continue``, ``repeat`` (if there is a trial to repeat), ``note``, ``stop``."""
    keys = {key: meaning for key, meaning in _OPTIONS.items() if can_repeat or meaning != "repeat"}
    rows = {key: _TOP + _ROW * row for row, key in enumerate(keys)}
    below = _TOP + _ROW * len(rows) + 10.0
    buttons = [
        item
        for key, y in rows.items()
        for item in (
            *button(style, key.upper(), -190, y, 52, 52),
            *button(style, _WORDS[keys[key]], 35, y, 370, 52),
        )
    ]
    return Ask(
        Scene(
            (
                style.text("Pause", y=_TOP - 90, height=36),
                *buttons,
                style.text(_KEPT, y=below, height=20, share=0.2),
            )
        ),
        {**keys, "escape": "continue"},
        targets={keys[key]: style.target(0, y, 440, 60) for key, y in rows.items()},
    )
