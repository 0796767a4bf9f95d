"""`kind: instructions` and `kind: break`: pages of words."""

from __future__ import annotations

from typing import Literal

from runner.blocks.message import Message
from runner.protocol.kinds.block_spec import BlockSpec
from runner.protocol.parts import Words
from runner.protocol.setting import Setting


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
