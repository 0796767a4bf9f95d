"""A person at the keyboard of the presenter's window."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from runner.ports import Ask, KeyPress


@dataclass(frozen=True, slots=True)
class Keyboard:
    """Waits for presses from ``wait_key``, which sleeps until the next one and returns it with its time."""

    wait_key: Callable[[], KeyPress]

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        """Return the first press after the onset that means something here."""
        while True:
            press = self.wait_key()
            if press.time_s >= onset_s and (ask.meaning(press.key) is not None or press.key == "escape"):
                return press
