"""A page of words: instructions, and breaks between trials."""

from __future__ import annotations

from dataclasses import dataclass

from runner.blocks.steps import Draft, Steps, answer
from runner.ports import Ask
from runner.presenter.scene import Scene, Text

CONTINUE_KEYS = {"space": "continue", "enter": "continue"}
_TYPE_PX, _LINE_PX, _WIDTH_PX, _LETTERS_PER_LINE = 26, 34, 860, 62
_HINT = "Press the space bar to go on"


def page(words: str, hint: str = _HINT) -> Ask:
    """Return a page that waits for the space bar or Enter."""
    lines = sum(1 + len(line) // _LETTERS_PER_LINE for line in words.rstrip().split("\n"))
    below = round(lines * _LINE_PX / 2)
    return Ask(
        Scene(
            (
                Text(words.rstrip(), height_px=_TYPE_PX, width_px=_WIDTH_PX),
                Text(hint, offset_px=(0, below + 60), height_px=20, luminance_share=0.2),
            )
        ),
        CONTINUE_KEYS,
    )


@dataclass(frozen=True, slots=True)
class Message:
    """A page shown until the observer goes on; ``kind`` is ``instructions`` or ``break``."""

    kind: str
    words: str

    @property
    def trials(self) -> int:
        """None of it is scored."""
        return 0

    def steps(self) -> Steps:
        """Show the page and record that it was read."""
        response = answer((yield page(self.words)))
        yield Draft(self.kind, response_time_s=response.time_s)
