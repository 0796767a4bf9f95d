"""What keys ask for while patches are shown: a pause, a stop, or that the person is ready."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from runner.measuring.patch_screen import PatchScreen
from runner.ports import DOUBLE_S, KeyPress, WindowClosed

_IDLE_S = 0.004
_REFRESH_HZ = 60.0
_READY = ("space", "enter", "right", "page_down")
_LEAST_S = 0.1  # a press that comes sooner was not meant for the words


class Keys:
    """What keys ask for. ``poll`` keeps the screen and hears the keys once; it sleeps for the least while."""

    def __init__(self, screen: PatchScreen, say: Callable[[str], None], on_stop: str = "stopping") -> None:
        self._screen = screen
        self._say = say
        self._on_stop = on_stop
        self._refresh_s = 1.0 / (screen.surface.facts.refresh_hz or _REFRESH_HZ)
        self._paced = screen.surface.facts.vsync
        self._asking = False
        self._asked_s = 0.0
        self._ended = KeyPress("", -math.inf)
        self.paused = False
        self.stops = 0

    def poll(self) -> str:
        """Return the last other key that was pressed, an empty text if none.

        The second press of a double press counts for nothing. A closed window is as two presses of Escape.
        """
        other = ""
        try:
            for press in self._screen.surface.poll_keys():
                if press.key == self._ended.key and press.time_s - self._ended.time_s < DOUBLE_S:
                    continue
                if press.key == "escape" or (press.key == "space" and not self._asking):
                    self._ended = press
                if press.key == "space" and not self._asking:
                    self.paused = not self.paused
                    self._say("paused: space resumes" if self.paused else "resumed")
                elif press.key == "escape":
                    self.stops += 1
                    self._say(self._on_stop)
                elif not press.key.startswith(("text ", "again ", "click", "ctrl+", "alt+", "super+")):
                    if not self._asking:
                        other = press.key
                    elif press.time_s >= self._asked_s + _LEAST_S:
                        other, self._ended = press.key, press
        except WindowClosed:
            self.stops = 2
        if self._screen.takes_turns:
            self._screen.redraw()
            if not self._paced:
                time.sleep(self._refresh_s)
        else:
            time.sleep(_IDLE_S)
        return other

    def wait(self, seconds: float) -> None:
        """Keep the screen for ``seconds``, pauses not counted, less if asked to stop."""
        left_s, last_s = seconds, time.monotonic()
        while left_s > 0 and not self.stops:
            self.poll()
            now_s = time.monotonic()
            left_s -= 0.0 if self.paused else now_s - last_s
            last_s = now_s

    def wait_while_paused(self) -> None:
        """Keep the screen until the pause ends or it is to stop."""
        while self.paused and not self.stops:
            self.poll()

    def ask(self, words: str) -> bool:
        """Show ``words`` until space or another key continues, and return True; False if it is to stop."""
        self._say(f"{words} Space continues.")
        self._screen.say(f"{words}\nSpace continues, Escape stops.")
        self._screen.surface.hear()
        self._asked_s = time.monotonic()
        self._asking = True
        try:
            while not self.stops:
                if self.poll() in _READY:
                    return True
        finally:
            self._asking = False
            self._screen.say("")
        return False
