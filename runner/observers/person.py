"""A person at the presenter's window: keys, mouse, wheel, gamepad, or a response box that acts as a keyboard."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from runner.blocks.tasks import Rate, Task, Write
from runner.ports import Ask, KeyPress
from runner.presenter.scene import Offset

# What a key that is held down may go on doing, as long as it means the same: rub out, and move along a scale.
HELD_MEANINGS = frozenset({"erase", "lower", "higher"})
# The second click of a double click answers nothing: it was never meant for what came after the first.
DOUBLE_CLICK_S = 0.25


def _no_mouse(wanted: bool, at_once: bool) -> None:
    """Point nowhere."""


@dataclass(slots=True)
class Person:
    """Waits for presses from ``wait_key``, which sleeps until the next one and returns it with its time.

    ``point`` lets the mouse point, or no longer; after a click its pointer is there at once, otherwise once it moves.
    Presses that mean nothing to the ask are dropped.
    """

    wait_key: Callable[[], KeyPress]
    point: Callable[[bool, bool], object] = _no_mouse
    _clicked_s: float = field(init=False, default=-math.inf)
    _by_mouse: bool = field(init=False, default=False)
    _last: tuple[str, str | None] = field(init=False, default=("", None))
    _task: Task | None = field(init=False, default=None)
    _since_s: float = field(init=False, default=0.0)

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        """Return the first press after the onset that means something here, or of ``escape``.

        Whoever types, or turns the wheel along a scale, is faster than pages are drawn: there a press counts from when
        the field or scale was first shown, with the onset as its time if it was made before that.
        """
        self.point(bool(ask.targets), self._by_mouse)
        if not self._continues(ask.task):
            self._since_s = onset_s
        self._task = ask.task
        try:
            while True:
                press = self._read(ask, self.wait_key())
                if press is None or press.time_s < self._since_s:
                    continue
                meaning = ask.meaning(press.key)
                if meaning is not None or press.key == "escape":
                    self._last = press.key, meaning
                    self._by_mouse = press.key.startswith("click ")
                    if self._by_mouse:
                        self._clicked_s = press.time_s
                    return KeyPress(press.key, max(press.time_s, onset_s))
        finally:
            self.point(False, False)

    def _continues(self, task: Task) -> bool:
        """Return whether ``task`` is the one that was answered last, and that answer did not end it."""
        before, (_, meaning) = self._task, self._last
        if isinstance(task, Write) and isinstance(before, Write):
            return task.name == before.name and meaning != "accept"
        if isinstance(task, Rate) and isinstance(before, Rate):
            return (task.name, task.stimulus) == (before.name, before.stimulus) and meaning in ("lower", "higher")
        return False

    def _read(self, ask: Ask, press: KeyPress) -> KeyPress | None:
        """Return what a click hit, and what a held key does again; None if that is nothing."""
        kind, _, rest = press.key.partition(" ")
        if kind == "click_at":
            meaning = hit(ask, rest)
            if meaning is None or press.time_s - self._clicked_s < DOUBLE_CLICK_S:
                return None
            return KeyPress(f"click {meaning}", press.time_s)
        if kind == "again":
            meaning = ask.meaning(rest)
            return KeyPress(rest, press.time_s) if meaning in HELD_MEANINGS and self._last == (rest, meaning) else None
        return press


def hit(ask: Ask, words: str) -> str | None:
    """Return the meaning of the target at a place such as ``12,-40``, None if there is none."""
    across, _, down = words.partition(",")
    place: Offset = (int(across), int(down))
    return next((meaning for meaning, target in ask.targets.items() if target.holds(place)), None)
