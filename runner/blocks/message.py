"""A page of words: instructions, and breaks between trials."""

from __future__ import annotations

from dataclasses import dataclass

from runner.blocks.steps import Draft, Steps, answer
from runner.ports import Ask
from runner.presenter.scene import Scene, Text

CONTINUE_KEYS = {"space": "continue", "enter": "continue"}
_HINT = "Press the space bar to go on"


def page(words: str, hint: str = _HINT) -> Ask:
    """Return a page that waits for the space bar or Enter."""
    lines = len(words) // 50 + words.count("\n") + 1
    below = 40 + lines * 20
    return Ask(
        Scene(
            (
                Text(words, height_px=30, width_px=820),
                Text(hint, offset_px=(0, min(below + 40, 440)), height_px=20, luminance_share=0.2),
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
