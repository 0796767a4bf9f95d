"""Pages of words: `kind: instructions` and `kind: break`, and the breaks between trials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from runner.blocks.block import Block, BlockSpec, Draft, Steps, answer
from runner.blocks.field_types import Words
from runner.blocks.setting import Setting
from runner.blocks.style import FULL_HD_HALF, Style
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
