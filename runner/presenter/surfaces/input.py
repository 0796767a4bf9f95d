"""What is done at a window: keys, characters, wheel, mouse and gamepads, in one queue, each stamped as it is told."""

from __future__ import annotations

import time
from collections import deque
from typing import Any

import glfw

from runner.ports import KeyPress
from runner.presenter.pointer import Pointer
from runner.presenter.surfaces.characters import typed_character
from runner.presenter.surfaces.gamepads import Gamepads
from runner.presenter.surfaces.keys import key_name


class Input:
    """Hears glfw's callbacks of one window or more; ``pointed`` says whether the pointer was moved since it was drawn.

    ``presses`` are those that nobody took yet, as `Surface.wait_key` describes them.
    """

    def __init__(self) -> None:
        self.presses: deque[KeyPress] = deque()
        self.pointed = False
        self._again = False
        self._wheel_steps = 0.0
        self._pointer: Pointer | None = None
        self._cursor_px: tuple[float, float] | None = None

    def listen(self, window: Any) -> None:
        """Hear what is done at ``window``, but for the mouse's motion."""
        glfw.set_key_callback(window, self._on_key)
        glfw.set_char_callback(window, self.on_character)
        glfw.set_scroll_callback(window, self._on_wheel)
        glfw.set_mouse_button_callback(window, self._on_button)

    def listen_to_motion(self, window: Any) -> None:
        """Hear the mouse's motion over ``window``, which must be one only."""
        glfw.set_cursor_pos_callback(window, self._on_motion)
        glfw.set_cursor_enter_callback(window, self._on_enter)

    def follow_mouse(self, window: Any, pointer: Pointer | None) -> None:
        """Let the mouse, taken by ``window``, move ``pointer`` from now on; with None it moves and clicks nothing."""
        self._pointer, self.pointed = pointer, False
        if pointer is not None and glfw.get_input_mode(window, glfw.CURSOR) != glfw.CURSOR_DISABLED:
            glfw.set_input_mode(window, glfw.CURSOR, glfw.CURSOR_DISABLED)
            self._cursor_px = glfw.get_cursor_pos(window)

    def read_gamepads(self, gamepads: Gamepads) -> bool:
        """Take what was pressed at ``gamepads``; return whether there are any."""
        presses = gamepads.presses(time.monotonic())
        self.presses.extend(presses or ())
        return presses is not None

    def on_character(self, _window: Any, codepoint: int) -> None:
        """Take a character that was typed; one that a held key repeats is none."""
        now_s = time.monotonic()
        character = typed_character(codepoint)
        if character is not None and not self._again:
            self.presses.append(KeyPress(f"text {character}", now_s))

    def _on_key(self, _window: Any, key: int, scancode: int, action: int, _modifiers: int) -> None:
        now_s = time.monotonic()
        self._again = action == glfw.REPEAT
        if action != glfw.RELEASE and (name := key_name(key, scancode)):
            self.presses.append(KeyPress(f"again {name}" if self._again else name, now_s))

    def _on_wheel(self, _window: Any, _right: float, up: float) -> None:
        now_s = time.monotonic()
        self._wheel_steps += up  # touchpads turn it by parts of a step
        while abs(self._wheel_steps) >= 1.0:
            step = 1.0 if self._wheel_steps > 0.0 else -1.0
            self._wheel_steps -= step
            self.presses.append(KeyPress("wheel_up" if step > 0.0 else "wheel_down", now_s))

    def _on_button(self, _window: Any, button: int, action: int, _modifiers: int) -> None:
        now_s = time.monotonic()
        pointer = self._pointer
        if pointer is not None and pointer.shown and button == glfw.MOUSE_BUTTON_LEFT and action == glfw.PRESS:
            x, y = pointer.place_px
            self.presses.append(KeyPress(f"click_at {x},{y}", now_s))

    def _on_motion(self, _window: Any, x: float, y: float) -> None:
        before_px, self._cursor_px = self._cursor_px, (x, y)
        if self._pointer is not None and before_px is not None:
            self._pointer.move(x - before_px[0], y - before_px[1])
            self.pointed = True

    def _on_enter(self, _window: Any, _entered: int) -> None:
        self._cursor_px = None  # what comes next is where it entered, and no motion
